//! Axis-aligned boxes.

use glam::Vec3;
use serde::{Deserialize, Serialize};

/// Axis-aligned box; empty when any `min` exceeds `max`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bounds {
    /// Lower corner.
    pub min: Vec3,
    /// Upper corner.
    pub max: Vec3,
}

impl Default for Bounds {
    /// The empty box.
    fn default() -> Self {
        Self::EMPTY
    }
}

impl Bounds {
    /// The empty box.
    pub const EMPTY: Self = Self { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

    /// Grows to hold a point; one with a coordinate that isn't finite is passed over.
    pub fn extend(&mut self, point: Vec3) {
        if point.is_finite() {
            self.min = self.min.min(point);
            self.max = self.max.max(point);
        }
    }

    /// The smallest box that holds two of them.
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Its eight corners.
    pub fn corners(self) -> impl Iterator<Item = Vec3> {
        let Self { min, max } = self;
        (0..8).map(move |corner| {
            let choose = |axis: usize| if corner >> axis & 1 == 1 { max[axis] } else { min[axis] };
            Vec3::new(choose(0), choose(1), choose(2))
        })
    }

    /// Whether it holds no point.
    pub fn is_empty(&self) -> bool {
        self.min.cmpgt(self.max).any()
    }

    /// Whether it holds a point; its faces belong to it.
    pub fn contains(&self, point: Vec3) -> bool {
        self.min.cmple(point).all() && point.cmple(self.max).all()
    }

    /// Edge lengths; 0 for the empty box.
    pub fn extent(&self) -> Vec3 {
        if self.is_empty() { Vec3::ZERO } else { self.max - self.min }
    }

    /// Middle of the box; the origin for the empty box.
    pub fn center(&self) -> Vec3 {
        if self.is_empty() { Vec3::ZERO } else { self.min * 0.5 + self.max * 0.5 }
    }
}
