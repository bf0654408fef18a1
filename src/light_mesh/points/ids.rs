//! Numbers of mesh points that depend on the layout and its spacing alone: neither on R, nor on how far the scene reaches.
//!
//! Layouts have no end. Their space is divided into blocks of cells around the layout's anchor; a point's id is made of its
//! block's coordinates and its place within the block. 64 consecutive ids form a *brick*, the unit in which known points are kept.

use glam::{IVec3, Vec3};

use crate::Bounds;

/// Bits of a point's id within its layer; those above name the layer.
pub const LAYER_SHIFT: u32 = 55;

/// Layers that ids can distinguish.
pub const MOST_LAYERS: usize = 1 << (64 - LAYER_SHIFT);

/// Cells lie within ±`CELL_RANGE` of the anchor along each axis: 3 · 18 bits, and one for layouts with two points per cell.
const CELL_RANGE: i32 = 1 << 17;

/// A scene may be as many spacings long; the rest of the range is left to neighbourhoods that reach beyond it.
const LONGEST_SCENE: f32 = 120_000.0;

/// Blocks of `edge` cells a side (a power of two).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Blocks {
    /// Bits of a cell's place in its block, along an axis.
    shift: u32,
}

impl Blocks {
    /// Blocks of 2^`shift` cells a side.
    pub const fn new(shift: u32) -> Self {
        Self { shift }
    }

    /// Bits of a block's coordinate along an axis.
    const fn bits(self) -> u32 {
        CELL_RANGE.ilog2() + 1 - self.shift
    }

    /// Number of the block that holds a cell, whose coordinates lie in ±[`CELL_RANGE`].
    #[inline(always)]
    pub fn of(self, cell: IVec3) -> u64 {
        let coordinate = |at: i32| (at.wrapping_add(CELL_RANGE) >> self.shift) as u64;
        let bits = self.bits();
        coordinate(cell.z) << (2 * bits) | coordinate(cell.y) << bits | coordinate(cell.x)
    }

    /// Its lowest cell.
    #[inline(always)]
    pub fn first_cell(self, block: u64) -> IVec3 {
        let bits = self.bits();
        let coordinate = |at: u64| (((at & ((1 << bits) - 1)) as i32) << self.shift) - CELL_RANGE;
        IVec3::new(coordinate(block), coordinate(block >> bits), coordinate(block >> (2 * bits)))
    }
}

/// Cells from `first` to `last`, as far as they have numbers.
#[inline(always)]
pub fn within_range(first: Vec3, last: Vec3) -> (IVec3, IVec3) {
    (first.as_ivec3().max(IVec3::splat(-CELL_RANGE)), last.as_ivec3().min(IVec3::splat(CELL_RANGE - 1)))
}

/// Where the layouts of all spacings are anchored, as a share of the spacing's octave that is about as long as the scene.
///
/// A third, since a third of a spacing is two thirds of half a spacing and those are, but for a whole number, a third of a
/// quarter: layers of points keep away from the lower faces of the bounds at every spacing, and points of one spacing are
/// among those of its half. The small rest keeps layers out of surfaces that lie at thirds of a spacing.
const PHASE: f32 = 1.0 / 3.0 + 1.3e-5;

/// A position that is a point of every layout whose spacing is `spacing` (> 0, per axis) times a power of two.
pub fn anchor(bounds: Bounds, spacing: Vec3) -> Vec3 {
    let length = bounds.extent().max_element();
    let length = if length > 0.0 && length.is_finite() { length } else { 1.0 };
    let octave = |spacing: f32| {
        // Products with powers of two are exact, so that spacings that differ by one have the same octave.
        let mut octave = spacing;
        while octave < length {
            octave *= 2.0;
        }
        while octave >= 2.0 * length && octave > f32::MIN_POSITIVE {
            octave *= 0.5;
        }
        octave
    };
    let corner = if bounds.is_empty() { Vec3::ZERO } else { bounds.min };
    corner + Vec3::from_array(spacing.to_array().map(octave)) * PHASE
}

/// Spacing over the largest coordinate that leaves 16 representable numbers between neighbouring points.
const PER_COORDINATE: f32 = 16.0 * f32::EPSILON;

/// The finest spacing that single-precision coordinates over `bounds` allow; 0 without bounds.
pub fn finest(bounds: Bounds) -> f32 {
    let largest = bounds.min.abs().max(bounds.max.abs()).max_element();
    if bounds.is_empty() { 0.0 } else { PER_COORDINATE * largest }
}

/// Whether a spacing is too fine for single-precision coordinates over `bounds`, along each axis, or for ids.
pub fn too_fine(bounds: Bounds, spacing: Vec3) -> bool {
    let largest = bounds.min.abs().max(bounds.max.abs());
    let fits = (largest * PER_COORDINATE).cmple(spacing)
        & (bounds.extent() / spacing).cmple(Vec3::splat(LONGEST_SCENE));
    !bounds.is_empty() && !fits.all()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A block's number leads back to its lowest cell, at the ends of the range too, and fits an id beside 10 bits of place.
    #[test]
    fn blocks_and_their_numbers_belong_together() {
        for (shift, places) in [(2, 64u64), (3, 1024)] {
            let blocks = Blocks::new(shift);
            for cell in [
                IVec3::splat(-CELL_RANGE),
                IVec3::splat(CELL_RANGE - 1),
                IVec3::ZERO,
                IVec3::new(-1, 77, -4000),
            ] {
                let number = blocks.of(cell);
                let first = blocks.first_cell(number);
                let inside = cell - first;
                assert!(inside.min_element() >= 0 && inside.max_element() < 1 << shift, "{cell} in {first}");
                assert!(number < (1 << LAYER_SHIFT) / places);
            }
        }
    }

    /// Layers of points lie about a third or two thirds of a spacing above the bounds' lower faces, at all spacings of use; and
    /// halves of a spacing share its anchor to the bit.
    #[test]
    fn anchors_nest_and_keep_away_from_the_faces() {
        let bounds = Bounds { min: Vec3::new(-7.0, 0.0, 3.0), max: Vec3::new(20.0, 0.0, 11.5) };
        for spacing in [0.37, 0.5, 1.0, 1.3] {
            let coarse = anchor(bounds, Vec3::splat(spacing));
            let mut fine = spacing;
            for _ in 0..5 {
                assert_eq!(anchor(bounds, Vec3::splat(fine)), coarse);
                let above = ((coarse - bounds.min) / fine).fract();
                assert!(above.min_element() > 0.3 && above.max_element() < 0.7, "{above} at {fine}");
                fine *= 0.5;
            }
        }
        // Bounds of no size, or none, have anchors too.
        assert!(anchor(Bounds::EMPTY, Vec3::ONE).is_finite());
        assert!(anchor(Bounds { min: Vec3::ONE, max: Vec3::ONE }, Vec3::splat(1e30)).is_finite());
    }

    #[test]
    fn spacings_that_ids_or_coordinates_cannot_express_are_too_fine() {
        let bounds = Bounds { min: Vec3::ZERO, max: Vec3::splat(100.0) };
        assert!(!too_fine(bounds, Vec3::splat(0.001)));
        assert!(too_fine(bounds, Vec3::splat(0.0005)));
        let far = Bounds { min: Vec3::splat(1e6), max: Vec3::splat(1e6 + 1.0) };
        assert!(too_fine(far, Vec3::splat(1.0)) && !too_fine(far, Vec3::splat(2.0)));
        assert!(too_fine(bounds, Vec3::NAN));
    }
}
