//! When a picture is good enough, and when a render has to end.

use std::time::Duration;

/// What a render may cost, and how wrong its picture may be.
#[derive(Clone, Copy, Debug, PartialEq)]
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
    /// Whole pictures that are made one after the other, each better than the one before, at least 1.
    pub steps: u32,
}

impl Limits {
    /// The error that the program asks for where nobody says.
    pub const USUAL_ERROR: f32 = 0.05;

    /// More steps would begin with pictures of nothing.
    pub const MOST_STEPS: u32 = 8;
}

impl Default for Limits {
    fn default() -> Self {
        Self { max_error: None, estimator_open: false, layout_open: false, time: None, steps: 1 }
    }
}
