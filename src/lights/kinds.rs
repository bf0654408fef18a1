//! What spot and directional lights differ in from point lights, sixteen at a time.

use super::emitters::Emitter;
use super::falloff::FalloffLaw;
use crate::scene::LightKind;
use crate::simd::{LANES, Lanes};

/// Spot and directional lights of a chunk; lanes with point lights hold what changes nothing.
#[derive(Clone, Debug)]
pub(super) struct KindLanes {
    /// 0 for directional lights, 1 for the others: what the lit point is multiplied by before the way to the light
    /// is taken.
    pub local: Lanes,
    /// The cone's axis.
    axis: [Lanes; 3],
    /// Terms of [`LightKind::cone_terms`].
    slope: Lanes,
    offset: Lanes,
    /// 1 where the clamped share counts as it is, as of emitters; 0 where its square does.
    linear: Lanes,
    /// [`Emitter::radius_squared`] of emitters, whose light falls off by law; below 0 for all others.
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
            linear: [0.0; LANES],
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

    /// Makes a lane that of an emitter: a share of cos, and I/(d² + r²).
    pub fn set_emitter(&mut self, lane: usize, emitter: &Emitter) {
        (0..3).for_each(|axis| self.axis[axis][lane] = emitter.axis[axis]);
        (self.slope[lane], self.offset[lane], self.linear[lane]) = (1.0, 0.0, 1.0);
        self.radius_squared[lane] = emitter.radius_squared;
    }

    /// Share of E_i that a light sends towards a point from which the way to the light is `to_light`, `distance` long.
    #[inline(always)]
    pub fn cone(&self, lane: usize, to_light: [f32; 3], distance: f32) -> f32 {
        let [x, y, z] = to_light;
        let along = self.axis[0][lane] * x + self.axis[1][lane] * y + self.axis[2][lane] * z;
        let share = (self.offset[lane] - self.slope[lane] * along / distance).clamp(0.0, 1.0);
        share * if self.linear[lane] == 1.0 { 1.0 } else { share }
    }

    /// φ1 of directional lights is 1: 1/(t·φ1(t)) is 1/t. That of emitters is t² + r².
    #[inline(always)]
    pub fn over_distance(&self, lane: usize, falloff: impl FalloffLaw, distance: f32) -> f32 {
        let radius_squared = self.radius_squared[lane];
        if radius_squared >= 0.0 {
            1.0 / (distance * (distance * distance + radius_squared))
        } else if self.local[lane] == 0.0 {
            1.0 / distance
        } else {
            falloff.over_distance(distance)
        }
    }
}
