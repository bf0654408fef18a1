//! Where in an image parts of triangles are thin.

use std::sync::atomic::{AtomicU32, Ordering};

use glam::{Affine3A, Mat3A, Vec2, Vec3A};
use rayon::prelude::*;

use super::SMALL;
use crate::Bounds;
use crate::scene::{CameraRays, Scene, TriangleMesh};

/// Triangles per pixel from which on all of an instance counts as thin: it would be, and to find that out takes time.
const DENSE: u64 = 4;

/// What lies nearer to the eye's plane than this share of a triangle's depth is cut off.
const NEAR: f32 = 1e-4;

/// Triangles that a thread takes at a time.
const CHUNK: usize = 4096;

/// Rounding of positions in the image, pixels.
const MARGIN: f32 = 0.1;

/// How near the parts of triangles are that samples may pass between, by squares of [`SMALL`] × [`SMALL`] pixels: those that are narrower, as they are seen, than the gap
/// between the samples, the tips of all corners included, and triangles with an alpha mask.
pub struct ThinParts {
    /// Columns and rows of squares.
    size: (u32, u32),
    /// The least depth of those that lie in each square, row by row; infinite where there are none. Empty if they may be everywhere.
    depths: Vec<f32>,
}

impl ThinParts {
    /// For several gaps; `bounds` is the box around a square's samples, a gap the widest strip that samples leave free, in pixels.
    pub fn find<const GAPS: usize>(
        scene: &Scene,
        camera: &CameraRays,
        resolution: (u32, u32),
        bounds: [Vec2; 2],
        gaps: [f32; GAPS],
    ) -> [Self; GAPS] {
        let size = (resolution.0.div_ceil(SMALL), resolution.1.div_ceil(SMALL));
        let marks = Marks::new(size, bounds, gaps);
        let boxes: Vec<Bounds> = scene.meshes.par_iter().map(|mesh| mesh.bounds()).collect();
        let (from_eye, eye) = (camera.to_image(), camera.origin().into());
        let mut left = DENSE * u64::from(resolution.0) * u64::from(resolution.1);
        let mut instances: Vec<(&TriangleMesh, ToImage)> = Vec::new();
        for instance in &scene.instances {
            let Some((mesh, bounds)) =
                scene.meshes.get(instance.mesh as usize).zip(boxes.get(instance.mesh as usize))
            else {
                continue;
            };
            let to_image = ToImage { to_world: instance.to_world, eye, from_eye };
            let Some((seen, depth)) = marks.seen_box(bounds, &to_image) else { continue };
            let triangles = mesh.triangles.len() as u64;
            if triangles > DENSE * pixels_of(&seen) {
                marks.levels.iter().for_each(|(_, depths)| marks.mark_squares(depths, seen, depth));
                continue;
            }
            match left.checked_sub(triangles) {
                Some(rest) => left = rest,
                None => return [(); GAPS].map(|()| Self { size, depths: Vec::new() }),
            }
            instances.push((mesh, to_image));
        }
        instances.par_iter().for_each(|(mesh, to_image)| {
            let positions = mesh.positions.as_slice();
            mesh.triangles.par_chunks(CHUNK).enumerate().for_each(|(chunk, triangles)| {
                for (triangle, corners) in (chunk * CHUNK..).zip(triangles) {
                    let corners = corners.map(|corner| to_image.of(positions[corner as usize].into()));
                    marks.add(corners, scene.alpha_mask(mesh, triangle as u32).is_some());
                }
            });
        });
        marks.levels.map(|(_, depths)| {
            let depths = depths.into_iter().map(|depth| f32::from_bits(depth.into_inner())).collect();
            Self { size, depths }
        })
    }

    /// The least depth of what is thin in a square, given by column and row.
    #[inline(always)]
    pub fn depth(&self, column: u32, row: u32) -> f32 {
        let square = row as usize * self.size.0 as usize + column as usize;
        self.depths.get(square).copied().unwrap_or(0.0)
    }
}

/// Columns and rows of squares, the last ones included.
type SquareRange = [[u32; 2]; 2];

/// Pixels of a range.
fn pixels_of([columns, rows]: &SquareRange) -> u64 {
    let length = |[first, last]: &[u32; 2]| u64::from(last - first + 1) * u64::from(SMALL);
    length(columns) * length(rows)
}

/// Maps an instance's corners to what [`CameraRays::to_image`] gives. The eye is taken off before anything is scaled: far from the origin, rounding would move what is seen by pixels.
struct ToImage {
    to_world: Option<Affine3A>,
    eye: Vec3A,
    from_eye: Mat3A,
}

impl ToImage {
    #[inline(always)]
    fn of(&self, corner: Vec3A) -> Vec3A {
        let corner = self.to_world.map_or(corner, |to_world| to_world.transform_point3a(corner));
        self.from_eye * (corner - self.eye)
    }
}

/// A corner as it is seen: where in the image, and at what depth.
#[derive(Clone, Copy)]
struct SeenCorner {
    at: Vec2,
    depth: f32,
}

impl SeenCorner {
    /// Of what has a depth above 0; a position that [`CameraRays::to_image`] gives.
    #[inline(always)]
    fn new(point: Vec3A) -> Self {
        Self { at: Vec2::new(point.x, point.y) / point.z, depth: point.z }
    }

    /// The point of the way to another that is seen after this part of it.
    #[inline(always)]
    fn towards(self, other: Self, part: f32) -> Self {
        let inverse = (1.0 - part) / self.depth + part / other.depth;
        Self { at: self.at.lerp(other.at, part), depth: 1.0 / inverse }
    }
}

/// The squares, while they are marked; many threads at once, since the least depth doesn't depend on their order.
struct Marks<const LEVELS: usize> {
    size: (u32, u32),
    /// The box around the samples of the first square.
    bounds: [Vec2; 2],
    /// The width below which something is thin, and the depths as bits: those of numbers that aren't negative are in the same order.
    levels: [(f32, Vec<AtomicU32>); LEVELS],
}

impl<const LEVELS: usize> Marks<LEVELS> {
    fn new(size: (u32, u32), [low, high]: [Vec2; 2], gaps: [f32; LEVELS]) -> Self {
        let squares = size.0 as usize * size.1 as usize;
        let none = || (0..squares).map(|_| AtomicU32::new(f32::INFINITY.to_bits())).collect();
        let levels = gaps.map(|gap| (gap + MARGIN, none()));
        Self { size, bounds: [low - MARGIN, high + MARGIN], levels }
    }

    /// The squares whose boxes meet what lies from `low` to `high` along an axis.
    #[inline(always)]
    fn range(&self, axis: usize, low: f32, high: f32) -> Option<[u32; 2]> {
        let count = if axis == 0 { self.size.0 } else { self.size.1 };
        let square = SMALL as f32;
        let first = ((low - self.bounds[1][axis]) / square).ceil().max(0.0);
        let last = ((high - self.bounds[0][axis]) / square).floor().min(count as f32 - 1.0);
        // What is no number may be anywhere: both functions take the other argument.
        (first <= last).then_some([first as u32, last as u32])
    }

    /// The squares that a box may be seen in, and its least depth.
    fn seen_box(&self, bounds: &Bounds, to_image: &ToImage) -> Option<(SquareRange, f32)> {
        let corner = |number: usize| {
            let end = |axis: usize| if number >> axis & 1 == 0 { bounds.min[axis] } else { bounds.max[axis] };
            to_image.of(Vec3A::new(end(0), end(1), end(2)))
        };
        let corners: [Vec3A; 8] = std::array::from_fn(corner);
        let farthest = corners.iter().fold(0.0f32, |far, corner| far.max(corner.z));
        if farthest <= 0.0 {
            return None;
        }
        if !corners.iter().all(|corner| corner.z > NEAR * farthest) {
            return Some(([[0, self.size.0 - 1], [0, self.size.1 - 1]], 0.0));
        }
        let (mut low, mut high, mut depth) = (Vec2::INFINITY, Vec2::NEG_INFINITY, f32::INFINITY);
        for corner in corners.map(SeenCorner::new) {
            (low, high, depth) = (low.min(corner.at), high.max(corner.at), depth.min(corner.depth));
        }
        Some(([self.range(0, low.x, high.x)?, self.range(1, low.y, high.y)?], depth))
    }

    /// Marks what is thin of a triangle, all of it if it is masked. Its corners are those that [`CameraRays::to_image`] gives.
    #[inline(always)]
    fn add(&self, corners: [Vec3A; 3], masked: bool) {
        let depths = corners.map(|corner| corner.z);
        let near = NEAR * depths[0].max(depths[1]).max(depths[2]);
        if depths.iter().all(|&depth| depth > near) {
            self.add_seen(corners.map(SeenCorner::new), masked);
        } else if near > 0.0 {
            self.add_cut(corners, near, masked);
        }
    }

    /// The same for one that reaches behind the eye.
    #[inline(never)]
    fn add_cut(&self, corners: [Vec3A; 3], near: f32, masked: bool) {
        let mut seen = [SeenCorner { at: Vec2::ZERO, depth: near }; 4];
        let mut count = 0;
        let mut keep = |corner: Vec3A| {
            seen[count] = SeenCorner::new(corner);
            count += 1;
        };
        for (from, to) in [(0, 1), (1, 2), (2, 0)].map(|(from, to)| (corners[from], corners[to])) {
            if from.z > near {
                keep(from);
            }
            if (from.z > near) != (to.z > near) {
                keep(from.lerp(to, (from.z - near) / (from.z - to.z)).with_z(near));
            }
        }
        let [a, b, c, d] = seen;
        if count >= 3 {
            self.add_seen([a, b, c], masked);
        }
        if count == 4 {
            self.add_seen([a, c, d], masked);
        }
    }

    #[inline(always)]
    fn add_seen(&self, corners: [SeenCorner; 3], masked: bool) {
        let [a, b, c] = corners.map(|corner| corner.at);
        let area = (b - a).perp_dot(c - a).abs();
        let longest = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a)).sqrt();
        for (width, depths) in &self.levels {
            // Its least height decides; what is no number is thin.
            let is_wide = area >= width * longest;
            if masked || !is_wide {
                self.mark(depths, corners);
                continue;
            }
            let [a, b, c] = corners;
            for (corner, to, other) in [(a, b, c), (b, c, a), (c, a, b)] {
                let (along, across) = (to.at - corner.at, other.at - corner.at);
                let lengths = [along.length(), across.length()];
                let sine = if along.dot(across) > 0.0 { area / (lengths[0] * lengths[1]) } else { 1.0 };
                // As far from the corner the other edge is one width away.
                let end =
                    |to: SeenCorner, length: f32| corner.towards(to, (width / (sine * length)).min(1.0));
                self.mark(depths, [corner, end(to, lengths[0]), end(other, lengths[1])]);
            }
        }
    }

    /// Marks the squares that a triangle in the image meets.
    #[inline(always)]
    fn mark(&self, depths: &[AtomicU32], corners: [SeenCorner; 3]) {
        let depth = corners[0].depth.min(corners[1].depth).min(corners[2].depth);
        let [a, b, c] = corners.map(|corner| corner.at);
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        let Some(columns) = self.range(0, low.x, high.x) else { return };
        let Some(rows) = self.range(1, low.y, high.y) else { return };
        if rows[1] - rows[0] <= 1 || columns[1] - columns[0] <= 1 {
            self.mark_squares(depths, [columns, rows], depth);
            return;
        }
        for row in rows[0]..=rows[1] {
            let square = (row * SMALL) as f32;
            let (top, bottom) = (square + self.bounds[0].y, square + self.bounds[1].y);
            let (mut left, mut right) = (f32::INFINITY, f32::NEG_INFINITY);
            for (from, to) in [(a, b), (b, c), (c, a)] {
                let (from, to) = if from.y <= to.y { (from, to) } else { (to, from) };
                if to.y < top || from.y > bottom {
                    continue;
                }
                for y in [top, bottom] {
                    let part = (y - from.y) / (to.y - from.y);
                    let x = if y <= from.y {
                        from.x
                    } else if y >= to.y {
                        to.x
                    } else {
                        from.x + (to.x - from.x) * part
                    };
                    (left, right) = (left.min(x), right.max(x));
                }
            }
            if let Some(columns) = self.range(0, left, right) {
                self.mark_squares(depths, [columns, [row, row]], depth);
            }
        }
    }

    #[inline(always)]
    fn mark_squares(&self, depths: &[AtomicU32], [columns, rows]: SquareRange, depth: f32) {
        let depth = depth.to_bits();
        for row in rows[0]..=rows[1] {
            let start = row as usize * self.size.0 as usize;
            for square in &depths[start + columns[0] as usize..=start + columns[1] as usize] {
                // Writing takes a cache line from the other threads.
                if square.load(Ordering::Relaxed) > depth {
                    square.fetch_min(depth, Ordering::Relaxed);
                }
            }
        }
    }
}
