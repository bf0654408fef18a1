//! Rays that find out what a model is like.

use glam::Vec3;

use crate::Bounds;
use crate::accel::Accel;
use crate::sampling::SphereStrata;
use crate::sampling::SplitMix64;
use crate::scene::{Interaction, LightKind, Ray, Scene};

/// A scene that rays explore.
pub struct Probe<'a, A> {
    /// Traces the rays.
    pub accel: &'a A,
    /// What they meet.
    pub scene: &'a Scene,
    /// Its bounds.
    pub bounds: Bounds,
}

/// A surface that a ray met.
#[derive(Clone, Copy, Debug)]
pub struct Sight {
    /// From the ray's origin, scene units.
    pub distance: f32,
    /// Where rays can go on from, on the side that was seen.
    pub near: Vec3,
    /// The same, on the far side.
    pub far: Vec3,
    /// Normal of the side that was seen.
    pub normal: Vec3,
    /// Whether that is the front. Two-sided materials don't matter: the winding decides what is the inside of a
    /// thing.
    pub front: bool,
}

/// What lines through the model found.
pub struct Rooms {
    /// Lines that met the model.
    lines: usize,
    /// Of each line the middle of the longest part between two fronts, and how much of its surroundings are fronts.
    gaps: Vec<(Vec3, f32)>,
}

impl Rooms {
    /// Positions of whose surroundings at least this share are fronts.
    pub fn enclosed(&self, share: f32) -> Vec<Vec3> {
        self.gaps.iter().filter(|(_, fronts)| *fronts >= share).map(|(middle, _)| *middle).collect()
    }

    /// Share of the lines that have such a position.
    pub fn share(&self, share: f32) -> f32 {
        self.enclosed(share).len() as f32 / self.lines.max(1) as f32
    }
}

/// Random lines through the model.
const LINES: u32 = 256;
/// Surfaces that a line may meet: more find nothing new.
const SURFACES: usize = 64;
/// Directions around a position.
const DIRECTIONS: u32 = 48;

impl<A: Accel> Probe<'_, A> {
    /// Diagonal of the scene; positive.
    pub fn diagonal(&self) -> f32 {
        let diagonal = self.bounds.extent().length();
        if diagonal > 0.0 && diagonal.is_finite() { diagonal } else { 1.0 }
    }

    /// What is seen along a direction (unit length).
    pub fn look(&self, origin: Vec3, direction: Vec3) -> Option<Sight> {
        let hit = self.accel.intersect(&Ray::new(origin, direction))?;
        let Interaction { point: surface, front, .. } = self.scene.interaction(&hit, direction);
        let offset = surface.geometric_normal * surface.offset;
        Some(Sight {
            distance: hit.t,
            near: surface.position + offset,
            far: surface.position - offset,
            normal: surface.geometric_normal,
            front,
        })
    }

    /// What is seen along a direction (unit length) through the backs of surfaces.
    pub fn look_through(&self, origin: Vec3, direction: Vec3) -> Option<Sight> {
        let mut origin = origin;
        for _ in 0..SURFACES {
            let sight = self.look(origin, direction)?;
            if sight.front {
                return Some(sight);
            }
            origin = sight.far;
        }
        None
    }

    /// Looks for room along random lines: between two fronts that face each other. Inside a solid thing there are only
    /// backs.
    pub fn rooms(&self) -> Rooms {
        let mut random = SplitMix64::new(0);
        let strata = SphereStrata::new(LINES);
        let radius = 0.5 * self.diagonal();
        let mut rooms = Rooms { lines: 0, gaps: Vec::new() };
        for line in 0..LINES {
            let direction = strata.direction(line, random.unit(), random.unit());
            let (u, v) = direction.any_orthonormal_pair();
            let (r, turn) = (random.unit().sqrt(), std::f32::consts::TAU * random.unit());
            let aside = (u * turn.cos() + v * turn.sin()) * (r * radius);
            let start = self.bounds.center() + aside - direction * (1.5 * radius);
            let (met, longest) = self.longest_gap(start, direction);
            rooms.lines += usize::from(met);
            rooms.gaps.extend(longest.map(|middle| (middle, self.fronts_around(middle))));
        }
        rooms
    }

    /// Whether a line meets anything, and the middle of its longest part between two fronts.
    fn longest_gap(&self, start: Vec3, direction: Vec3) -> (bool, Option<Vec3>) {
        let least = 1e-3 * self.diagonal();
        let (mut origin, mut left_a_front, mut met) = (start, false, false);
        let mut longest: Option<(f32, Vec3)> = None;
        for _ in 0..SURFACES {
            let Some(sight) = self.look(origin, direction) else { break };
            let length = sight.distance;
            if left_a_front && sight.front && length > longest.map_or(least, |(length, _)| length) {
                longest = Some((length, origin + direction * (0.5 * length)));
            }
            // A line that comes to a back leaves by the front.
            (origin, left_a_front, met) = (sight.far, !sight.front, true);
        }
        (met, longest.map(|(_, middle)| middle))
    }

    fn fronts_around(&self, x: Vec3) -> f32 {
        let strata = SphereStrata::new(DIRECTIONS);
        let fronts = (0..DIRECTIONS)
            .filter(|&cell| self.look(x, strata.jittered(cell, x)).is_some_and(|sight| sight.front))
            .count();
        fronts as f32 / DIRECTIONS as f32
    }

    /// The position at a share of the height between what is below and above; unchanged where that is open.
    pub fn at_height(&self, x: Vec3, share: f32) -> Vec3 {
        let distance = |direction| self.look(x, direction).map(|sight| sight.distance);
        match (distance(Vec3::Y), distance(Vec3::NEG_Y)) {
            (Some(above), Some(below)) => x + Vec3::Y * (share * (above + below) - below),
            _ => x,
        }
    }

    /// Whether nothing lies between two positions.
    pub fn sees(&self, from: Vec3, to: Vec3) -> bool {
        !self.accel.occluded(&Ray::between(from, to))
    }

    /// The largest share of some positions that one of them sees.
    pub fn seen_at_once(&self, positions: &[Vec3]) -> f32 {
        let seen = |from: Vec3| positions.iter().filter(|&&to| self.sees(from, to)).count();
        let most = positions.iter().map(|&from| seen(from)).max().unwrap_or(0);
        most as f32 / positions.len().max(1) as f32
    }

    /// Share of the directions above a surface that end on other surfaces.
    pub fn shelter(&self, sight: &Sight) -> f32 {
        let strata = SphereStrata::new(DIRECTIONS);
        let (mut above, mut blocked) = (0, 0);
        for cell in 0..DIRECTIONS {
            let direction = strata.jittered(cell, sight.near);
            if direction.dot(sight.normal) > 0.0 {
                above += 1;
                blocked += u32::from(self.accel.occluded(&Ray::new(sight.near, direction)));
            }
        }
        blocked as f32 / above.max(1) as f32
    }

    /// Whether the light that would be strongest at a surface reaches it; true without lights.
    pub fn is_lit(&self, sight: &Sight) -> bool {
        let at = sight.near;
        let strongest = self.scene.lights.iter().map(|light| {
            let (towards, falloff) = match light.kind {
                LightKind::Directional { direction } => (-direction, 1.0),
                LightKind::Point | LightKind::Ball { .. } | LightKind::Spot { .. } => {
                    let offset = light.position - at;
                    (offset.normalize_or_zero(), self.scene.falloff.reciprocal(offset.length()))
                }
            };
            let cosine = sight.normal.dot(towards).max(0.0);
            (light, light.intensity.max_element() * light.kind.cone_factor(-towards) * falloff * cosine)
        });
        let Some((light, irradiance)) = strongest.max_by(|(_, a), (_, b)| a.total_cmp(b)) else {
            return true;
        };
        let ray = match light.kind {
            LightKind::Directional { direction } => Ray::new(at, -direction),
            LightKind::Point | LightKind::Ball { .. } | LightKind::Spot { .. } => {
                Ray::between(at, light.position)
            }
        };
        irradiance > 0.0 && !self.accel.occluded(&ray)
    }
}
