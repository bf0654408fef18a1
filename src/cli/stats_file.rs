//! The statistics of `render --stats`.

use serde::Serialize;

use crate::render::{Accuracy, Choice, HybridError, MeshCounters, RayCounters};
use crate::settings::Integrator;

/// Contents of the file.
#[derive(Debug, Serialize)]
pub struct StatsFile {
    /// Version of the program.
    pub version: &'static str,
    /// Who traced the rays.
    pub backend: BackendStats,
    /// Triangles, instances flattened.
    pub triangles: u64,
    /// Triangles that are stored.
    pub unique_triangles: u64,
    /// Lights.
    pub lights: usize,
    /// Columns and rows.
    pub resolution: [u32; 2],
    /// Camera rays per pixel.
    pub samples_per_pixel: u32,
    /// Threads.
    pub threads: usize,
    /// Wall-clock seconds.
    pub seconds: Seconds,
    /// What computed the illumination.
    pub integrator: Option<Integrator>,
    /// Why, where the integrator was `auto`.
    pub choice: Option<Choice>,
    /// The share of the light that hybrid shadows are estimated to get wrong; null without them.
    pub hybrid_error: HybridError,
    /// How wrong the picture is; null where nobody asked.
    pub accuracy: Option<Accuracy>,
    /// Rays by kind.
    pub rays: RayCounters,
    /// Counters of the light meshes.
    pub mesh_points: MeshCounters,
    /// Bytes held by the light meshes.
    pub light_mesh_bytes: u64,
    /// Bytes held by the acceleration structure.
    pub acceleration_bytes: usize,
    /// Largest memory of the process; null where the system does not report it.
    pub peak_rss_bytes: Option<u64>,
    /// Pixels that are infinite or not a number.
    pub non_finite_pixels: u64,
}

/// Name and version of a backend.
#[derive(Debug, Serialize)]
pub struct BackendStats {
    /// As on the command line.
    pub name: &'static str,
    /// Of the library.
    pub version: String,
}

/// Wall-clock seconds of the stages.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Seconds {
    /// Reading the scene.
    pub load: f64,
    /// Building the acceleration structure.
    pub build: f64,
    /// Choosing the view of a model that has no camera.
    pub view: f64,
    /// Camera paths.
    pub paths: f64,
    /// Finding and evaluating mesh points.
    pub mesh: f64,
    /// Shading.
    pub shade: f64,
    /// Measuring the error, and choosing mesh points by it.
    pub check: f64,
    /// Writing the images.
    pub write: f64,
    /// All of it.
    pub total: f64,
}

/// Largest resident memory of this process in bytes, from Linux's /proc.
pub fn peak_rss_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix(" kB")?.trim().parse().ok()?;
    Some(kibibytes * 1024)
}
