//! Triangle meshes and scenes by hand, for tests of what rays hit.

use std::sync::Arc;

use glam::{Affine3A, Vec3};
use lightmesh::scene::random::SplitMix64;
use lightmesh::scene::{CutOut, Instance, Material, Positions, Scene, TriangleMaterials, TriangleMesh};

/// Small, seeded, and the same everywhere.
pub struct Random(SplitMix64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(SplitMix64::new(seed))
    }

    /// Uniform in [−1, 1).
    pub fn signed(&mut self) -> f32 {
        self.0.between(-1.0, 1.0)
    }

    pub fn vec(&mut self) -> Vec3 {
        Vec3::new(self.signed(), self.signed(), self.signed())
    }

    pub fn below(&mut self, n: usize) -> usize {
        (self.0.next() % n as u64) as usize
    }
}

pub fn mesh(positions: Vec<[f32; 3]>, triangles: Vec<[u32; 3]>, cutout: Option<CutOut>) -> Arc<TriangleMesh> {
    Arc::new(TriangleMesh {
        name: "test".into(),
        positions: Positions::new(positions),
        triangles: Arc::new(triangles),
        normals: None,
        uvs: None,
        colors: None,
        materials: TriangleMaterials::Uniform(0),
        cutout,
    })
}

pub fn scene(meshes: Vec<Arc<TriangleMesh>>, instances: Vec<(u32, Option<Affine3A>)>) -> Scene {
    let instances = instances.into_iter().map(|(mesh, to_world)| Instance { mesh, to_world }).collect();
    Scene { meshes, instances, materials: vec![Material::default()], ..Scene::default() }
}

/// Triangles without shared vertices, with corners up to `size` around places in [−1, 1)³.
pub fn soup(random: &mut Random, count: u32, size: f32, cutout: Option<CutOut>) -> Arc<TriangleMesh> {
    let corners = (0..count).flat_map(|_| {
        let centre = random.vec();
        [0; 3].map(|_| (centre + size * random.vec()).to_array())
    });
    let positions = corners.collect();
    mesh(positions, (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(), cutout)
}
