//! Stratified directions over the whole sphere, for eq. (4).

use std::f32::consts::PI;

use glam::{Mat3, Quat, Vec3};

use super::hash::{hash_to_unit_cube, mix};

/// A partition of the sphere into `N` parts of equal area: zones of equal-area cells.
///
/// One direction is drawn from each part, so that the mean over the directions is the mean over the sphere. Zones near
/// the poles have fewer cells, so that cells are about as wide as they are high.
#[derive(Clone, Debug, PartialEq)]
pub struct SphereStrata {
    /// First cell of each zone, and N at the end.
    first: Vec<u32>,
    /// Zone of each cell.
    zone: Vec<u32>,
}

impl SphereStrata {
    /// Partition into `directions` (at least 1) parts.
    pub fn new(directions: u32) -> Self {
        // Cells of solid angle 4π/N are about √(4π/N) high.
        let zones = ((PI * directions as f32 / 4.0).sqrt().round() as u32).clamp(1, directions);
        let mut first = Vec::with_capacity(zones as usize + 1);
        for zone in 0..=zones {
            // Cells above the zone's upper edge, were the zones of equal height in angle; every zone gets
            // one cell at least.
            let angle = PI * zone as f32 / zones as f32;
            let cells = (0.5 * (1.0 - angle.cos()) * directions as f32).round() as u32;
            first.push(cells.clamp(zone, directions - (zones - zone)));
        }
        let zone = (0..zones)
            .flat_map(|zone| {
                let cells = first[zone as usize]..first[zone as usize + 1];
                cells.map(move |_| zone)
            })
            .collect();
        Self { first, zone }
    }

    /// Number of parts.
    pub fn len(&self) -> u32 {
        self.zone.len() as u32
    }

    /// The direction at (u, v) of [0, 1)² within part `cell`; uniform there for uniform (u, v).
    #[inline(always)]
    pub fn direction(&self, cell: u32, u: f32, v: f32) -> Vec3 {
        let zone = self.zone[cell as usize] as usize;
        let (begin, end) = (self.first[zone], self.first[zone + 1]);
        let cells = (end - begin) as f32;
        // Area on the sphere is proportional to height (Archimedes).
        let z = 1.0 - 2.0 * (begin as f32 + cells * u) / self.zone.len() as f32;
        let phi = 2.0 * PI * ((cell - begin) as f32 + v) / cells;
        let r = (1.0 - z * z).max(0.0).sqrt();
        Vec3::new(r * phi.cos(), r * phi.sin(), z)
    }

    /// The middle of each part.
    pub fn middles(&self) -> Vec<Vec3> {
        (0..self.len()).map(|cell| self.direction(cell, 0.5, 0.5)).collect()
    }

    /// The direction of part `cell` for the mesh point at `x`: jittered by a hash of the two, so that the result depends
    /// on nothing else.
    #[inline(always)]
    pub fn jittered(&self, cell: u32, x: Vec3) -> Vec3 {
        let bits = x.to_array().map(f32::to_bits);
        let mut h = u64::from(bits[0]) | u64::from(bits[1]) << 32;
        h = mix(h ^ u64::from(bits[2]).rotate_left(16) ^ u64::from(cell) << 40);
        h = mix(h ^ u64::from(cell).wrapping_mul(0x9E37_79B9_7F4A_7C15));
        let u = (h >> 40) as f32 / (1u32 << 24) as f32;
        let v = (h >> 8 & 0xff_ffff) as f32 / (1u32 << 24) as f32;
        self.direction(cell, u, v)
    }
}

/// A rotation that belongs to a position; over all positions, all rotations are equally likely (Shoemake, "Uniform random
/// rotations", 1992).
pub fn rotation_at(x: Vec3) -> Mat3 {
    let noise = hash_to_unit_cube(x);
    let (low, high) = ((1.0 - noise.x).sqrt(), noise.x.sqrt());
    let (sin_a, cos_a) = (2.0 * PI * noise.y).sin_cos();
    let (sin_b, cos_b) = (2.0 * PI * noise.z).sin_cos();
    Mat3::from_quat(Quat::from_xyzw(low * sin_a, low * cos_a, high * sin_b, high * cos_b))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The parts are disjoint and have equal areas that sum to the sphere: they cover it exactly once.
    #[test]
    fn strata_cover_the_sphere_exactly_once() {
        for directions in [1, 2, 3, 5, 16, 64, 100, 256, 1000] {
            let strata = SphereStrata::new(directions);
            assert_eq!(strata.len(), directions);
            let mut count = vec![0u32; directions as usize];
            // Every point of a fine equal-area raster lies in exactly one cell, found from the bounds alone.
            const RASTER: u32 = 400;
            for i in 0..RASTER {
                for j in 0..RASTER {
                    let z = 1.0 - 2.0 * (i as f64 + 0.5) / f64::from(RASTER);
                    let turn = (j as f64 + 0.5) / f64::from(RASTER);
                    let height = (1.0 - z) / 2.0 * f64::from(directions);
                    let mut hits = 0;
                    for zone in 0..strata.first.len() - 1 {
                        let (begin, end) = (f64::from(strata.first[zone]), f64::from(strata.first[zone + 1]));
                        if begin <= height && height < end {
                            count[(begin + turn * (end - begin)) as usize] += 1;
                            hits += 1;
                        }
                    }
                    assert_eq!(hits, 1);
                }
            }
            let expected = f64::from(RASTER * RASTER) / f64::from(directions);
            for count in count {
                assert!((f64::from(count) - expected).abs() < 0.1 * expected + 2.0 * f64::from(RASTER));
            }
        }
    }

    /// Corners of a cell map to its own height and azimuth: `direction` draws from the cell that it names.
    #[test]
    fn directions_stay_in_their_cell() {
        let strata = SphereStrata::new(200);
        for cell in 0..200 {
            let zone = strata.zone[cell as usize] as usize;
            let (begin, end) = (strata.first[zone], strata.first[zone + 1]);
            for (u, v) in [(0.01, 0.01), (0.5, 0.5), (0.99, 0.99)] {
                let d = strata.direction(cell, u, v);
                assert!((d.length() - 1.0).abs() < 1e-5);
                let height = (1.0 - d.z) / 2.0 * 200.0;
                assert!(height > begin as f32 - 1e-2 && height < end as f32 + 1e-2);
                let turn = d.y.atan2(d.x).rem_euclid(2.0 * PI) / (2.0 * PI) * (end - begin) as f32;
                assert!((turn - ((cell - begin) as f32 + v)).abs() < 1e-2);
            }
        }
    }

    /// Rotations of many places take a direction everywhere alike, and keep lengths and handedness.
    #[test]
    fn rotations_are_uniform() {
        const COUNT: usize = 20_000;
        let (mut mean, mut square) = (Vec3::ZERO, Vec3::ZERO);
        for i in 0..COUNT {
            let rotation = rotation_at(Vec3::new(i as f32, 0.5, -3.0));
            assert!((rotation.determinant() - 1.0).abs() < 1e-5);
            let turned = rotation * Vec3::new(0.6, 0.0, 0.8);
            assert!((turned.length() - 1.0).abs() < 1e-5);
            mean += turned / COUNT as f32;
            square += turned * turned / COUNT as f32;
        }
        // Means of so many differ by 0.004 at one standard deviation, of squares by 0.002.
        assert!(
            mean.abs().max_element() < 0.02 && (square - 1.0 / 3.0).abs().max_element() < 0.01,
            "{mean}, {square}"
        );
    }

    /// The mean of a linear and a quadratic function over the directions is that over the sphere.
    #[test]
    fn means_are_those_over_the_sphere() {
        let strata = SphereStrata::new(1024);
        let x = Vec3::new(0.3, -2.0, 7.0);
        let (mut linear, mut square) = (Vec3::ZERO, Vec3::ZERO);
        for cell in 0..1024 {
            let d = strata.jittered(cell, x);
            linear += d / 1024.0;
            square += d * d / 1024.0;
        }
        assert!(linear.abs().max_element() < 0.005, "{linear}");
        assert!((square - 1.0 / 3.0).abs().max_element() < 0.005, "{square}");
    }
}
