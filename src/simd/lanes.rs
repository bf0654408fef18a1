//! Sixteen values side by side, and what is taken over all of them.

use glam::{Mat4, Vec4};

/// Lights per chunk, and mesh points per packet: one AVX-512 register, two of AVX2.
pub const LANES: usize = 16;

/// One value per lane.
pub type Lanes = [f32; LANES];

/// The lanes of a mask, in ascending order.
#[inline(always)]
pub fn each_lane(mask: u32) -> EachLane {
    EachLane(mask)
}

/// See [`each_lane`].
#[derive(Clone)]
pub struct EachLane(u32);

impl Iterator for EachLane {
    type Item = usize;

    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        (self.0 != 0).then(|| {
            let lane = self.0.trailing_zeros() as usize % LANES;
            self.0 &= self.0 - 1;
            lane
        })
    }
}

/// Sum of all lanes, always in the same order.
#[inline(always)]
pub fn horizontal_sum(lanes: &Lanes) -> f32 {
    // Written out: compilers keep a loop over widths, with a loop over single lanes within it.
    let mut half = [0.0; LANES / 2];
    for lane in 0..LANES / 2 {
        half[lane] = lanes[lane] + lanes[lane + LANES / 2];
    }
    let mut quarter = [0.0; LANES / 4];
    for lane in 0..LANES / 4 {
        quarter[lane] = half[lane] + half[lane + LANES / 4];
    }
    (quarter[0] + quarter[2]) + (quarter[1] + quarter[3])
}

/// Lanes in registers of four, which every x86-64 has.
#[inline(always)]
fn quarters(lanes: &Lanes) -> [Vec4; LANES / 4] {
    // Not by `map`, which stays a call of its own in large functions.
    let quarter = |first: usize| Vec4::from_slice(&lanes[first..]);
    [quarter(0), quarter(4), quarter(8), quarter(12)]
}

/// Smallest and largest of the lanes, none of them NaN: of `least` and of `most`.
#[inline(always)]
pub fn horizontal_extremes(least: &Lanes, most: &Lanes) -> [f32; 2] {
    let ([a, b, c, d], [e, f, g, h]) = (quarters(least), quarters(most));
    [a.min(b).min(c.min(d)).min_element(), e.max(f).max(g.max(h)).max_element()]
}

/// [`horizontal_sum`] of four at once, to the bit.
///
/// From four single sums compilers make some ninety shuffles, which take twice as long.
#[inline(always)]
pub fn horizontal_sums(rows: [&Lanes; 4]) -> Vec4 {
    let sum = |row: &Lanes| {
        let [a, b, c, d] = quarters(row);
        (a + c) + (b + d)
    };
    let [a, b, c, d] = rows;
    let lanes = Mat4::from_cols(sum(a), sum(b), sum(c), sum(d)).transpose();
    (lanes.x_axis + lanes.z_axis) + (lanes.y_axis + lanes.w_axis)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::SplitMix64;
    use glam::Vec3;

    /// Shortcuts over lanes give what goes lane by lane: four sums are the single ones to the bit.
    #[test]
    fn horizontal_shortcuts_equal_the_plain_ways() {
        let mut random = SplitMix64::new(3);
        for _ in 0..100 {
            let rows: [Lanes; 4] = std::array::from_fn(|_| {
                std::array::from_fn(|_| random.in_box(Vec3::splat(-1e3), Vec3::splat(1e3)).x)
            });
            let [a, b, c, d] = &rows;
            assert_eq!(horizontal_sums([a, b, c, d]).to_array(), rows.map(|row| horizontal_sum(&row)));
            let least = a.iter().copied().fold(f32::INFINITY, f32::min);
            let most = b.iter().copied().fold(f32::NEG_INFINITY, f32::max);
            assert_eq!(horizontal_extremes(a, b), [least, most]);
        }
        let none = horizontal_extremes(&[f32::INFINITY; LANES], &[0.0; LANES]);
        assert_eq!(none, [f32::INFINITY, 0.0]);
    }
}
