//! Point sets that repeat: body-centred cubic, jittered and blue-noise (spec §8).
//!
//! A tile of 8×8×8 spacings holds 512 (body-centred: 1,024) points and repeats along the axes, so that a set of any extent
//! has arithmetic positions and lookups and takes no memory.

use glam::{I64Vec3, Vec3};

use super::neighbours::{Ball, Neighbours};
use crate::scene::Bounds;
use crate::scene::random::SplitMix64;

/// Edge of a tile in spacings.
const EDGE: i64 = 8;

/// Repeating tile of mesh points. Distances inside the tile are in spacings.
#[derive(Clone, Debug, PartialEq)]
pub struct TiledPoints {
    origin: Vec3,
    spacing: Vec3,
    inverse_spacing: Vec3,
    tiles: I64Vec3,
    /// Positions within the tile, sorted by cell along a Morton curve: 64 in a row are neighbours.
    points: Vec<Vec3>,
    /// First point of each cell (x fastest), by the cell's own number; one more at the end of the curve.
    cells: Vec<(u32, u32)>,
}

/// How the points of a tile are laid out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TileLayout {
    /// Corners and centres of cubes of one spacing: two points per cube.
    BodyCentred,
    /// One point anywhere in each cube of one spacing.
    Jittered,
    /// As many points as cubes, none closer to another than need be.
    BlueNoise,
}

impl TiledPoints {
    /// Points over `bounds` enlarged by `radius`.
    pub fn new(bounds: Bounds, spacing: Vec3, radius: f32, layout: TileLayout, seed: u64) -> Self {
        let bounds = if bounds.is_empty() { Bounds { min: Vec3::ZERO, max: Vec3::ZERO } } else { bounds };
        let margin = (Vec3::splat(radius) / spacing).ceil().max(Vec3::ONE) + 1.0;
        let origin = bounds.min - margin * spacing;
        let cells = ((bounds.max - origin) / spacing + margin).ceil();
        let tiles = (cells / EDGE as f32).ceil().as_i64vec3().max(I64Vec3::ONE);
        let mut random = SplitMix64::new(seed);
        let mut points = match layout {
            TileLayout::BodyCentred => body_centred(),
            TileLayout::Jittered => jittered(&mut random),
            TileLayout::BlueNoise => blue_noise(&mut random),
        };
        points.sort_by_key(|p| morton(p.as_i64vec3()));
        let cells = (0..EDGE * EDGE * EDGE)
            .map(|cell| {
                let code = morton(I64Vec3::new(cell % EDGE, cell / EDGE % EDGE, cell / EDGE / EDGE));
                let begin = points.partition_point(|p| morton(p.as_i64vec3()) < code);
                let end = points.partition_point(|p| morton(p.as_i64vec3()) <= code);
                (begin as u32, end as u32)
            })
            .collect();
        Self { origin, spacing, inverse_spacing: spacing.recip(), tiles, points, cells }
    }

    /// Number of points.
    pub fn len(&self) -> u64 {
        (self.tiles.x * self.tiles.y * self.tiles.z) as u64 * self.points.len() as u64
    }

    /// Number of bricks of 64 points.
    pub fn brick_count(&self) -> u64 {
        self.len().div_ceil(64)
    }

    /// Position of a point.
    pub fn position(&self, id: u64) -> Vec3 {
        let tile = (id / self.points.len() as u64) as i64;
        let tile = I64Vec3::new(
            tile % self.tiles.x,
            tile / self.tiles.x % self.tiles.y,
            tile / self.tiles.x / self.tiles.y,
        );
        self.at(tile, self.points[(id % self.points.len() as u64) as usize])
    }

    #[inline(always)]
    fn at(&self, tile: I64Vec3, point: Vec3) -> Vec3 {
        self.origin + ((tile * EDGE).as_vec3() + point) * self.spacing
    }

    /// Calls `each(id, position)` for the points in the cells from `first` to `last`.
    #[inline(always)]
    fn for_each_in_cells(&self, first: I64Vec3, last: I64Vec3, mut each: impl FnMut(u64, Vec3)) {
        let first = first.max(I64Vec3::ZERO);
        let last = last.min(self.tiles * EDGE - 1);
        for z in first.z..=last.z {
            for y in first.y..=last.y {
                for x in first.x..=last.x {
                    let tile = I64Vec3::new(x / EDGE, y / EDGE, z / EDGE);
                    let cell = (z % EDGE * EDGE + y % EDGE) * EDGE + x % EDGE;
                    let base = (tile.z * self.tiles.y + tile.y) * self.tiles.x + tile.x;
                    let (begin, end) = self.cells[cell as usize];
                    for index in begin..end {
                        let id = base as u64 * self.points.len() as u64 + u64::from(index);
                        each(id, self.at(tile, self.points[index as usize]));
                    }
                }
            }
        }
    }

    /// Calls `each(id, position)` for all points of a box, and some beside it, in the order of [`gather`](Self::gather).
    pub fn for_each_in_box(&self, min: Vec3, max: Vec3, each: impl FnMut(u64, Vec3)) {
        let cell_of = |p: Vec3| ((p - self.origin) * self.inverse_spacing).floor().as_i64vec3();
        self.for_each_in_cells(cell_of(min), cell_of(max), each);
    }

    /// The points of the ball, in a fixed order.
    #[inline(always)]
    pub fn gather(&self, ball: &Ball, out: &mut Neighbours) {
        let first = ((ball.center - ball.radius - self.origin) * self.inverse_spacing).floor().as_i64vec3();
        let last = ((ball.center + ball.radius - self.origin) * self.inverse_spacing).floor().as_i64vec3();
        self.for_each_in_cells(first, last, |id, position| {
            if let Some(weight) = ball.weight(position) {
                out.push(id, weight);
            }
        });
    }

    /// The point nearest to the ball's centre among those that its half-space admits, or among all if it admits none
    /// nearby.
    pub fn nearest(&self, ball: &Ball) -> u64 {
        let middle = ((ball.center - self.origin) * self.inverse_spacing).floor().as_i64vec3();
        let mut nearest = Nearest::default();
        // No sphere of three spacings is empty in any of the layouts, in whatever half of it.
        self.for_each_in_cells(middle - 3, middle + 3, |id, position| nearest.offer(ball, id, position));
        nearest.id()
    }
}

/// Search for the nearest point; ties go to the one offered first.
pub(super) struct Nearest {
    any: (f32, u64),
    admitted: (f32, u64),
}

impl Default for Nearest {
    fn default() -> Self {
        Self { any: (f32::INFINITY, 0), admitted: (f32::INFINITY, 0) }
    }
}

impl Nearest {
    pub(super) fn offer(&mut self, ball: &Ball, id: u64, position: Vec3) {
        let distance = position.distance_squared(ball.center);
        if distance < self.any.0 {
            self.any = (distance, id);
        }
        if distance < self.admitted.0 && ball.admits(position) {
            self.admitted = (distance, id);
        }
    }

    pub(super) fn id(&self) -> u64 {
        if self.admitted.0.is_finite() { self.admitted.1 } else { self.any.1 }
    }
}

fn morton(cell: I64Vec3) -> u32 {
    let cell = cell.clamp(I64Vec3::ZERO, I64Vec3::splat(EDGE - 1));
    let spread = |v: i64| (0..3).fold(0, |code, bit| code | ((v as u32) >> bit & 1) << (3 * bit));
    spread(cell.x) | spread(cell.y) << 1 | spread(cell.z) << 2
}

fn cells() -> impl Iterator<Item = Vec3> {
    (0..EDGE * EDGE * EDGE).map(|i| I64Vec3::new(i % EDGE, i / EDGE % EDGE, i / EDGE / EDGE).as_vec3())
}

/// Off the corner by an odd fraction, since surfaces lie at round ones (see the regular grid).
fn body_centred() -> Vec<Vec3> {
    const PHASE: f32 = 0.222_136;
    cells().flat_map(|cell| [cell + PHASE, cell + (PHASE + 0.5)]).collect()
}

fn jittered(random: &mut SplitMix64) -> Vec<Vec3> {
    cells().map(|cell| cell + random.in_box(Vec3::ZERO, Vec3::ONE)).collect()
}

/// Mitchell's best candidate on the torus: each point is the one of several random ones that is farthest from the
/// points before it.
fn blue_noise(random: &mut SplitMix64) -> Vec<Vec3> {
    const CANDIDATES: usize = 48;
    let period = EDGE as f32;
    let count = (EDGE * EDGE * EDGE) as usize;
    let mut points: Vec<Vec3> = Vec::with_capacity(count);
    while points.len() < count {
        let mut best = (-1.0, Vec3::ZERO);
        for _ in 0..CANDIDATES {
            let candidate =
                (random.in_box(Vec3::ZERO, Vec3::ONE) * period).min(Vec3::splat(period.next_down()));
            let distance = points.iter().fold(f32::INFINITY, |nearest, p| {
                let d = (candidate - *p).abs();
                nearest.min(d.min(period - d).length_squared())
            });
            if distance > best.0 {
                best = (distance, candidate);
            }
        }
        points.push(best.1);
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    const BOUNDS: Bounds = Bounds { min: Vec3::new(-1.0, 0.0, 2.0), max: Vec3::new(3.0, 2.5, 4.0) };

    /// Lookup finds what a search through all points finds, in every layout.
    #[test]
    fn lookups_equal_exhaustive_search() {
        for layout in [TileLayout::BodyCentred, TileLayout::Jittered, TileLayout::BlueNoise] {
            let set = TiledPoints::new(BOUNDS, Vec3::new(0.5, 0.25, 0.4), 1.0, layout, 7);
            for (center, normal) in [
                (Vec3::new(0.3, 1.1, 2.9), Vec3::Y),
                (Vec3::new(-1.0, 0.0, 2.0), Vec3::Y),
                (Vec3::new(2.9, 2.4, 3.9), Vec3::new(0.6, -0.8, 0.0)),
            ] {
                let ball = Ball::new(center, Some(normal), 1.0, true);
                let mut found = Neighbours::default();
                set.gather(&ball, &mut found);
                let found: HashSet<u64> = found.ids().iter().copied().collect();
                let expected: HashSet<u64> =
                    (0..set.len()).filter(|&id| ball.weight(set.position(id)).is_some()).collect();
                assert!(!found.is_empty());
                assert_eq!(found, expected, "{layout:?}");
                let nearest = (0..set.len())
                    .filter(|&id| ball.admits(set.position(id)))
                    .map(|id| set.position(id).distance(center))
                    .fold(f32::INFINITY, f32::min);
                assert_eq!(set.position(set.nearest(&ball)).distance(center), nearest, "{layout:?}");
            }
        }
    }

    /// Blue noise keeps its points apart: the closest pair, also across the tile's border, is farther than random points'
    /// (which for 512 points is below 0.1 spacings).
    #[test]
    fn blue_noise_keeps_its_distance() {
        let points = blue_noise(&mut SplitMix64::new(1));
        let period = EDGE as f32;
        for (i, a) in points.iter().enumerate() {
            for b in &points[..i] {
                let d = (*a - *b).abs();
                assert!(d.min(period - d).length() > 0.4);
            }
        }
    }
}
