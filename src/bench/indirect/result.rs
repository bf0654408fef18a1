//! What was found about light from surfaces.

use serde::Serialize;

use crate::render::{RayCounters, StageSeconds};

/// What was found about a scene.
#[derive(Clone, Debug, Serialize)]
pub struct IndirectCurve {
    /// Its file.
    pub name: String,
    /// Lights.
    pub lights: usize,
    /// Triangles.
    pub triangles: u64,
    /// Size of the images.
    pub resolution: [u32; 2],
    /// Directions of the reference.
    pub reference_directions: u32,
    /// Seconds of paths, mesh and shade without light from surfaces.
    pub direct_seconds: f64,
    /// With it, by number of directions.
    pub points: Vec<IndirectPoint>,
}

/// A number of directions, what it costs and how far it is off.
#[derive(Clone, Debug, Serialize)]
pub struct IndirectPoint {
    /// Directions of a record.
    pub directions: u32,
    /// Seconds of paths, mesh and shade: medians.
    pub seconds: f64,
    /// The same by stage, of one run.
    pub stages: StageSeconds,
    /// Rays by kind.
    pub rays: RayCounters,
    /// Points that gathered.
    pub evaluated: u64,
    /// FLIP against the reference.
    pub flip: Option<f64>,
    /// Mean relative error of block means against it.
    pub block_mean_relative_error: Option<f64>,
}
