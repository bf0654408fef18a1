//! When a picture is good enough, and when a render has to end.

use std::time::Duration;

use glam::Vec3;

use super::shading::Neighbourhood;

/// What a render may cost, and how wrong its picture may be.
#[derive(Clone, Debug, PartialEq)]
pub struct Limits {
    /// The error that direct light may have, as a share of the picture's mean brightness (method §10); 0 takes the other settings as
    /// they are and measures nothing, `None` leaves it to the program: nothing is measured.
    pub max_error: Option<f32>,
    /// Whether `directional` may take the place of `per-light` where lights are many and the error allows it.
    pub estimator_open: bool,
    /// Whether a body-centred mesh may take the place of a regular one where it is to be coarse.
    pub layout_open: bool,
    /// Time after which no further step is taken and the last one ends, with the best whole picture so far.
    pub time: Option<Duration>,
    /// Bytes that light meshes may take; `None` for as many as they need. Where a finer mesh would take more, the render stays with the finest that doesn't.
    pub memory: Option<u64>,
    /// Whole pictures that are made one after the other.
    pub steps: Steps,
}

/// Whole pictures that are made one after the other, of which the last one is by the settings themselves.
#[derive(Clone, Debug, PartialEq)]
pub enum Steps {
    /// So many, at least 1: what those before the last are like follows from the settings, each better than the one before.
    Count(u32),
    /// These first.
    List(Vec<Step>),
}

impl Steps {
    /// More pictures would begin with pictures of nothing.
    pub const MOST: u32 = 8;

    /// Number of pictures, with the last one.
    pub fn pictures(&self) -> u32 {
        match self {
            Self::Count(count) => *count,
            Self::List(list) => u32::try_from(list.len()).unwrap_or(u32::MAX).saturating_add(1),
        }
    }
}

/// A picture on the way, without shadow edges of its own and without light from surfaces. What it leaves out is as in the settings.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Step {
    /// Distance of mesh points in scene units, in the whole scene.
    pub spacing: Option<Vec3>,
    /// R in scene units.
    pub radius: Option<f32>,
    /// Shape and weights of D_y.
    pub neighbourhood: Option<Neighbourhood>,
}

impl Limits {
    /// The error that the program asks for where nobody says.
    pub const USUAL_ERROR: f32 = 0.05;
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            max_error: None,
            estimator_open: false,
            layout_open: false,
            time: None,
            memory: None,
            steps: Steps::Count(1),
        }
    }
}
