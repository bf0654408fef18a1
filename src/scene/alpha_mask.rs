//! Alpha masks: triangles that rays pass through where their material is transparent.

use std::sync::Arc;

use glam::Vec2;

use super::{Scene, TextureMap, TriangleMesh};

/// Where a material is opaque: where `alpha` times the map's coverage reaches `cutoff`.
///
/// Camera, reflected and shadow rays pass through the rest alike.
#[derive(Clone, Debug, PartialEq)]
pub struct AlphaMask {
    /// Image whose coverage counts; `None` for 1 everywhere.
    pub map: Option<TextureMap>,
    /// Factor of the coverage.
    pub alpha: f32,
    /// Least value that is opaque.
    pub cutoff: f32,
}

impl AlphaMask {
    /// Whether the material is opaque at texture coordinates.
    pub fn is_opaque(&self, uv: Vec2) -> bool {
        let coverage = self.map.as_ref().map_or(1.0, |map| map.sample(uv).1);
        self.alpha * coverage >= self.cutoff
    }

    /// Whether the material is opaque everywhere.
    pub fn is_solid(&self) -> bool {
        let transparent = self.map.as_ref().is_some_and(|map| map.texture.has_transparency());
        self.alpha >= self.cutoff && !transparent
    }
}

impl Scene {
    /// The alpha mask of a triangle of one of the scene's meshes; `None` where the triangle is opaque everywhere.
    #[inline]
    pub fn alpha_mask(&self, mesh: &TriangleMesh, triangle: u32) -> Option<&AlphaMask> {
        self.materials.get(mesh.materials.of(triangle) as usize)?.alpha_mask.as_ref()
    }

    /// Whether a triangle of one of the scene's meshes is opaque at barycentric (u, v).
    #[inline]
    pub fn is_opaque(&self, mesh: &TriangleMesh, triangle: u32, u: f32, v: f32) -> bool {
        self.alpha_mask(mesh, triangle).is_none_or(|mask| mask.is_opaque(mesh.uv(triangle, u, v)))
    }
}

/// The alpha masks of a scene's materials, as acceleration structures keep them: shared, so that a clone costs nothing.
#[derive(Clone, Debug)]
pub struct AlphaMasks(Arc<[Option<AlphaMask>]>);

impl AlphaMasks {
    /// The masks of a scene; empty if no material has one.
    pub fn of_scene(scene: &Scene) -> Self {
        let masks = scene.materials.iter().map(|material| material.alpha_mask.clone());
        let any = scene.materials.iter().any(|material| material.alpha_mask.is_some());
        Self(if any { masks.collect() } else { Arc::default() })
    }

    /// The mesh with its masks; `None` for a mesh none of whose triangles has one.
    pub fn of_mesh(&self, mesh: &Arc<TriangleMesh>) -> Option<MaskedMesh> {
        if self.0.is_empty() {
            return None;
        }
        let masked = |triangle| self.of_material(mesh.materials.of(triangle)).is_some();
        let any = (0..mesh.triangles.len() as u32).any(masked);
        any.then(|| MaskedMesh { mesh: mesh.clone(), masks: self.clone() })
    }

    #[inline]
    fn of_material(&self, material: u32) -> Option<&AlphaMask> {
        self.0.get(material as usize).and_then(Option::as_ref)
    }
}

/// A mesh some of whose triangles are transparent in places.
#[derive(Clone, Debug)]
pub struct MaskedMesh {
    mesh: Arc<TriangleMesh>,
    masks: AlphaMasks,
}

impl MaskedMesh {
    /// Whether a triangle is opaque at barycentric (u, v).
    #[inline]
    pub fn is_opaque(&self, triangle: u32, u: f32, v: f32) -> bool {
        let mask = self.masks.of_material(self.mesh.materials.of(triangle));
        mask.is_none_or(|mask| mask.is_opaque(self.mesh.uv(triangle, u, v)))
    }
}
