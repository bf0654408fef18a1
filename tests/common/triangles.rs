//! Triangle meshes and scenes by hand, for tests of what rays hit.

use std::sync::Arc;

use glam::{Affine2, Affine3A, Vec2, Vec3};
use lightmesh::sampling::SplitMix64;
use lightmesh::scene::{
    AlphaMask, Instance, Material, Positions, Scene, Texture, TextureMap, TriangleMaterials, TriangleMesh,
    Wrap,
};

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

/// Material of [`scene`] with holes that differ from place to place.
pub const HOLES: u32 = 1;
/// Material of [`scene`] that is opaque where the texture coordinate u reaches 1/4.
pub const RIM: u32 = 2;
/// Material of [`scene`] that is opaque nowhere.
pub const INVISIBLE: u32 = 3;

/// A mesh of one material without an alpha mask, or of those given. The texture coordinates of vertices 3k, 3k + 1 and
/// 3k + 2 are (0, 0), (1, 0) and (0, 1): those of triangles without shared vertices are their barycentric ones.
pub fn mesh(
    positions: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
    materials: Option<TriangleMaterials>,
) -> Arc<TriangleMesh> {
    let uvs = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].into_iter().cycle().take(positions.len());
    Arc::new(TriangleMesh {
        name: "test".into(),
        positions: Positions::new(positions),
        triangles: Arc::new(triangles),
        normals: None,
        uvs: Some(uvs.collect()),
        colors: None,
        materials: materials.unwrap_or(TriangleMaterials::Uniform(0)),
    })
}

pub fn scene(meshes: Vec<Arc<TriangleMesh>>, instances: Vec<(u32, Option<Affine3A>)>) -> Scene {
    let instances = instances.into_iter().map(|(mesh, to_world)| Instance { mesh, to_world }).collect();
    let checker = (0..36).map(|i| (i + i / 6) % 2 == 0);
    let masks = [
        AlphaMask { map: Some(map(6, 6, checker, 0.0)), alpha: 1.0, cutoff: 0.5 },
        AlphaMask { map: Some(map(2, 1, [false, true], 0.25)), alpha: 1.0, cutoff: 0.5 },
        AlphaMask { map: None, alpha: 0.0, cutoff: 0.5 },
    ];
    let masked = masks.map(|mask| Material { alpha_mask: Some(mask), ..Material::default() });
    let materials = [Material::default()].into_iter().chain(masked).collect();
    Scene { meshes, instances, materials, ..Scene::default() }
}

/// A map whose texels cover all or nothing, shifted to the left.
fn map(width: u32, height: u32, covered: impl IntoIterator<Item = bool>, shift: f32) -> TextureMap {
    let texels = covered.into_iter().map(|covered| [255, 255, 255, if covered { 255 } else { 0 }]).collect();
    TextureMap {
        texture: Arc::new(Texture::new(width, height, texels).expect("as many texels as the sides say")),
        transform: Affine2::from_translation(Vec2::new(shift, 0.0)),
        wrap: [Wrap::Clamp; 2],
    }
}

/// Triangles without shared vertices, with corners up to `size` around places in [−1, 1)³.
pub fn soup(
    random: &mut Random,
    count: u32,
    size: f32,
    materials: Option<TriangleMaterials>,
) -> Arc<TriangleMesh> {
    let corners = (0..count).flat_map(|_| {
        let centre = random.vec();
        [0; 3].map(|_| (centre + size * random.vec()).to_array())
    });
    let positions = corners.collect();
    mesh(positions, (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(), materials)
}

/// Sphere of `rings` × 2`rings` quads, closed at the poles.
pub fn sphere(rings: u32, radius: f32) -> Arc<TriangleMesh> {
    let segments = 2 * rings;
    let mut positions = vec![[0.0, radius, 0.0], [0.0, -radius, 0.0]];
    for ring in 1..rings {
        let polar = std::f32::consts::PI * ring as f32 / rings as f32;
        for segment in 0..segments {
            let angle = std::f32::consts::TAU * segment as f32 / segments as f32;
            positions.push([
                radius * polar.sin() * angle.cos(),
                radius * polar.cos(),
                radius * polar.sin() * angle.sin(),
            ]);
        }
    }
    let at = |ring: u32, segment: u32| 2 + (ring - 1) * segments + segment % segments;
    let mut triangles = Vec::new();
    for segment in 0..segments {
        triangles.push([0, at(1, segment), at(1, segment + 1)]);
        triangles.push([1, at(rings - 1, segment + 1), at(rings - 1, segment)]);
        for ring in 1..rings - 1 {
            let [a, b] = [at(ring, segment), at(ring, segment + 1)];
            let [c, d] = [at(ring + 1, segment), at(ring + 1, segment + 1)];
            triangles.extend([[a, c, b], [b, c, d]]);
        }
    }
    mesh(positions, triangles, None)
}
