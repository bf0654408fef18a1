//! Neighbouring surface points that mostly see the same lights.

use std::ops::Range;

use glam::Vec3;

use crate::accel::LaneMask;
use crate::lights::PackedLights;
use crate::render::paths::PathVertex;
use crate::render::surface_group::SurfaceGroup;
use crate::render::tiles::Tile;
use crate::simd::{LANES, Lanes};

/// Up to 16 surface points of one square of pixels.
pub(super) struct Patch {
    /// The points' places among the tile's vertices.
    pub vertices: Range<usize>,
    /// The points.
    pub group: SurfaceGroup,
    /// Number of the square in the tile.
    pub square: u8,
    /// The points that stand for all.
    pub corners: LaneMask,
    /// I of each point, by channel.
    pub light: [Lanes; 3],
}

impl Patch {
    /// Cuts the vertices of a tile into patches.
    #[inline(always)]
    pub fn cut(tile: &Tile, vertices: &[PathVertex]) -> Vec<Self> {
        let mut patches = Vec::with_capacity(vertices.len().div_ceil(LANES));
        let mut first = 0;
        while let Some(vertex) = vertices.get(first) {
            let square = tile.square_of(vertex.pixel);
            let longest = vertices.len().min(first + LANES);
            let same = |vertex: &&PathVertex| tile.square_of(vertex.pixel) == square;
            let last = first + vertices[first..longest].iter().take_while(same).count();
            let points = &vertices[first..last];
            let corners = corners(tile, points);
            let light = [[0.0; LANES]; 3];
            let group = SurfaceGroup::new(points);
            patches.push(Self { vertices: first..last, group, square, corners, light });
            first = last;
        }
        patches
    }

    /// Adds the light of one source, which sends `intensity` times `factors` to the points.
    #[inline(always)]
    pub fn add_light(&mut self, intensity: [f32; 3], factors: &Lanes) {
        for (sum, intensity) in self.light.iter_mut().zip(intensity) {
            for lane in 0..LANES {
                sum[lane] += intensity * factors[lane];
            }
        }
    }

    /// Adds the light of a source to some points, or takes it away: `sign` is 1 or -1.
    #[inline(always)]
    pub fn add_to(&mut self, points: LaneMask, sign: f32, lights: &PackedLights, index: usize, light: usize) {
        let mut factors = lights.factors(index, light, &self.group.points);
        for lane in 0..LANES {
            factors[lane] *= if points >> lane & 1 == 1 { sign } else { 0.0 };
        }
        self.add_light(lights.intensity(index, light), &factors);
    }

    /// One bit for the square.
    #[inline(always)]
    pub fn square_bit(&self) -> u64 {
        1 << self.square
    }
}

/// Least cosine between the normals of a smooth part.
const SMOOTH_COSINE: f32 = 0.9;
/// Greatest distance of a point of a smooth part from the plane of another, over the distance between the two.
const SMOOTH_HEIGHT: f32 = 0.2;
/// Smooth parts that a patch may have: more are no surfaces, but a crowd of small things.
const MOST_PARTS: usize = 2;

/// The points that stand for all of a patch.
///
/// If the points lie on one smooth surface, or at the edge of one before another, they are the corners of each, some of which
/// a straight shadow edge through the patch separates from others. Else they are all.
fn corners(tile: &Tile, points: &[PathVertex]) -> LaneMask {
    let mut remaining = ((1u32 << points.len()) - 1) as LaneMask;
    let mut corners = 0;
    for _ in 0..MOST_PARTS {
        let Some(first) = points.get(remaining.trailing_zeros() as usize) else { break };
        let (normal, origin) = (first.surface.geometric_normal, first.surface.position);
        let mut part = 0;
        for (lane, vertex) in points.iter().enumerate() {
            let to: Vec3 = vertex.surface.position - origin;
            let is_smooth = normal.dot(vertex.surface.geometric_normal) >= SMOOTH_COSINE
                && normal.dot(to).abs() <= SMOOTH_HEIGHT * to.length();
            part |= LaneMask::from(is_smooth) << lane;
        }
        part &= remaining;
        remaining &= !part;
        corners |= corners_of(tile, points, part);
    }
    corners | remaining
}

/// The points at the corners of a part: by the pixel, those that are farthest in each of the four diagonal directions.
fn corners_of(tile: &Tile, points: &[PathVertex], part: LaneMask) -> LaneMask {
    let mut farthest = [(i32::MIN, 0); 4];
    for (lane, vertex) in points.iter().enumerate().filter(|(lane, _)| part >> lane & 1 == 1) {
        let (x, y) = ((vertex.pixel % tile.width) as i32, (vertex.pixel / tile.width) as i32);
        for (best, along) in farthest.iter_mut().zip([x + y, x - y, y - x, -x - y]) {
            if along > best.0 {
                *best = (along, 1 << lane);
            }
        }
    }
    farthest.iter().fold(0, |corners, (_, corner)| corners | corner)
}
