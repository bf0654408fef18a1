//! Real spherical harmonics of the first three bands.

use std::f32::consts::PI;

use glam::Vec3;

/// Coefficients per channel: bands 0, 1 and 2.
pub const COEFFICIENTS: usize = 9;

/// What coefficients of radiance are multiplied by to get those of irradiance by normal: π, 2π/3 and π/4 in the three bands (Ramamoorthi and
/// Hanrahan, 2001).
pub const COSINE_FACTORS: [f32; COEFFICIENTS] = {
    let (first, second) = (2.0 * PI / 3.0, PI / 4.0);
    [PI, first, first, first, second, second, second, second, second]
};

/// Y_lm at a direction (unit length), orthonormal over the sphere, without the factor (−1)^m of Condon and Shortley, in the order (0,0), (1,−1), (1,0),
/// (1,1), (2,−2) to (2,2): constants times 1; y, z, x; xy, yz, 3z² − 1, xz, x² − y².
pub fn basis(direction: Vec3) -> [f32; COEFFICIENTS] {
    let Vec3 { x, y, z } = direction;
    // √(1/4π), √(3/4π), √(15/4π), √(5/16π), √(15/16π).
    const CONSTANT: f32 = 0.282_094_79;
    const LINEAR: f32 = 0.488_602_51;
    const MIXED: f32 = 1.092_548_4;
    const ZONAL: f32 = 0.315_391_57;
    const SQUARES: f32 = 0.546_274_2;
    [
        CONSTANT,
        LINEAR * y,
        LINEAR * z,
        LINEAR * x,
        MIXED * x * y,
        MIXED * y * z,
        ZONAL * (3.0 * z * z - 1.0),
        MIXED * x * z,
        SQUARES * (x * x - y * y),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::SphereStrata;

    /// The mean of the product of two of them over the sphere is 1/4π if they are the same, 0 if not.
    #[test]
    fn the_basis_is_orthonormal() {
        let directions = SphereStrata::new(20_000).middles();
        let mut products = [[0.0f64; COEFFICIENTS]; COEFFICIENTS];
        for &direction in &directions {
            let values = basis(direction);
            for (row, a) in products.iter_mut().zip(values) {
                for (product, b) in row.iter_mut().zip(values) {
                    *product += f64::from(a * b) * 4.0 * std::f64::consts::PI / directions.len() as f64;
                }
            }
        }
        for (i, row) in products.iter().enumerate() {
            for (j, product) in row.iter().enumerate() {
                let expected = if i == j { 1.0 } else { 0.0 };
                assert!((product - expected).abs() < 2e-3, "{i} {j}: {product}");
            }
        }
    }
}
