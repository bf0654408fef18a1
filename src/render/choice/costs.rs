//! What the two ways cost: fitted to what `lightmesh bench scenes` measured in 26 scenes of 10 to 1.2 million triangles and 1 to
//! 300 lights, at 400×300 and at 1280×960. The unit is an occlusion ray of conventional shading in a scene of a thousand triangles.

use crate::lights::PackedLights;

/// A ray costs as the number of triangles to this power: the tree is deeper, and more of it is out of cache.
const RAY_POWER: f32 = 0.18;
/// A surface point in conventional shading, beside its rays.
const CONVENTIONAL_POINT: f32 = 7.0;
/// A surface point in hybrid shading, beside its rays.
const HYBRID_POINT: f32 = 9.0;
/// What a ray of hybrid shading costs more than one of conventional shading: it is chosen, and lies further from the next one.
const HYBRID_RAY: f32 = 1.0;
/// A mesh point, beside its rays.
const MESH_POINT: f32 = 485.0;
/// What a ray from a mesh point costs more: those of a packet start at different points.
const MESH_RAY: f32 = 8.5;

/// A ray in a scene of so many triangles.
fn ray(triangles: u64) -> f32 {
    (triangles.max(1) as f32 / 1000.0).powf(RAY_POWER)
}

/// What a tile costs by the two ways.
#[derive(Clone, Copy, Debug)]
pub struct TileCost {
    pub light_mesh: f32,
    pub conventional: f32,
}

/// What things cost in a scene.
pub struct Costs {
    ray: f32,
    mesh_point: f32,
}

impl Costs {
    pub fn of(triangles: u64, lights: &PackedLights) -> Self {
        let ray = ray(triangles);
        let mesh_point = MESH_POINT + lights.len() as f32 * (ray + MESH_RAY);
        Self { ray, mesh_point }
    }

    /// Of a tile of so many surface points, with the rays of conventional and of hybrid shading.
    pub fn of_tile(&self, points: usize, conventional: u64, mesh_points: f32, hybrid: u64) -> TileCost {
        let points = points as f32;
        TileCost {
            light_mesh: HYBRID_POINT * points
                + (self.ray + HYBRID_RAY) * hybrid as f32
                + self.mesh_point * mesh_points,
            conventional: CONVENTIONAL_POINT * points + self.ray * conventional as f32,
        }
    }
}
