//! Irradiance by normal from second-order harmonics: the directional basis of method §4.
//!
//! Light of weight 1 from direction ω irradiates a surface of normal n with max(0, n·ω). Cut off after
//! second-order spherical harmonics (Ramamoorthi and Hanrahan, 2001) this is 1/4 + (n·ω)/2 + 5/32·(3(n·ω)² − 1), a
//! quadratic polynomial in n. As |n| = 1, its constant can be moved into the squares, which leaves nine
//! coefficients per colour channel: those of x, y, z, x², y², z², xy, xz, yz.

use glam::{Vec3, Vec4};

/// Coefficients per channel.
pub const COEFFICIENTS: usize = 9;

/// Numbers kept per mesh point: coefficient after coefficient, each of three channels and a number without meaning, so
/// that a coefficient is a vector register.
pub(crate) const STRIDE: usize = 4 * COEFFICIENTS;

/// The coefficients of max(0, n·ω), for n the unit vector ω.
#[inline(always)]
pub(crate) fn cosine_lobe(w: [f32; 3]) -> [f32; COEFFICIENTS] {
    let [x, y, z] = w;
    const SQUARE: f32 = 15.0 / 32.0;
    const CONSTANT: f32 = 3.0 / 32.0;
    [
        0.5 * x,
        0.5 * y,
        0.5 * z,
        SQUARE * x * x + CONSTANT,
        SQUARE * y * y + CONSTANT,
        SQUARE * z * z + CONSTANT,
        2.0 * SQUARE * x * y,
        2.0 * SQUARE * x * z,
        2.0 * SQUARE * y * z,
    ]
}

/// What the coefficients are multiplied with to get the irradiance of normal n.
#[inline(always)]
pub(crate) fn monomials(n: Vec3) -> [f32; COEFFICIENTS] {
    let Vec3 { x, y, z } = n;
    [x, y, z, x * x, y * y, z * z, x * y, x * z, y * z]
}

/// Irradiance of normal `n` (unit length) from coefficients of three channels. Second order undershoots for
/// normals that face away from a single light, so that it is clamped at 0.
#[inline(always)]
pub fn irradiance(coefficients: &[Vec4; COEFFICIENTS], n: Vec3) -> Vec3 {
    let mut channels = Vec4::ZERO;
    for (coefficient, monomial) in coefficients.iter().zip(monomials(n)) {
        channels += *coefficient * monomial;
    }
    channels.truncate().max(Vec3::ZERO)
}

/// Light from all directions, summed over the channels: the squares' coefficients of a lobe sum to 3/4 whatever its
/// direction. Up to that factor it is what scalar values hold.
#[inline(always)]
pub(crate) fn amount(coefficients: &[f32]) -> f32 {
    coefficients.as_chunks::<4>().0.iter().skip(3).take(3).map(|c| c[0] + c[1] + c[2]).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The polynomial is the stated one, and it is within 0.1 of the cosine that it stands for.
    #[test]
    fn the_lobe_is_the_second_order_expansion_of_the_cosine() {
        for i in 0..200 {
            let (a, b) = (i as f32 * 0.7, i as f32 * 0.31);
            let w = Vec3::new(a.cos() * b.sin(), a.sin() * b.sin(), b.cos()).normalize();
            let n = Vec3::new(b.cos(), (a * 1.7).sin(), a.cos()).normalize();
            let coefficients = cosine_lobe(w.to_array()).map(|value| Vec4::new(value, 0.0, 0.0, 0.0));
            let cosine = n.dot(w);
            let exact = 0.25 + 0.5 * cosine + 5.0 / 32.0 * (3.0 * cosine * cosine - 1.0);
            assert!((irradiance(&coefficients, n).x - exact.max(0.0)).abs() < 1e-5);
            assert!((exact - cosine.max(0.0)).abs() < 0.1);
        }
    }
}
