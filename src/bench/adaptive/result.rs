//! What was found about a scene, as the JSON file has it.

use serde::Serialize;

use super::curve::Curve;
use crate::render::{Ending, ErrorEstimate};

/// What was found about a scene.
#[derive(Clone, Debug, Serialize)]
pub struct AdaptiveScene {
    /// Its file, or what was made.
    pub name: String,
    /// Lights.
    pub lights: usize,
    /// Triangles.
    pub triangles: u64,
    /// Size of the images.
    pub resolution: [u32; 2],
    /// Size of the images whose pixels' errors are known.
    pub error_resolution: [u32; 2],
    /// R of all meshes, scene units.
    pub radius: f32,
    /// Meshes of given spacings, by levels.
    pub meshes: Vec<GivenMesh>,
    /// Meshes that were chosen by their error.
    pub chosen: Vec<ChosenMesh>,
    /// Conventional tracing, whose image has hard shadows and no such error.
    pub conventional: Cost,
    /// Shadow rays of uniform meshes over those of meshes with levels.
    pub gains: Vec<Gain>,
}

/// What a frame takes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Cost {
    /// Occlusion rays, those that an error took to be measured included.
    pub shadow_rays: u64,
    /// Seconds of the frame: median.
    pub seconds: f64,
}

/// A mesh of a given spacing.
#[derive(Clone, Debug, Serialize)]
pub struct GivenMesh {
    /// Coarser lattices that its points build on; 0 is a uniform mesh.
    pub levels: u32,
    /// Spacing in units of R.
    pub spacing: f32,
    /// RMSE over the mean against the reference of the same R.
    pub own_error: f64,
    /// What it takes.
    #[serde(flatten)]
    pub cost: Cost,
}

/// A mesh that was chosen by its error.
#[derive(Clone, Debug, Serialize)]
pub struct ChosenMesh {
    /// Coarser lattices that its points build on.
    pub levels: u32,
    /// The error that was asked for.
    pub asked: f32,
    /// What the renderer measured.
    pub found: Option<ErrorEstimate>,
    /// Why it was left at that.
    pub ending: Option<Ending>,
    /// The true error, against the reference.
    pub own_error: f64,
    /// What it takes, with finding it.
    #[serde(flatten)]
    pub cost: Cost,
}

/// Shadow rays of uniform meshes over those of meshes with levels, at equal errors.
#[derive(Clone, Debug, Serialize)]
pub struct Gain {
    /// Coarser lattices that the points build on.
    pub levels: u32,
    /// At given errors; `None` where no such meshes were measured.
    pub at: Vec<(f32, Option<f64>)>,
    /// The error nearest to the usual one that both kinds of meshes reach.
    pub common_error: Option<f64>,
    /// The ratio there.
    pub ratio: Option<f64>,
}

impl AdaptiveScene {
    /// Error and shadow rays of the meshes of given spacings with so many levels.
    pub fn curve(&self, levels: u32) -> Curve {
        let meshes = self.meshes.iter().filter(|mesh| mesh.levels == levels);
        Curve::new(meshes.map(|mesh| (mesh.own_error, mesh.cost.shadow_rays as f64)))
    }

    /// Shadow rays of a uniform mesh of equal error over those of a mesh.
    pub fn ratio(&self, own_error: f64, cost: &Cost) -> Option<f64> {
        self.curve(0).cost(own_error).map(|uniform| uniform / cost.shadow_rays as f64)
    }

    /// Compares meshes with so many levels with uniform ones, at some errors.
    pub fn gain(&self, levels: u32, errors: &[f32]) -> Gain {
        let (uniform, adaptive) = (self.curve(0), self.curve(levels));
        let ratio = |error: f64| Some(uniform.cost(error)? / adaptive.cost(error)?);
        let common_error = uniform.common_error(&adaptive);
        Gain {
            levels,
            at: errors.iter().map(|&error| (error, ratio(f64::from(error)))).collect(),
            common_error,
            ratio: common_error.and_then(ratio),
        }
    }

    /// The levels that save most.
    pub fn best_gain(&self) -> Option<&Gain> {
        let ratio = |gain: &Gain| gain.ratio.unwrap_or(0.0);
        self.gains.iter().max_by(|a, b| ratio(a).total_cmp(&ratio(b)))
    }
}
