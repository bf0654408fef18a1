//! Light sources and their falloff.

use glam::Vec3;

/// Point light i of eq. (1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointLight {
    /// lp_i.
    pub position: Vec3,
    /// E_i, linear RGB, ≥ 0.
    pub intensity: Vec3,
}

/// φ1(t), what intensities are divided by at distance t.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Falloff {
    /// c + t, the paper's.
    Linear {
        /// c ≥ 0.
        constant: f32,
    },
    /// t², clamped below at t = [`Falloff::MIN_DISTANCE`].
    InverseSquare,
    /// 1: no falloff.
    None,
}

impl Default for Falloff {
    fn default() -> Self {
        Self::Linear { constant: 1.0 }
    }
}

impl Falloff {
    /// Below this distance, in scene units, `inverse-square` grows no further: a mesh point that
    /// happens to sit on a light must stay finite.
    pub const MIN_DISTANCE: f32 = 1e-3;

    /// 1/φ1 at distance `t`.
    #[inline(always)]
    pub fn reciprocal(self, t: f32) -> f32 {
        match self {
            // A light with c = 0 at t = 0 is clamped as in the inverse-square case.
            Self::Linear { constant } => 1.0 / (constant + t).max(Self::MIN_DISTANCE),
            Self::InverseSquare => {
                let t = t.max(Self::MIN_DISTANCE);
                1.0 / (t * t)
            }
            Self::None => 1.0,
        }
    }
}
