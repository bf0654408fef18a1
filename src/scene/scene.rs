//! The scene as one value.

use std::sync::Arc;

use glam::{Affine3A, Vec3};

use super::light::{Falloff, Light};
use super::light_groups::LightGroups;
use super::material::Material;
use super::mesh::{Instance, TriangleMesh};
use crate::Bounds;

/// Everything that is rendered, in world space of any unit of length.
///
/// ```
/// use glam::{Affine3A, Vec3};
/// use lightmesh::scene::{Material, Light, Scene, TriangleMesh};
///
/// let mut scene = Scene::new();
/// let red = scene.add_material(Material::diffuse(Vec3::new(0.7, 0.1, 0.1)));
/// let positions = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
/// let mesh = scene.add(TriangleMesh::new(positions, vec![[0, 1, 2]]).with_material(red));
/// scene.place(mesh, Affine3A::from_translation(Vec3::X));
/// scene.lights.push(Light::point(Vec3::Z, Vec3::ONE));
/// scene.validate()?;
/// # Ok::<(), lightmesh::scene::SceneError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// Unique geometry.
    pub meshes: Vec<Arc<TriangleMesh>>,
    /// Placements of the meshes; every mesh is placed at least once.
    pub instances: Vec<Instance>,
    /// Materials; at least one.
    pub materials: Vec<Material>,
    /// Point lights.
    pub lights: Vec<Light>,
    /// The groups that some of them belong to.
    pub light_groups: LightGroups,
    /// How light falls off with distance, φ1 of eq. (1).
    pub falloff: Falloff,
    /// Radiance of rays that leave the scene, linear RGB.
    pub background: Vec3,
    /// Counts as part of the [bounds](Self::bounds), whatever stands in it: what all frames of an animation reach, so that they share the
    /// places of their mesh points. Empty for a scene that doesn't move.
    pub extent: Bounds,
}

impl Scene {
    /// A scene without geometry and lights, and with a default material at index 0.
    pub fn new() -> Self {
        Self { materials: vec![Material::default()], ..Self::default() }
    }

    /// Adds a material; its index.
    pub fn add_material(&mut self, material: Material) -> u32 {
        self.materials.push(material);
        self.materials.len() as u32 - 1
    }

    /// Adds a mesh that is in world space already; its index.
    pub fn add(&mut self, mesh: TriangleMesh) -> u32 {
        let index = self.meshes.len() as u32;
        self.meshes.push(Arc::new(mesh));
        self.instances.push(Instance { mesh: index, to_world: None });
        index
    }

    /// Places a mesh once more.
    pub fn place(&mut self, mesh: u32, to_world: Affine3A) {
        self.instances.push(Instance { mesh, to_world: Some(to_world) });
    }

    /// Box around all triangles in world space and the [extent](Self::extent).
    pub fn bounds(&self) -> Bounds {
        let mut bounds = self.extent;
        for instance in &self.instances {
            let mesh = &self.meshes[instance.mesh as usize];
            for &[x, y, z] in mesh.positions.as_slice() {
                let p = Vec3::new(x, y, z);
                bounds.extend(instance.to_world.map_or(p, |m| m.transform_point3(p)));
            }
        }
        bounds
    }

    /// Number of triangles with instances counted each time they are placed.
    pub fn triangle_count(&self) -> u64 {
        self.instances.iter().map(|i| self.meshes[i.mesh as usize].triangles.len() as u64).sum()
    }
}
