//! Visibility bits in memory, or in a mapped file until some are added.

use bytemuck::try_cast_slice;

use crate::light_mesh::file::MappedSection;
use crate::lights::VisibilityBits;

/// Visibility bits: a mapped file's are used where they lie, and copied once if others are added to them.
#[derive(Default)]
pub struct StoredBits {
    /// All of them, unless they are mapped.
    owned: Vec<VisibilityBits>,
    mapped: Option<MappedSection>,
}

impl StoredBits {
    /// Those of a section; `None` if its bytes are no whole number of chunks of 16 lights.
    pub fn of_section(section: MappedSection) -> Option<Self> {
        if cfg!(target_endian = "big") {
            let (pairs, rest) = section.bytes().as_chunks::<2>();
            let owned = pairs.iter().map(|bytes| VisibilityBits::from_le_bytes(*bytes)).collect();
            return rest.is_empty().then_some(Self { owned, mapped: None });
        }
        let is_whole = try_cast_slice::<u8, VisibilityBits>(section.bytes()).is_ok();
        is_whole.then_some(Self { owned: Vec::new(), mapped: Some(section) })
    }

    /// The bits.
    pub fn as_slice(&self) -> &[VisibilityBits] {
        match &self.mapped {
            Some(section) => try_cast_slice(section.bytes()).unwrap_or_default(),
            None => &self.owned,
        }
    }

    /// The bits, for others to be added.
    pub fn to_mut(&mut self) -> &mut Vec<VisibilityBits> {
        if self.mapped.is_some() {
            self.owned = self.as_slice().to_vec();
            self.mapped = None;
        }
        &mut self.owned
    }

    /// Bytes of memory that are this program's alone, once `more` are added.
    pub fn bytes_with(&self, more: usize) -> usize {
        let all = if more == 0 { self.owned.len() } else { self.as_slice().len() + more };
        all * size_of::<VisibilityBits>()
    }
}
