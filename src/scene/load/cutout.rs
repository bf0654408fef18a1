//! Alpha masks: triangles that rays pass through where their material is transparent.

use std::sync::Arc;

use glam::Vec2;

use crate::scene::{TextureMap, TriangleMesh};

/// Where a material is opaque: where `alpha` times the map's coverage reaches `cutoff`.
#[derive(Clone, Debug)]
pub struct AlphaMask {
    /// Picture whose coverage counts; `None` for 1 everywhere.
    pub map: Option<TextureMap>,
    /// Factor of the coverage.
    pub alpha: f32,
    /// Least value that is opaque.
    pub cutoff: f32,
}

impl AlphaMask {
    fn is_opaque(&self, uv: Vec2) -> bool {
        let coverage = self.map.as_ref().map_or(1.0, |map| map.sample(uv).1);
        self.alpha * coverage >= self.cutoff
    }

    /// Whether the material is opaque everywhere.
    pub fn is_solid(&self) -> bool {
        let transparent = self.map.as_ref().is_some_and(|map| map.texture.has_transparency());
        self.alpha >= self.cutoff && !transparent
    }
}

/// Gives a mesh the cut-outs of its materials; `masks` are by material.
pub fn cut_out(mesh: &mut TriangleMesh, masks: &[Option<AlphaMask>]) {
    let used = |material: u32| masks.get(material as usize).is_some_and(Option::is_some);
    let triangles = mesh.triangles.len() as u32;
    if !(0..triangles).any(|triangle| used(mesh.materials.of(triangle))) {
        return;
    }
    let (corners, materials) = (mesh.triangles.clone(), mesh.materials.clone());
    let uvs = mesh.uvs.clone().unwrap_or_default();
    let masks = masks.to_vec();
    mesh.cutout = Some(Arc::new(move |triangle, u, v| {
        let Some(Some(mask)) = masks.get(materials.of(triangle) as usize) else { return true };
        let Some(corners) = corners.get(triangle as usize) else { return true };
        let [a, b, c] = corners.map(|i| uvs.get(i as usize).map_or(Vec2::ZERO, |&uv| Vec2::from_array(uv)));
        mask.is_opaque(a * (1.0 - u - v) + b * u + c * v)
    }));
}
