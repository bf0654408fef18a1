//! Directions in which surface points gather light: over the hemisphere, in proportion to the cosine.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};

use glam::{Mat3, Vec2, Vec3};

use crate::scene::SurfacePoint;

/// Sets of directions. Those of neighbouring points complete each other: together they are a longer stretch of the same sequence.
const SETS: usize = 16;

/// Sets of directions around the z axis. The first half of each, quarter and so on are spread as evenly as all are.
pub struct HemisphereDirections {
    sets: Vec<Vec<Vec3>>,
}

impl HemisphereDirections {
    /// Sets of `count` directions.
    pub fn new(count: u32) -> Self {
        let set = |number: u32| {
            let mut set: Vec<(u32, Vec3)> = (number * count..(number + 1) * count)
                .map(|index| {
                    let disc = to_disc(sobol(index));
                    let direction = Vec3::new(disc.x, disc.y, (1.0 - disc.length_squared()).max(0.0).sqrt());
                    (morton(disc), direction)
                })
                .collect();
            // Rays that go about the same way travel together.
            let mut first = 0;
            for share in [32, 16, 8, 4, 2, 1] {
                let end = part(count, share) as usize;
                set[first..end].sort_by_key(|&(order, _)| order);
                first = end;
            }
            set.into_iter().map(|(_, direction)| direction).collect()
        };
        Self { sets: (0..SETS as u32).map(set).collect() }
    }

    /// Directions of a set.
    pub fn count(&self) -> usize {
        self.sets[0].len()
    }

    /// The directions of a set, and the turn that takes them to a surface point.
    #[inline(always)]
    pub fn at(&self, set: u8, surface: &SurfacePoint) -> (&[Vec3], Mat3) {
        let normal = surface.shading_normal;
        let (u, v) = normal.any_orthonormal_pair();
        (&self.sets[usize::from(set)], Mat3::from_cols(u, v, normal))
    }
}

/// One in so many of some directions, at least one.
pub fn part(count: u32, of: u32) -> u32 {
    count.div_ceil(of)
}

/// Point of the first two dimensions of Sobol's sequence: among the first 2ⁿ, each box of that share of the square that halving its sides
/// makes holds one.
fn sobol(index: u32) -> Vec2 {
    let mut second = 0u32;
    let mut column = 1u32 << 31;
    let mut rest = index;
    while rest != 0 {
        if rest & 1 == 1 {
            second ^= column;
        }
        column ^= column >> 1;
        rest >>= 1;
    }
    let unit = |bits: u32| (bits >> 8) as f32 / (1u32 << 24) as f32;
    Vec2::new(unit(index.reverse_bits()), unit(second))
}

/// The square onto the disc, with equal areas and no more distortion than it takes (Shirley and Chiu, 1997).
fn to_disc(square: Vec2) -> Vec2 {
    let at = 2.0 * square - 1.0;
    if at == Vec2::ZERO {
        return at;
    }
    let (radius, angle) = if at.x.abs() > at.y.abs() {
        (at.x, FRAC_PI_4 * at.y / at.x)
    } else {
        (at.y, FRAC_PI_2 - FRAC_PI_4 * at.x / at.y)
    };
    radius * Vec2::from_angle(angle)
}

/// Number of a place in the disc along a curve that stays near where it is.
fn morton(disc: Vec2) -> u32 {
    let [x, y] = ((disc + 1.0) * 8.0).to_array().map(|number| (number as u32).min(15));
    (0..4).fold(0, |order, bit| order | (x >> bit & 1) << (2 * bit) | (y >> bit & 1) << (2 * bit + 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean of a direction is ⅔ of the normal, of its squared height ½, as the cosine asks, for an eighth, a quarter, a half and all.
    #[test]
    fn directions_follow_the_cosine() {
        let directions = HemisphereDirections::new(256);
        for set in &directions.sets {
            for count in [32, 64, 128, 256] {
                // Far less than the 1/√N of random ones.
                let most = 0.25 / (count as f32).sqrt();
                let mean = set[..count].iter().sum::<Vec3>() / count as f32;
                assert!(mean.abs_diff_eq(Vec3::Z * 2.0 / 3.0, most), "{mean}");
                let square = set[..count].iter().map(|d| d.z * d.z).sum::<f32>() / count as f32;
                assert!((square - 0.5).abs() < most, "{square}");
            }
        }
    }

    /// Every sixteenth of the square, however it is cut, holds four of the first 64 points.
    #[test]
    fn the_sequence_is_even() {
        for bits in 0..=4u32 {
            let mut count = [0; 16];
            for index in 0..64 {
                let at = sobol(index);
                let (x, y) = ((at.x * (1 << bits) as f32) as usize, (at.y * (16 >> bits) as f32) as usize);
                count[x * (16 >> bits) + y] += 1;
            }
            assert_eq!(count, [4; 16]);
        }
    }
}
