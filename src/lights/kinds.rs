//! What spot and directional lights differ in from point lights, sixteen at a time.

use serde::{Deserialize, Serialize};

use super::emitters::Emitter;
use super::falloff::{FalloffLaw, InverseSquareFalloff};
use crate::scene::LightKind;
use crate::simd::{LANES, Lanes};

/// Spot and directional lights of a chunk; lanes with point lights hold what changes nothing.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct KindLanes {
    /// 0 for directional lights, 1 for the others: what the lit point is multiplied by before the way to the light
    /// is taken.
    pub local: Lanes,
    /// The cone's axis.
    axis: [Lanes; 3],
    /// Terms of [`LightKind::cone_terms`].
    slope: Lanes,
    offset: Lanes,
    /// [`Emitter::radius_squared`] of emitters, below 0 for all others.
    radius_squared: Lanes,
}

impl Default for KindLanes {
    /// Point lights.
    fn default() -> Self {
        Self {
            local: [1.0; LANES],
            axis: [[0.0; LANES]; 3],
            slope: [0.0; LANES],
            offset: [1.0; LANES],
            radius_squared: [-1.0; LANES],
        }
    }
}

impl KindLanes {
    pub fn set(&mut self, lane: usize, kind: LightKind) {
        (self.slope[lane], self.offset[lane]) = kind.cone_terms();
        match kind {
            LightKind::Point | LightKind::Ball { .. } => {}
            LightKind::Spot { direction, .. } => {
                (0..3).for_each(|axis| self.axis[axis][lane] = direction[axis]);
            }
            LightKind::Directional { .. } => self.local[lane] = 0.0,
        }
    }

    /// Makes a lane that of an emitter.
    pub fn set_emitter(&mut self, lane: usize, emitter: &Emitter) {
        (0..3).for_each(|axis| self.axis[axis][lane] = emitter.axis[axis]);
        (self.slope[lane], self.offset[lane]) = (1.0, 0.0);
        self.radius_squared[lane] = emitter.radius_squared;
    }

    /// Share of E_i that a light sends towards a point from which the way to the light is `to_light`, `distance` long.
    #[inline(always)]
    pub fn cone(&self, lane: usize, to_light: [f32; 3], distance: f32) -> f32 {
        let [x, y, z] = to_light;
        let along = self.axis[0][lane] * x + self.axis[1][lane] * y + self.axis[2][lane] * z;
        let share = (self.offset[lane] - self.slope[lane] * along / distance).clamp(0.0, 1.0);
        let size = self.radius_squared[lane] / (distance * distance);
        if size >= 0.0 { share * disc(share, size) } else { share * share }
    }

    /// [`Emitter::radius_squared`] of an emitter.
    pub fn emitter_size(&self, lane: usize) -> Option<f32> {
        Some(self.radius_squared[lane]).filter(|&size| size >= 0.0)
    }

    /// The cosine at a flat emitter, over the squared distance, for a point of it that a way leads to.
    #[inline(always)]
    pub fn emitted_along(&self, lane: usize, way: [f32; 3]) -> f32 {
        let [x, y, z] = way;
        let distance = (x * x + y * y + z * z).sqrt();
        let along = self.axis[0][lane] * x + self.axis[1][lane] * y + self.axis[2][lane] * z;
        // Over the distance once for the cosine; the law brings the square.
        if distance > 0.0 { (-along).max(0.0) * InverseSquareFalloff.over_distance(distance) } else { 0.0 }
    }

    /// φ1 of directional lights is 1: 1/(t·φ1(t)) is 1/t. That of emitters is t².
    #[inline(always)]
    pub fn over_distance(&self, lane: usize, falloff: impl FalloffLaw, distance: f32) -> f32 {
        if self.radius_squared[lane] >= 0.0 {
            InverseSquareFalloff.over_distance(distance)
        } else if self.local[lane] == 0.0 {
            1.0 / distance
        } else {
            falloff.over_distance(distance)
        }
    }
}

/// What a disc gives to a surface parallel to it, over what a point in its middle does, given the cosine c at its axis and the square q of its radius over
/// the distance: exactly 1/(1 + q) on the axis, and to first order in q everywhere, 1 + q·(3 sin² − 1).
#[inline(always)]
fn disc(cosine: f32, size: f32) -> f32 {
    let shrunk = 1.0 / (1.0 + size);
    // q/(1 + q) as a difference, which is a number however near the point is.
    shrunk * (1.0 + 3.0 * (1.0 - cosine * cosine) * (1.0 - shrunk))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Exact on the axis, 1 + q·(3 sin² − 1) for small discs, and finite in the middle of one.
    #[test]
    fn a_disc_is_its_formula_and_finite() {
        assert_eq!(disc(1.0, 0.25), 0.8);
        for cosine in [0.0f32, 0.5, 1.0] {
            let expected = 1.0 + 1e-3 * (3.0 * (1.0 - cosine * cosine) - 1.0);
            assert!((disc(cosine, 1e-3) - expected).abs() < 1e-5, "{cosine}");
            assert!(disc(cosine, f32::INFINITY).is_finite(), "{cosine}");
        }
    }
}
