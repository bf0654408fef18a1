//! What a probe measures.

use std::f32::consts::{PI, TAU};

use glam::{Mat3, Vec3};

use super::harmonics::{COEFFICIENTS, basis};
use super::probes::Probe;
use crate::sampling::hash_to_unit_cube;

/// What a probe measures, as weights of the light that arrives from a direction. A sensor of one value uses the first weight alone.
#[derive(Clone, Copy, Debug)]
pub enum Sensor {
    /// Irradiance of a surface of this normal (unit length).
    Plane(Vec3),
    /// Fluence: light from all directions counts alike.
    Sphere,
    /// Coefficients of radiance.
    Harmonics,
}

/// What a probe measured.
pub type Values = [Vec3; COEFFICIENTS];

impl Sensor {
    /// The sensor of a probe.
    pub fn of(probe: &Probe) -> Self {
        probe.normal.map_or(Self::Sphere, Self::Plane)
    }

    /// Whether any light from a direction is measured.
    #[inline(always)]
    pub fn faces(&self, direction: Vec3) -> bool {
        match self {
            Self::Plane(normal) => normal.dot(direction) > 0.0,
            Self::Sphere | Self::Harmonics => true,
        }
    }

    /// Adds light that arrives from a direction (unit length), as the irradiance of a surface that faces it.
    #[inline(always)]
    pub fn add(&self, values: &mut Values, direction: Vec3, light: Vec3) {
        match self {
            Self::Plane(normal) => values[0] += light * normal.dot(direction).max(0.0),
            Self::Sphere => values[0] += light,
            Self::Harmonics => {
                values.iter_mut().zip(basis(direction)).for_each(|(value, weight)| *value += light * weight);
            }
        }
    }

    /// The directions in which a probe at a position gathers.
    pub fn directions(&self, position: Vec3, count: u32) -> Directions {
        let start = hash_to_unit_cube(position);
        let turn = match *self {
            Self::Plane(normal) => {
                let (u, v) = normal.any_orthonormal_pair();
                Some(Mat3::from_cols(u, v, normal))
            }
            Self::Sphere | Self::Harmonics => None,
        };
        Directions { start: [start.x, start.y].map(f64::from), turn, count }
    }
}

/// Directions around a probe: over the hemisphere in proportion to the cosine, or evenly over the sphere. They follow from the position alone.
pub struct Directions {
    start: [f64; 2],
    turn: Option<Mat3>,
    count: u32,
}

impl Directions {
    /// Direction k (unit length), and what radiance from there is multiplied by: the solid angle that it stands for.
    #[inline(always)]
    pub fn at(&self, k: u32) -> (Vec3, f32) {
        // Any first few are spread evenly (Roberts' R2).
        let step = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];
        let [u, v] = [0, 1].map(|axis| (self.start[axis] + step[axis] * f64::from(k)).fract() as f32);
        let (sine, cosine) = (TAU * v).sin_cos();
        let count = self.count as f32;
        match self.turn {
            Some(turn) => {
                let (radius, height) = (u.sqrt(), (1.0 - u).max(1e-6).sqrt());
                (turn * Vec3::new(radius * cosine, radius * sine, height), PI / (height * count))
            }
            None => {
                let height = 1.0 - 2.0 * u;
                let radius = (1.0 - height * height).max(0.0).sqrt();
                (Vec3::new(radius * cosine, radius * sine, height), 2.0 * TAU / count)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Light of radiance 1 from everywhere is an irradiance of π, a fluence of 4π, and harmonics of √4π and eight times 0; one direction stands for
    /// more of the sphere the more it grazes, so that each has the same share of the irradiance.
    #[test]
    fn even_light_is_measured_as_it_should_be() {
        let measured = |sensor: Sensor| {
            let directions = sensor.directions(Vec3::new(0.3, 0.1, 2.0), 4096);
            let mut values = Values::default();
            (0..4096).map(|k| directions.at(k)).for_each(|(direction, solid_angle)| {
                sensor.add(&mut values, direction, Vec3::splat(solid_angle));
            });
            values.map(|value| value.x)
        };
        let normal = Vec3::new(1.0, 2.0, -2.0) / 3.0;
        assert!((measured(Sensor::Plane(normal))[0] / PI - 1.0).abs() < 1e-3);
        assert!((measured(Sensor::Sphere)[0] / (4.0 * PI) - 1.0).abs() < 1e-3);
        let harmonics = measured(Sensor::Harmonics);
        assert!((harmonics[0] / (4.0 * PI).sqrt() - 1.0).abs() < 1e-3);
        assert!(harmonics[1..].iter().all(|value| value.abs() < 0.02), "{harmonics:?}");
    }
}
