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

/// Visibility V of lights from a surface point.
///
/// A trait, since closures are compiled for the oldest processor wherever they are not inlined.
pub trait Visibility {
    /// V of the lights of a chunk; `None` where none is seen.
    fn of_chunk(&mut self, index: usize) -> Option<Lanes>;
}

/// V = 1.
pub struct Unoccluded;

impl Visibility for Unoccluded {
    #[inline(always)]
    fn of_chunk(&mut self, _: usize) -> Option<Lanes> {
        Some([1.0; LANES])
    }
}

/// The lights whose bits are set are seen, by chunk.
pub struct SeenLights<'a>(pub &'a [VisibilityBits]);

impl Visibility for SeenLights<'_> {
    #[inline(always)]
    fn of_chunk(&mut self, index: usize) -> Option<Lanes> {
        let bits = self.0[index];
        (bits != 0).then(|| expand_bits(bits))
    }
}

/// The lights whose bits are set are seen or half seen, by chunk; `half` may be empty.
pub(crate) struct HalfSeenLights<'a> {
    pub seen: &'a [VisibilityBits],
    pub half: &'a [VisibilityBits],
}

impl Visibility for HalfSeenLights<'_> {
    #[inline(always)]
    fn of_chunk(&mut self, index: usize) -> Option<Lanes> {
        let (seen, half) = (self.seen[index], self.half.get(index).copied().unwrap_or(0));
        if seen | half == 0 {
            return None;
        }
        let mut visible = expand_bits(seen);
        for (lane, visible) in visible.iter_mut().enumerate() {
            *visible = if half >> lane & 1 == 1 { 0.5 } else { *visible };
        }
        Some(visible)
    }
}
