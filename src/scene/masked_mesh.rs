//! Triangles that rays pass through where their material is transparent.

use std::sync::Arc;

use super::alpha_mask::AlphaMask;
use super::mesh::TriangleMesh;
use super::scene::Scene;

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Material, Texture, TextureMap, TriangleMaterials, Wrap};
    use glam::Affine2;

    /// Opaque in the left half of the texture only.
    fn left_half() -> AlphaMask {
        let texture = Texture::new(2, 1, vec![[0, 0, 0, 255], [0; 4]]).unwrap();
        let map =
            TextureMap { texture: Arc::new(texture), transform: Affine2::IDENTITY, wrap: [Wrap::Clamp; 2] };
        AlphaMask { map: Some(map), alpha: 1.0, cutoff: 0.5 }
    }

    /// Material 0 is solid, material 1 is not; the texture coordinates are the barycentric ones.
    fn scene(materials: TriangleMaterials) -> Scene {
        let mesh = TriangleMesh::new(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], vec![[0, 1, 2]; 2]);
        let uvs = Some(vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
        let mut scene = Scene::new();
        scene.add_material(Material { alpha_mask: Some(left_half()), ..Material::default() });
        scene.add(TriangleMesh { materials, uvs, ..mesh });
        scene
    }

    /// Filters cost time in every query, so that meshes that are solid must have none.
    #[test]
    fn only_meshes_with_a_masked_triangle_have_masks() {
        let masked = |materials: TriangleMaterials| {
            let scene = scene(materials);
            AlphaMasks::of_scene(&scene).of_mesh(&scene.meshes[0])
        };
        assert!(masked(TriangleMaterials::Uniform(0)).is_none());
        assert!(masked(TriangleMaterials::PerTriangle(vec![0, 0])).is_none());
        assert!(masked(TriangleMaterials::Uniform(1)).is_some());
        assert!(masked(TriangleMaterials::PerTriangle(vec![0, 1])).is_some());
    }

    /// The scene and what acceleration structures keep of it answer alike.
    #[test]
    fn a_masked_triangle_is_opaque_where_its_material_is() {
        let scene = scene(TriangleMaterials::PerTriangle(vec![0, 1]));
        let masked = AlphaMasks::of_scene(&scene).of_mesh(&scene.meshes[0]).unwrap();
        for (triangle, u, opaque) in [(0, 0.25, true), (0, 0.75, true), (1, 0.25, true), (1, 0.75, false)] {
            assert_eq!(masked.is_opaque(triangle, u, 0.1), opaque, "triangle {triangle} at {u}");
            assert_eq!(
                scene.is_opaque(&scene.meshes[0], triangle, u, 0.1),
                opaque,
                "triangle {triangle} at {u}"
            );
        }
        assert_eq!(left_half(), left_half());
    }
}
