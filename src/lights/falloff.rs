//! φ1 as types, so that the choice of the falloff is made outside of the loops over lights.

use crate::scene::Falloff;

/// What a light's contribution is multiplied by at distance t: 1/φ1(t), possibly times the cosine over t.
pub(super) trait FalloffLaw: Copy {
    /// 1/(t·φ1(t)) for t > 0.
    fn over_distance(self, t: f32) -> f32;
}

/// φ1(t) = c + t.
#[derive(Clone, Copy)]
pub(super) struct LinearFalloff(pub f32);
/// φ1(t) = t².
#[derive(Clone, Copy)]
pub(super) struct InverseSquareFalloff;
/// φ1(t) = 1.
#[derive(Clone, Copy)]
pub(super) struct NoFalloff;

impl FalloffLaw for LinearFalloff {
    #[inline(always)]
    fn over_distance(self, t: f32) -> f32 {
        1.0 / (t * (self.0 + t).max(Falloff::MIN_DISTANCE))
    }
}

impl FalloffLaw for InverseSquareFalloff {
    #[inline(always)]
    fn over_distance(self, t: f32) -> f32 {
        let clamped = t.max(Falloff::MIN_DISTANCE);
        1.0 / (t * (clamped * clamped))
    }
}

impl FalloffLaw for NoFalloff {
    #[inline(always)]
    fn over_distance(self, t: f32) -> f32 {
        1.0 / t
    }
}

/// Runs `$body` with `$law` bound to the falloff's own type: the choice is made outside the loop over lights.
macro_rules! with_falloff {
    ($falloff:expr, $law:ident => $body:expr) => {
        match $falloff {
            Falloff::Linear { constant } => {
                let $law = LinearFalloff(constant);
                $body
            }
            Falloff::InverseSquare => {
                let $law = InverseSquareFalloff;
                $body
            }
            Falloff::None => {
                let $law = NoFalloff;
                $body
            }
        }
    };
}

pub(super) use with_falloff;
