//! What is known about a scene after it was measured, as the JSON file has it.

use std::path::Path;

use serde::Serialize;

use crate::bench::BenchError;
use crate::render::{MeshCounters, RayCounters, Reason, StageSeconds};
use crate::settings::Integrator;

/// All scenes.
#[derive(Clone, Debug, Default, Serialize)]
pub struct SceneResults {
    /// Those that were measured, in order.
    pub scenes: Vec<SceneResult>,
    /// Those that could not be.
    pub failures: Vec<Failure>,
}

/// A scene that could not be measured.
#[derive(Clone, Debug, Serialize)]
pub struct Failure {
    /// Its file.
    pub name: String,
    /// Why not, in a text that names the file.
    pub error: String,
}

impl Failure {
    /// What stopped the measurement of a file.
    pub fn new(file: &Path, error: &BenchError) -> Self {
        let (name, reason) = (file.display().to_string(), error.to_string());
        // Errors of reading name the file themselves.
        let error = if reason.starts_with(&name) { reason } else { format!("{name}: {reason}") };
        Self { name, error }
    }
}

/// The same of each way to render.
#[derive(Clone, Debug, Serialize)]
pub struct Ways<T> {
    /// By the light mesh, which starts empty.
    pub light_mesh: T,
    /// By conventional tracing.
    pub conventional: T,
    /// As `auto` chose.
    pub auto: T,
}

/// One scene.
#[derive(Clone, Debug, Serialize)]
pub struct SceneResult {
    /// Its file.
    pub name: String,
    /// Lights, those that were added to a bare model included.
    pub lights: usize,
    /// Triangles, instances flattened.
    pub triangles: u64,
    /// Columns and rows.
    pub resolution: [u32; 2],
    /// Camera rays per pixel.
    pub samples_per_pixel: u32,
    /// Whether the light mesh renders indirect light, which conventional tracing knows nothing of.
    pub indirect_light: bool,
    /// Ray-query backend and its version.
    pub backend: String,
    /// Seconds to read the scene.
    pub load_seconds: f64,
    /// Seconds to build the acceleration structure.
    pub build_seconds: f64,
    /// Rounds in which both ways had their turn.
    pub rounds: usize,
    /// Conventional seconds over light-mesh seconds.
    pub ratio: f64,
    /// Seconds by the light mesh: paths, mesh and shade.
    pub seconds: f64,
    /// Seconds by conventional tracing: paths and shade.
    pub conventional_seconds: f64,
    /// Wall-clock seconds from scene and acceleration structure to the finished image; of `auto`, with its decision, in
    /// one run.
    pub frame_seconds: Ways<f64>,
    /// The same as [`Ways::auto`] of the frame seconds.
    pub auto_seconds: f64,
    /// Exposure in stops at which FLIP sees the images, that of their PNG files.
    pub exposure: f32,
    /// Mean FLIP error of the light-mesh image against the conventional one.
    pub flip: Option<f64>,
    /// Mean relative error of the means of its 8×8-pixel blocks.
    pub block_mean_relative_error: Option<f64>,
    /// What `auto` took.
    pub chosen: Option<Integrator>,
    /// Why.
    pub reason: Option<Reason>,
    /// What took less seconds.
    pub cheaper: Integrator,
    /// Whether `auto` took what is cheaper, or dearer by at most [`TOLERANCE`], or had no choice.
    pub auto_right: bool,
    /// Seconds per stage.
    pub stages: Ways<StageSeconds>,
    /// Rays by kind.
    pub rays: Ways<RayCounters>,
    /// Mesh points of the light mesh.
    pub mesh_points: MeshCounters,
    /// Bytes held by the light meshes.
    pub light_mesh_bytes: u64,
}

/// Share of the cheaper way's seconds by which the dearer one may exceed them and be right all the same.
const TOLERANCE: f64 = 0.05;

/// The cheaper way, and whether `chosen` was right.
pub fn judge(seconds: f64, conventional_seconds: f64, chosen: Option<Integrator>) -> (Integrator, bool) {
    let cheaper =
        if seconds <= conventional_seconds { Integrator::LightMesh } else { Integrator::Conventional };
    let chosen_seconds = match chosen {
        Some(Integrator::LightMesh) => seconds,
        Some(Integrator::Conventional) => conventional_seconds,
        _ => f64::INFINITY,
    };
    (cheaper, chosen_seconds <= (1.0 + TOLERANCE) * seconds.min(conventional_seconds))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Within 5 % either way is right; beyond, only the cheaper one is.
    #[test]
    fn a_choice_is_right_within_its_tolerance() {
        let (mesh, conventional) = (Integrator::LightMesh, Integrator::Conventional);
        for (seconds, other, chosen, expected) in [
            (1.0, 2.0, mesh, (mesh, true)),
            (1.0, 2.0, conventional, (mesh, false)),
            (1.04, 1.0, mesh, (conventional, true)),
            (1.06, 1.0, mesh, (conventional, false)),
            (1.0, 1.0, conventional, (mesh, true)),
        ] {
            assert_eq!(judge(seconds, other, Some(chosen)), expected, "{seconds} {other} {chosen}");
        }
        assert!(!judge(1.0, 1.0, None).1);
    }

    /// A file is named once, whether the error names it or not.
    #[test]
    fn failures_name_their_file_once() {
        let failure = Failure::new(Path::new("a.obj"), &BenchError::NoLights);
        assert_eq!(failure.error.matches("a.obj").count(), 1);
        let source = std::io::Error::other("reason");
        let read = crate::scene::load::LoadError::Read { file: "a.obj".into(), source };
        assert_eq!(Failure::new(Path::new("a.obj"), &read.into()).error.matches("a.obj").count(), 1);
    }
}
