//! What a render did and how long it took.

use std::time::Duration;

use serde::Serialize;

use crate::light_mesh::PointCounters;

/// Wall-clock seconds per stage of rendering.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct StageSeconds {
    /// Camera paths.
    pub paths: f64,
    /// Finding and evaluating mesh points.
    pub mesh: f64,
    /// Shading.
    pub shade: f64,
}

/// Rays by kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct RayCounters {
    /// Camera rays.
    pub camera: u64,
    /// Mirror reflections.
    pub reflection: u64,
    /// Occlusion rays, from mesh points or from surface points.
    pub shadow: u64,
    /// Rays that gather indirect light at mesh points.
    pub indirect: u64,
}

/// Counters of the light meshes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct MeshCounters {
    /// Direct light mesh.
    pub direct: PointCounters,
    /// Indirect light mesh.
    pub indirect: PointCounters,
}

/// What one render did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct RenderStats {
    /// Seconds per stage.
    pub seconds: StageSeconds,
    /// Rays by kind.
    pub rays: RayCounters,
    /// Mesh points.
    pub mesh_points: MeshCounters,
    /// Bytes held by the light meshes.
    pub light_mesh_bytes: u64,
}

/// Adds the time since `start` to a stage.
pub(super) fn add_since(stage: &mut f64, start: std::time::Instant) {
    *stage += Duration::as_secs_f64(&start.elapsed());
}
