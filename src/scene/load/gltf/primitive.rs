//! Primitives: vertices and triangles of one glTF mesh.

use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec3};
use gltf_json::mesh::{Mode, Primitive, Semantic};
use gltf_json::validation::Checked;

use super::document::Document;
use crate::scene::load::triangulate::has_no_area;
use crate::scene::load::{LoadError, Skipped};
use crate::scene::{Positions, TriangleMaterials, TriangleMesh};

/// Vertices that one mesh may have.
const MAX_VERTICES: usize = u32::MAX as usize - 1;

/// Joint matrices of a skinned mesh, from its own space to the scene's.
pub type Joints = Vec<DAffine3>;

/// The primitives of a mesh, joined.
#[derive(Default)]
pub struct MeshBuilder {
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    uvs: Vec<[f32; 2]>,
    colors: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
    materials: Vec<u32>,
    /// Elements that were left out.
    pub skipped: Skipped,
}

/// What a primitive needs to know beside itself.
pub struct Context<'a> {
    /// Names the primitive in messages.
    pub place: &'a str,
    /// Material for its triangles.
    pub material: u32,
    /// Which texture coordinates that material uses.
    pub uv_set: u32,
    /// Weights of the morph targets.
    pub weights: &'a [f32],
    /// Joints, if the mesh is skinned.
    pub joints: Option<&'a Joints>,
}

impl MeshBuilder {
    /// Adds a primitive.
    ///
    /// # Errors
    /// [`LoadError::Invalid`] for accessors that don't fit, coordinates that are not finite, and indices out of range.
    pub fn add(
        &mut self,
        document: &Document<'_>,
        primitive: &Primitive,
        context: &Context<'_>,
    ) -> Result<(), LoadError> {
        let place = context.place;
        let attribute =
            |semantic| primitive.attributes.get(&Checked::Valid(semantic)).map(|index| index.value());
        let Checked::Valid(mode) = primitive.mode else {
            return Err(document.error(&format!("{place}.mode"), "is unknown".to_owned()));
        };
        // A primitive without positions is allowed, and draws nothing.
        let Some(accessor) = attribute(Semantic::Positions) else { return Ok(()) };
        let indices_place = format!("{place}.indices");
        let indices = match primitive.indices {
            Some(indices) => Some(document.integers::<1>(indices.value(), &indices_place)?),
            None => None,
        };
        let place_of = |name: &str| format!("{place}.{name}");
        if matches!(mode, Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip) {
            let vertices = document.accessor_len(accessor, &place_of("POSITION"))?;
            let count = indices.map_or(vertices, |indices| indices.len() as u64);
            match mode {
                Mode::Points => self.skipped.points += count,
                Mode::Lines => self.skipped.lines += count / 2,
                Mode::LineLoop => self.skipped.lines += count,
                _ => self.skipped.lines += count.saturating_sub(1),
            }
            return Ok(());
        }

        let mut positions = document.floats::<3>(accessor, &place_of("POSITION"))?;
        let count = positions.len();
        let checked = |found: usize, name: &str| {
            if found == count {
                return Ok(());
            }
            Err(document.error(&place_of(name), format!("has {found} elements for {count} vertices")))
        };
        let mut normals = match attribute(Semantic::Normals) {
            None => None,
            Some(accessor) => Some(document.floats::<3>(accessor, &place_of("NORMAL"))?),
        };
        checked(normals.as_ref().map_or(count, Vec::len), "NORMAL")?;
        self.morph(document, primitive, context, &mut positions, normals.as_deref_mut())?;
        if let Some(joints) = context.joints {
            let accessors = (attribute(Semantic::Joints(0)), attribute(Semantic::Weights(0)));
            if let (Some(which), Some(weights)) = accessors {
                let which = document.integers::<4>(which, &place_of("JOINTS_0"))?;
                let weights = document.floats::<4>(weights, &place_of("WEIGHTS_0"))?;
                checked(which.len(), "JOINTS_0")?;
                checked(weights.len(), "WEIGHTS_0")?;
                skin(&which, &weights, joints, &mut positions, normals.as_deref_mut()).map_err(|joint| {
                    document.error(&place_of("JOINTS_0"), format!("joint {joint} is out of range"))
                })?;
            }
        }
        if let Some(bad) = positions.iter().position(|p| !p.iter().all(|x| x.is_finite())) {
            return Err(document.error(&place_of("POSITION"), format!("vertex {bad} is not finite")));
        }
        if self.positions.len() + count > MAX_VERTICES {
            let limit = MAX_VERTICES as u64;
            return Err(LoadError::TooLarge { file: document.path.to_owned(), what: "vertices", limit });
        }

        let first = self.positions.len();
        self.positions.extend(positions);
        if let Some(normals) = normals {
            self.normals.resize(first, [0.0; 3]);
            self.normals.extend(normals);
        }
        if let Some(accessor) = attribute(Semantic::TexCoords(context.uv_set)) {
            let mut uvs = document.floats::<2>(accessor, &place_of("TEXCOORD"))?;
            checked(uvs.len(), "TEXCOORD")?;
            for uv in uvs.iter_mut().filter(|uv| !uv.iter().all(|x| x.is_finite())) {
                self.skipped.bad_uvs += 1;
                *uv = [0.0; 2];
            }
            self.uvs.resize(first, [0.0; 2]);
            self.uvs.extend(uvs);
        }
        if let Some(accessor) = attribute(Semantic::Colors(0)) {
            let place = place_of("COLOR_0");
            let colors: Vec<[f32; 3]> = match document.components(accessor, &place)? {
                4 => document
                    .floats::<4>(accessor, &place)?
                    .into_iter()
                    .map(|[r, g, b, _]| [r, g, b])
                    .collect(),
                _ => document.floats::<3>(accessor, &place)?,
            };
            checked(colors.len(), "COLOR_0")?;
            self.colors.resize(first, [1.0; 3]);
            let clean = |c: f32| if c.is_finite() { c.max(0.0) } else { 0.0 };
            self.colors.extend(colors.into_iter().map(|color| color.map(clean)));
        }
        let indices = indices.map(|indices| indices.into_iter().map(|[index]| index).collect());
        self.triangles(document, mode, indices, first as u32, count as u32, &indices_place)?;
        self.materials.resize(self.triangles.len(), context.material);
        Ok(())
    }

    /// Appends the triangles of vertices from `first` on.
    fn triangles(
        &mut self,
        document: &Document<'_>,
        mode: Mode,
        indices: Option<Vec<u32>>,
        first: u32,
        count: u32,
        place: &str,
    ) -> Result<(), LoadError> {
        let indices = indices.unwrap_or_else(|| (0..count).collect());
        if let Some(&bad) = indices.iter().find(|&&index| index >= count) {
            let problem = format!("index {bad} is out of range ({count} vertices)");
            return Err(document.error(place, problem));
        }
        let mut push = |corners: [u32; 3]| {
            let corners = corners.map(|corner| first + corner);
            if has_no_area(corners.map(|corner| self.positions[corner as usize])) {
                self.skipped.zero_area_triangles += 1;
            } else {
                self.triangles.push(corners);
            }
        };
        match mode {
            Mode::TriangleStrip => {
                for (i, corners) in indices.windows(3).enumerate() {
                    let [a, b, c] = [corners[0], corners[1], corners[2]];
                    push(if i % 2 == 0 { [a, b, c] } else { [a, c, b] });
                }
            }
            Mode::TriangleFan => {
                let center = indices.first().copied().unwrap_or(0);
                indices
                    .get(1..)
                    .unwrap_or_default()
                    .windows(2)
                    .for_each(|edge| push([edge[0], edge[1], center]));
            }
            _ => {
                indices.chunks_exact(3).for_each(|corners| push([corners[0], corners[1], corners[2]]));
                self.skipped.short_faces += u64::from(!indices.len().is_multiple_of(3));
            }
        }
        Ok(())
    }

    /// Adds the morph targets with their weights.
    fn morph(
        &mut self,
        document: &Document<'_>,
        primitive: &Primitive,
        context: &Context<'_>,
        positions: &mut [[f32; 3]],
        mut normals: Option<&mut [[f32; 3]]>,
    ) -> Result<(), LoadError> {
        let targets = primitive.targets.iter().flatten().zip(context.weights).enumerate();
        for (index, (target, &weight)) in targets.filter(|(_, (_, weight))| **weight != 0.0) {
            let place = format!("{}.targets[{index}]", context.place);
            let lists = [(target.positions, Some(&mut *positions)), (target.normals, normals.as_deref_mut())];
            for (accessor, list) in lists {
                let (Some(accessor), Some(list)) = (accessor, list) else { continue };
                let offsets = document.floats::<3>(accessor.value(), &place)?;
                if offsets.len() != list.len() {
                    let problem = format!("has {} elements for {} vertices", offsets.len(), list.len());
                    return Err(document.error(&place, problem));
                }
                for (value, offset) in list.iter_mut().zip(offsets) {
                    (0..3).for_each(|axis| value[axis] += weight * offset[axis]);
                }
            }
        }
        Ok(())
    }

    /// The mesh; `None` without a triangle.
    pub fn finish(mut self, name: String) -> Option<TriangleMesh> {
        if self.triangles.is_empty() {
            return None;
        }
        let count = self.positions.len();
        for normal in &mut self.normals {
            let direction = DVec3::from_array(normal.map(f64::from)).try_normalize();
            // Zero stands for none: shading then takes the triangle's own.
            *normal = direction.map_or([0.0; 3], |d| d.as_vec3().to_array());
        }
        fn filled<T: Clone>(mut list: Vec<T>, count: usize, value: T) -> Option<Vec<T>> {
            if list.is_empty() {
                return None;
            }
            list.resize(count, value);
            Some(list)
        }
        let first = self.materials.first().copied().unwrap_or(0);
        let materials = if self.materials.iter().all(|&material| material == first) {
            TriangleMaterials::Uniform(first)
        } else {
            TriangleMaterials::PerTriangle(self.materials)
        };
        Some(TriangleMesh {
            name,
            positions: Positions::new(self.positions),
            triangles: Arc::new(self.triangles),
            normals: filled(self.normals, count, [0.0; 3]),
            uvs: filled(self.uvs, count, [0.0; 2]),
            colors: filled(self.colors, count, [1.0; 3]),
            materials,
        })
    }

    /// Normals without a direction, to be counted before [`finish`](Self::finish).
    pub fn bad_normals(&self) -> u64 {
        let bad = |n: &&[f32; 3]| DVec3::from_array(n.map(f64::from)).try_normalize().is_none();
        self.normals.iter().filter(bad).count() as u64
    }
}

/// Moves vertices by the weighted sum of their joints' matrices; `Err` names a joint that does not exist.
fn skin(
    which: &[[u32; 4]],
    weights: &[[f32; 4]],
    joints: &Joints,
    positions: &mut [[f32; 3]],
    mut normals: Option<&mut [[f32; 3]]>,
) -> Result<(), u32> {
    for (vertex, (which, weights)) in which.iter().zip(weights).enumerate() {
        let (mut linear, mut translation, mut total) = (glam::DMat3::ZERO, DVec3::ZERO, 0.0);
        for (&joint, &weight) in which.iter().zip(weights).filter(|(_, weight)| **weight != 0.0) {
            let matrix = joints.get(joint as usize).ok_or(joint)?;
            linear += matrix.matrix3 * f64::from(weight);
            translation += matrix.translation * f64::from(weight);
            total += f64::from(weight);
        }
        if total == 0.0 {
            continue;
        }
        let at = DVec3::from_array(positions[vertex].map(f64::from));
        positions[vertex] = ((linear * at + translation) / total).as_vec3().to_array();
        if let Some(normals) = normals.as_deref_mut() {
            let normal = linear * Vec3::from_array(normals[vertex]).as_dvec3();
            normals[vertex] = normal.as_vec3().to_array();
        }
    }
    Ok(())
}
