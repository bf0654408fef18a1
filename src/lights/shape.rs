//! Lights with a size: where on them occlusion rays end (method §4).

use std::f32::consts::TAU;
use std::sync::Arc;

use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

use super::emitters::Piece;
use crate::sampling::hash_to_unit_cube;

/// Parts that a ball is divided into, sectors of the disc that one sees of it, each of which is a light of its own. The first rays to a lamp, one for each part,
/// have to find that it is hidden in part; of many lamps each matters less.
pub(super) fn ball_parts(balls: usize) -> u8 {
    (32 / balls.max(1)).clamp(1, 4) as u8
}

/// What the radius of a ball is multiplied by where rays to it end.
const BEYOND_FACETS: f32 = 1.01;

/// A ray that starts so far from a surface, as a part of its own length, doesn't touch it.
const SHORTER: f32 = 1.0 - 1e-4;

/// The part of a lamp that a light stands for.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum LampShape {
    /// No size: rays end at the light's position.
    #[default]
    Point,
    /// One sector of the disc that is seen of a ball.
    Ball {
        /// Radius of the ball.
        radius: f32,
        /// Number of the sector, and of all of them.
        part: (u8, u8),
    },
    /// Pieces of triangles, in the order of their shares.
    Emitter(Arc<[Piece]>),
}

impl LampShape {
    /// The way from `x` to a point of the lamp that two numbers of [0, 1) choose; `to_light` is that to its position. Whatever the lamp is made
    /// of itself doesn't stand in this way.
    pub fn way(&self, to_light: Vec3, x: Vec3, numbers: Vec2) -> Vec3 {
        match self {
            Self::Point => to_light,
            Self::Ball { radius, part } => {
                let distance = to_light.length();
                if distance <= radius * BEYOND_FACETS {
                    return Vec3::ZERO;
                }
                let direction = to_light / distance;
                // Its geometry, of flat triangles, is a little larger here and there.
                let radius = radius * BEYOND_FACETS;
                let (u, v) = direction.any_orthonormal_pair();
                let angle = TAU * (f32::from(part.0) + numbers.y) / f32::from(part.1);
                let from_axis = radius * (1.0 / BEYOND_FACETS) * numbers.x.sqrt();
                // From nearby less than a half of the ball is seen: rays that touch it do so closer to the eye than its middle.
                let towards =
                    (radius * radius / distance).max((radius * radius - from_axis * from_axis).sqrt());
                let from_axis = from_axis.min((radius * radius - towards * towards).max(0.0).sqrt());
                let (sine, cosine) = angle.sin_cos();
                (to_light - direction * towards + (u * cosine + v * sine) * from_axis) * SHORTER
            }
            Self::Emitter(pieces) => {
                let number = pieces.partition_point(|piece| piece.up_to <= numbers.x).min(pieces.len() - 1);
                let before = if number == 0 { 0.0 } else { pieces[number - 1].up_to };
                let piece = &pieces[number];
                // What the choice leaves of the number is a number again.
                let rest = ((numbers.x - before) / (piece.up_to - before)).clamp(0.0, 1.0);
                (piece.point(Vec2::new(rest, numbers.y)) - x) * SHORTER
            }
        }
    }
}

/// Two numbers of [0, 1) that choose a point of a lamp: those of number k, of a sequence that belongs to a place. Any first few
/// of a sequence are spread evenly (Roberts' R2).
#[inline(always)]
pub fn lamp_numbers(x: Vec3, k: u32) -> Vec2 {
    let start = hash_to_unit_cube(x);
    (Vec2::new(start.x, start.y) + k as f32 * Vec2::new(0.754_877_7, 0.569_840_3)).fract()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rays to a ball end at its surface, on the side that shows, and their ends fill the disc that one sees evenly: half of them within
    /// the circle of half the area, a quarter of them in each sector.
    #[test]
    fn rays_fill_the_disc_of_a_ball() {
        let (x, centre, radius) = (Vec3::new(1.0, 2.0, 3.0), Vec3::new(4.0, -2.0, 3.0), 0.01);
        let to_light = centre - x;
        let mut inner = 0;
        for k in 0..1000 {
            for part in 0..4 {
                let way = LampShape::Ball { radius, part: (part, 4) }.way(to_light, x, lamp_numbers(x, k));
                let from_centre = way / SHORTER - to_light;
                assert!((from_centre.length() / (radius * BEYOND_FACETS) - 1.0).abs() < 1e-2);
                assert!(from_centre.dot(to_light) < 0.0);
                let from_axis = from_centre.reject_from(to_light).length();
                inner += u32::from(from_axis < radius * 0.5f32.sqrt());
            }
        }
        assert!((inner as f32 / 2000.0 - 1.0).abs() < 0.02, "{inner} of 4000");
    }

    /// Nothing beyond what can be seen of a ball nearby is looked for, and nothing from inside.
    #[test]
    fn rays_to_a_near_ball_end_before_it() {
        let ball = LampShape::Ball { radius: 1.0, part: (1, 2) };
        for k in 0..100 {
            let way = ball.way(Vec3::Z * 1.2, Vec3::ZERO, lamp_numbers(Vec3::ZERO, k));
            // Along the way, no point before its end is inside.
            for step in 0..100 {
                let at = way * (step as f32 / 100.0);
                assert!(at.distance(Vec3::Z * 1.2) > 0.999, "{way} enters at {at}");
            }
            assert_eq!(ball.way(Vec3::Z * 0.9, Vec3::ZERO, Vec2::splat(0.5)), Vec3::ZERO);
        }
    }
}
