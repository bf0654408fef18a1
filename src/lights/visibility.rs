//! Visibility of lights from a point, one bit per light.

use crate::simd::{LANES, Lanes};

/// Visibility of the lights of a chunk, bit l for light l of the chunk; 1 is visible.
pub type VisibilityBits = u16;

/// Visibility bits as 0 and 1 per lane.
#[inline(always)]
pub fn expand_bits(bits: VisibilityBits) -> Lanes {
    let mut lanes = [0.0; LANES];
    for (lane, value) in lanes.iter_mut().enumerate() {
        *value = if bits >> lane & 1 == 1 { 1.0 } else { 0.0 };
    }
    lanes
}
