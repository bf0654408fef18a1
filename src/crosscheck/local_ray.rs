//! Rays in double precision, with the errors that they have in single precision.

use glam::DVec3;

/// How far a corner seems moved, in units of its distance from the ray's origin: 16 roundings of 2⁻²⁴.
pub const BOUND: f64 = 16.0 / (1 << 24) as f64;

/// A ray in an instance's space.
#[derive(Clone, Copy, Debug)]
pub struct LocalRay {
    /// Origin.
    pub origin: DVec3,
    /// Direction.
    pub direction: DVec3,
    /// By how much an origin in single precision may be off.
    pub origin_error: f64,
    /// The same for the direction.
    pub direction_error: f64,
    /// Length of the direction.
    pub length: f64,
    /// The direction at length 1.
    pub along: DVec3,
    /// Two directions across it.
    pub across: (DVec3, DVec3),
}

impl LocalRay {
    /// A ray whose origin and direction may be off by the two errors.
    pub fn new(origin: DVec3, direction: DVec3, [origin_error, direction_error]: [f64; 2]) -> Self {
        let length = direction.length();
        let along = direction / length;
        let across = along.any_orthonormal_pair();
        Self { origin, direction, origin_error, direction_error, length, along, across }
    }

    /// By how much the ray may be off at a distance, as a part of that distance: a direction that is off by Δd turns it
    /// aside by Δd / |d|.
    pub fn spread(&self) -> f64 {
        self.direction_error / self.length
    }
}
