//! What spot and directional lights differ in from point lights, sixteen at a time.

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
}

impl KindLanes {
    pub const POINTS: Self =
        Self { local: [1.0; LANES], axis: [[0.0; LANES]; 3], slope: [0.0; LANES], offset: [1.0; LANES] };

    pub fn set(&mut self, lane: usize, kind: LightKind) {
        (self.slope[lane], self.offset[lane]) = kind.cone_terms();
        match kind {
            LightKind::Point => {}
            LightKind::Spot { direction, .. } => {
                (0..3).for_each(|axis| self.axis[axis][lane] = direction[axis]);
            }
            LightKind::Directional { .. } => self.local[lane] = 0.0,
        }
    }

    /// Share of E_i that a light sends towards a point from which the way to the light is `to_light`, `distance` long.
    #[inline(always)]
    pub fn cone(&self, lane: usize, to_light: [f32; 3], distance: f32) -> f32 {
        let [x, y, z] = to_light;
        let along = self.axis[0][lane] * x + self.axis[1][lane] * y + self.axis[2][lane] * z;
        let share = (self.offset[lane] - self.slope[lane] * along / distance).clamp(0.0, 1.0);
        share * share
    }

    /// φ1 of directional lights is 1: 1/(t·φ1(t)) is 1/t.
    #[inline(always)]
    pub fn over_distance(&self, lane: usize, falloff: impl FalloffLaw, distance: f32) -> f32 {
        if self.local[lane] == 0.0 { 1.0 / distance } else { falloff.over_distance(distance) }
    }
}
