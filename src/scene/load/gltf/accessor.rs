//! Accessors: typed, strided, possibly sparse arrays in buffers.

use gltf_json::Accessor;
use gltf_json::accessor::{ComponentType, Type};
use gltf_json::validation::Checked;

use super::document::Document;
use crate::scene::load::LoadError;

/// Elements of an accessor that no buffer backs, which therefore cost the file nothing.
const MAX_UNBACKED: u64 = 1 << 24;

/// Elements of one type at equal distances.
struct Strided<'a> {
    bytes: &'a [u8],
    stride: usize,
    size: usize,
    count: usize,
}

impl<'a> Strided<'a> {
    fn iter(&self) -> impl Iterator<Item = &'a [u8]> + use<'a> {
        let (bytes, stride, size) = (self.bytes, self.stride, self.size);
        (0..self.count).map(move |i| &bytes[i * stride..][..size])
    }
}

impl Document<'_> {
    fn accessor(&self, index: usize, place: &str) -> Result<&Accessor, LoadError> {
        let missing = || self.error(place, format!("accessors[{index}] does not exist"));
        self.root.accessors.get(index).ok_or_else(missing)
    }

    /// Number of elements.
    pub fn accessor_len(&self, index: usize, place: &str) -> Result<u64, LoadError> {
        Ok(self.accessor(index, place)?.count.0)
    }

    /// Components per element.
    pub fn components(&self, index: usize, place: &str) -> Result<usize, LoadError> {
        match self.accessor(index, place)?.type_ {
            Checked::Valid(kind) => Ok(kind.multiplicity()),
            Checked::Invalid => Err(self.error(&format!("accessors[{index}].type"), "is unknown".to_owned())),
        }
    }

    /// Elements of `N` numbers each; normalized integers become fractions, others their value.
    ///
    /// # Errors
    /// [`LoadError::Invalid`] if anything is out of range or of another type; `place` names what refers to it.
    pub fn floats<const N: usize>(&self, index: usize, place: &str) -> Result<Vec<[f32; N]>, LoadError> {
        let accessor = self.accessor(index, place)?;
        let components = self.components(index, place)?;
        if components != N {
            let problem = format!("accessors[{index}] has {components} components instead of {N}");
            return Err(self.error(place, problem));
        }
        let component = self.component_type(accessor, index)?;
        let number = decoder(component, accessor.normalized);
        let size = component.size();
        let element = |bytes: &[u8]| -> [f32; N] { std::array::from_fn(|i| number(&bytes[i * size..])) };
        self.elements(index, accessor, component, element, [0.0; N])
    }

    /// Elements of `N` whole numbers, such as indices.
    ///
    /// # Errors
    /// As [`Document::floats`].
    pub fn integers<const N: usize>(&self, index: usize, place: &str) -> Result<Vec<[u32; N]>, LoadError> {
        let accessor = self.accessor(index, place)?;
        let components = self.components(index, place)?;
        let component = self.component_type(accessor, index)?;
        let read: fn(&[u8]) -> u32 = match component {
            ComponentType::U8 => |b| u32::from(b[0]),
            ComponentType::U16 => |b| u32::from(u16::from_le_bytes([b[0], b[1]])),
            ComponentType::U32 => |b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]),
            _ => {
                return Err(self.error(place, format!("accessors[{index}] does not hold unsigned integers")));
            }
        };
        if components != N {
            let problem = format!("accessors[{index}] has {components} components instead of {N}");
            return Err(self.error(place, problem));
        }
        let size = component.size();
        let element = |bytes: &[u8]| -> [u32; N] { std::array::from_fn(|i| read(&bytes[i * size..])) };
        self.elements(index, accessor, component, element, [0; N])
    }

    fn component_type(&self, accessor: &Accessor, index: usize) -> Result<ComponentType, LoadError> {
        match accessor.component_type {
            Checked::Valid(component) => Ok(component.0),
            Checked::Invalid => {
                Err(self.error(&format!("accessors[{index}].componentType"), "is unknown".to_owned()))
            }
        }
    }

    fn elements<T: Copy>(
        &self,
        index: usize,
        accessor: &Accessor,
        component: ComponentType,
        element: impl Fn(&[u8]) -> T,
        zero: T,
    ) -> Result<Vec<T>, LoadError> {
        let place = format!("accessors[{index}]");
        let components = match accessor.type_ {
            Checked::Valid(kind @ (Type::Mat2 | Type::Mat3)) if component.size() < 4 => {
                return Err(self.error(&place, format!("matrices of type {kind:?} are not expected here")));
            }
            Checked::Valid(kind) => kind.multiplicity(),
            Checked::Invalid => 0,
        };
        let size = components * component.size();
        let offset = accessor.byte_offset.map_or(0, |offset| offset.0);
        let mut values = match accessor.buffer_view {
            Some(view) => {
                let strided = self.strided(view.value(), offset, size, accessor.count.0, &place)?;
                strided.iter().map(&element).collect()
            }
            None if accessor.count.0 > MAX_UNBACKED => {
                return Err(self.error(&place, format!("has {} elements and no data", accessor.count.0)));
            }
            None => vec![zero; accessor.count.0 as usize],
        };
        let Some(sparse) = &accessor.sparse else { return Ok(values) };

        let place = format!("accessors[{index}].sparse");
        let Checked::Valid(index_type) = sparse.indices.component_type else {
            return Err(self.error(&place, "indices.componentType is unknown".to_owned()));
        };
        let (view, offset) = (sparse.indices.buffer_view.value(), sparse.indices.byte_offset.0);
        let indices = self.strided(view, offset, index_type.0.size(), sparse.count.0, &place)?;
        let (view, offset) = (sparse.values.buffer_view.value(), sparse.values.byte_offset.0);
        let replacements = self.strided(view, offset, size, sparse.count.0, &place)?;
        for (at, value) in indices.iter().zip(replacements.iter()) {
            let at = at.iter().rev().fold(0usize, |whole, &byte| whole << 8 | usize::from(byte));
            match values.get_mut(at) {
                Some(target) => *target = element(value),
                None => {
                    let problem = format!("index {at} is out of range ({} elements)", accessor.count.0);
                    return Err(self.error(&place, problem));
                }
            }
        }
        Ok(values)
    }

    /// `count` elements of `size` bytes in a buffer view.
    fn strided(
        &self,
        view: usize,
        offset: u64,
        size: usize,
        count: u64,
        place: &str,
    ) -> Result<Strided<'_>, LoadError> {
        let (bytes, stride) = self.view(view, place)?;
        let stride = stride.unwrap_or(size);
        let beyond = || {
            let problem =
                format!("{count} elements reach beyond the {} bytes of bufferViews[{view}]", bytes.len());
            self.error(place, problem)
        };
        if stride == 0 {
            return Err(self.error(&format!("bufferViews[{view}].byteStride"), "must not be 0".to_owned()));
        }
        let rest = usize::try_from(offset).ok().and_then(|offset| bytes.get(offset..)).ok_or_else(beyond)?;
        let count = usize::try_from(count).map_err(|_| beyond())?;
        if count > 0 {
            let end = (count - 1).checked_mul(stride).and_then(|last| last.checked_add(size));
            if end.is_none_or(|end| end > rest.len()) {
                return Err(beyond());
            }
        }
        Ok(Strided { bytes: rest, stride, size, count })
    }
}

/// Reads one component from the start of some bytes.
fn decoder(component: ComponentType, normalized: bool) -> fn(&[u8]) -> f32 {
    match (component, normalized) {
        (ComponentType::F32, _) => |b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]),
        (ComponentType::U32, _) => |b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as f32,
        (ComponentType::I8, false) => |b| f32::from(b[0] as i8),
        (ComponentType::U8, false) => |b| f32::from(b[0]),
        (ComponentType::I16, false) => |b| f32::from(i16::from_le_bytes([b[0], b[1]])),
        (ComponentType::U16, false) => |b| f32::from(u16::from_le_bytes([b[0], b[1]])),
        (ComponentType::I8, true) => |b| (f32::from(b[0] as i8) / 127.0).max(-1.0),
        (ComponentType::U8, true) => |b| f32::from(b[0]) / 255.0,
        (ComponentType::I16, true) => |b| (f32::from(i16::from_le_bytes([b[0], b[1]])) / 32767.0).max(-1.0),
        (ComponentType::U16, true) => |b| f32::from(u16::from_le_bytes([b[0], b[1]])) / 65535.0,
    }
}
