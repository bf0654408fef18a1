//! Neighbouring surface points that mostly see the same lights.

use std::ops::Range;

use glam::Vec3;

use crate::accel::LaneMask;
use crate::render::surface_group::SurfaceGroup;
use crate::render::tiles::Tile;
use crate::render::trace::PathVertex;
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

    /// One bit for the square.
    #[inline(always)]
    pub fn square_bit(&self) -> u64 {
        1 << self.square
    }
}

/// Least cosine between normals of a smooth patch.
const SMOOTH_COSINE: f32 = 0.9;
/// Greatest distance of its points from a plane, over its extent.
const SMOOTH_HEIGHT: f32 = 0.2;

/// The points that stand for all of a patch.
///
/// If the points lie on one smooth surface they are the corners of the square, some of which a straight shadow edge through the
/// patch separates from others. Else they are every other point, as on a chessboard.
fn corners(tile: &Tile, points: &[PathVertex]) -> LaneMask {
    let Some(first) = points.first() else { return 0 };
    let (normal, origin) = (first.surface.geometric_normal, first.surface.position);
    let (mut extent, mut height, mut cosine) = (0.0f32, 0.0f32, 1.0f32);
    for vertex in points {
        let to: Vec3 = vertex.surface.position - origin;
        extent = extent.max(to.length_squared());
        height = height.max(normal.dot(to).abs());
        cosine = cosine.min(normal.dot(vertex.surface.geometric_normal));
    }
    if cosine < SMOOTH_COSINE || height > SMOOTH_HEIGHT * extent.sqrt() {
        let mut lanes = 0;
        for (lane, vertex) in points.iter().enumerate() {
            let is_black = (vertex.pixel % tile.width + vertex.pixel / tile.width).is_multiple_of(2);
            lanes |= LaneMask::from(is_black) << lane;
        }
        return lanes;
    }
    // By the pixel: of those that are farthest in each of the four diagonal directions the first.
    let farthest = |sx: i32, sy: i32| {
        let along = |vertex: &PathVertex| {
            let (x, y) = (vertex.pixel % tile.width, vertex.pixel / tile.width);
            sx * x as i32 + sy * y as i32
        };
        let mut best = 0;
        for lane in 1..points.len() {
            if along(&points[lane]) > along(&points[best]) {
                best = lane;
            }
        }
        1 << best
    };
    farthest(-1, -1) | farthest(1, 1) | farthest(1, -1) | farthest(-1, 1)
}
