//! What rays found that some points gathered with.

use glam::Vec3;

use super::points::NO_POINT;
use crate::light_mesh::packed_colour::PackedColour;

/// What a ray found.
#[derive(Clone, Copy, Debug)]
pub struct GatheredRay {
    /// Number of the point of level 0 that stands for the surface that it found, or [`NO_POINT`].
    pub point: u32,
    pub(super) diffuse: PackedColour,
}

impl GatheredRay {
    pub(super) const NOTHING: Self = Self { point: NO_POINT, diffuse: PackedColour::BLACK };

    /// Adds how much of the light at the point that stands for where it ended it brings along, times a weight, to what is known by point.
    #[inline(always)]
    pub fn add_to(self, amounts: &mut [f32], weight: f32) {
        if let Some(amount) = amounts.get_mut(self.point as usize) {
            *amount += self.diffuse().element_sum() / 3.0 * weight;
        }
    }

    /// k_d where the ray ended.
    #[inline(always)]
    pub fn diffuse(self) -> Vec3 {
        self.diffuse.colour()
    }
}

/// What some points see.
#[derive(Default)]
pub struct Gathered {
    /// Numbers of the points.
    pub points: Vec<u32>,
    /// Sum over a point's rays of the light that needs nothing that other points gather: of emitters, of the background, and of lights over
    /// one reflection.
    pub emitted: Vec<Vec3>,
    /// What light from other points is multiplied by, for rays that end where none stands for the surface.
    pub shares: Vec<f32>,
    /// Sum over a point's rays of 1/t.
    pub closeness: Vec<f32>,
    /// The rays of each point end here.
    pub(super) ends: Vec<usize>,
    /// Rays, point by point.
    pub rays: Vec<GatheredRay>,
}

impl Gathered {
    /// The rays of the point of an index, none if it has none.
    #[inline(always)]
    pub fn rays_of(&self, index: usize) -> &[GatheredRay] {
        let end = |index: usize| self.ends.get(index).copied().unwrap_or_default();
        self.rays.get(index.checked_sub(1).map_or(0, end)..end(index)).unwrap_or_default()
    }

    /// Adds what other points see.
    pub fn append(&mut self, mut other: Self) {
        self.points.append(&mut other.points);
        self.emitted.append(&mut other.emitted);
        self.closeness.append(&mut other.closeness);
        self.shares.append(&mut other.shares);
        let first = self.rays.len();
        self.ends.extend(other.ends.into_iter().map(|end| first + end));
        self.rays.append(&mut other.rays);
    }
}
