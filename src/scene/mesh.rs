//! Triangle meshes and their instances.

use std::sync::Arc;

use glam::{Affine3A, Vec2, Vec3};

use crate::Bounds;

/// Vertex positions in object space, shared with the acceleration structure without a copy.
///
/// The buffer ends in one vertex of padding, since Embree reads four bytes past the last position.
#[derive(Clone, Debug, PartialEq)]
pub struct Positions(Arc<Vec<[f32; 3]>>);

impl Positions {
    /// Takes over a list of positions.
    pub fn new(mut positions: Vec<[f32; 3]>) -> Self {
        positions.reserve_exact(1);
        positions.push([0.0; 3]);
        Self(Arc::new(positions))
    }

    /// The positions, without the padding.
    #[inline(always)]
    pub fn as_slice(&self) -> &[[f32; 3]] {
        self.0.split_last().map_or(&[], |(_, rest)| rest)
    }

    /// The buffer with its padding vertex at the end.
    pub fn padded(&self) -> &Arc<Vec<[f32; 3]>> {
        &self.0
    }
}

/// Which material each triangle has; indices into [`Scene::materials`](super::Scene::materials).
#[derive(Clone, Debug, PartialEq)]
pub enum TriangleMaterials {
    /// One material for all triangles.
    Uniform(u32),
    /// One index per triangle.
    PerTriangle(Vec<u32>),
}

impl TriangleMaterials {
    /// The material of one triangle.
    #[inline(always)]
    pub fn of(&self, triangle: u32) -> u32 {
        match self {
            Self::Uniform(material) => *material,
            Self::PerTriangle(materials) => materials.get(triangle as usize).copied().unwrap_or(0),
        }
    }
}

/// Triangles that share vertices: what an acceleration structure is built over.
#[derive(Clone, Debug, PartialEq)]
pub struct TriangleMesh {
    /// Name from the file, for messages.
    pub name: String,
    /// Vertex positions.
    pub positions: Positions,
    /// Vertex indices, three per triangle; always within `positions`.
    pub triangles: Arc<Vec<[u32; 3]>>,
    /// Shading normals per vertex, unit length, or 0 where the triangle's own normal is meant.
    pub normals: Option<Vec<[f32; 3]>>,
    /// Texture coordinates per vertex.
    pub uvs: Option<Vec<[f32; 2]>>,
    /// Linear RGB per vertex, which multiplies k_d.
    pub colors: Option<Vec<[f32; 3]>>,
    /// Materials.
    pub materials: TriangleMaterials,
}

impl TriangleMesh {
    /// A mesh of triangles given by indices into positions, with material 0 and nothing else.
    pub fn new(positions: Vec<[f32; 3]>, triangles: Vec<[u32; 3]>) -> Self {
        Self {
            name: String::new(),
            positions: Positions::new(positions),
            triangles: Arc::new(triangles),
            normals: None,
            uvs: None,
            colors: None,
            materials: TriangleMaterials::Uniform(0),
        }
    }

    /// The mesh with one material for all triangles, an index into [`Scene::materials`](super::Scene::materials).
    pub fn with_material(self, material: u32) -> Self {
        Self { materials: TriangleMaterials::Uniform(material), ..self }
    }

    /// The three corners of a triangle in object space.
    #[inline(always)]
    pub fn corners(&self, triangle: u32) -> [Vec3; 3] {
        let positions = self.positions.as_slice();
        self.triangles[triangle as usize].map(|i| Vec3::from_array(positions[i as usize]))
    }

    /// Box around the vertices in object space.
    pub fn bounds(&self) -> Bounds {
        let mut bounds = Bounds::EMPTY;
        self.positions.as_slice().iter().for_each(|&position| bounds.extend(position.into()));
        bounds
    }

    /// Texture coordinates of a triangle at barycentric (u, v); 0 where the mesh has none.
    #[inline]
    pub fn uv(&self, triangle: u32, u: f32, v: f32) -> Vec2 {
        let (Some(uvs), Some(corners)) = (&self.uvs, self.triangles.get(triangle as usize)) else {
            return Vec2::ZERO;
        };
        let [a, b, c] = corners.map(|i| uvs.get(i as usize).map_or(Vec2::ZERO, |&uv| Vec2::from_array(uv)));
        a * (1.0 - u - v) + b * u + c * v
    }
}

/// A placed mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Instance {
    /// Index into [`Scene::meshes`](super::Scene::meshes).
    pub mesh: u32,
    /// Object to world; `None` for a mesh that is already in world space, which backends put into
    /// their top level without an instance node.
    pub to_world: Option<Affine3A>,
}
