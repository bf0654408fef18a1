//! Point sets that repeat: body-centred cubic, jittered and blue-noise (method §8).
//!
//! A tile of 8×8×8 spacings holds 512 (body-centred: 1,024) points and repeats along the axes, so that a set of any extent
//! has arithmetic positions and lookups and takes no memory.

use std::ops::Range;

use glam::{IVec3, Vec3};

use super::ids::{Blocks, within_range};
use super::kernel::Kernel;
use super::lattice::LayerGrid;
use super::neighbours::{Nearest, Neighbours};
use super::rounded_box::{RoundedBox, numbers_in_row};
use crate::Bounds;
use crate::sampling::SplitMix64;

/// Edge of a tile in spacings.
const EDGE: i32 = 8;

/// Tiles are the blocks that ids are made of.
const TILES: Blocks = Blocks::new(EDGE.ilog2());

/// Ids of a tile: as many as the layout with the most points has.
const TILE_IDS: u64 = 2 * (EDGE * EDGE * EDGE) as u64;

/// Boxes reach this much further when it comes to cells, in spacings: rounding may put points at cells' faces beyond them.
const SLACK: f32 = 1.0 / 64.0;

/// Repeating tile of mesh points. Distances inside the tile are in spacings.
#[derive(Clone, Debug, PartialEq)]
pub struct PeriodicPoints {
    origin: Vec3,
    spacing: Vec3,
    inverse_spacing: Vec3,
    /// Positions within the tile, sorted by cell along a Morton curve: 64 in a row are neighbours.
    points: Vec<Vec3>,
    /// First point of each cell (x fastest), by the cell's own number; one more at the end of the curve.
    cells: Vec<(u32, u32)>,
    layout: PeriodicLayout,
}

/// One of the tiles in space.
struct Tile {
    number: u64,
    /// Its lowest cell.
    corner: IVec3,
}

impl Tile {
    /// Id of one of its points.
    #[inline(always)]
    fn id(&self, index: u32) -> u64 {
        self.number * TILE_IDS + u64::from(index)
    }
}

/// How the points of a tile are laid out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PeriodicLayout {
    /// Corners and centres of cells of one spacing: two points per cell.
    BodyCentred,
    /// One point anywhere in each cell of one spacing.
    Jittered,
    /// As many points as cells, none closer to another than need be.
    BlueNoise,
}

impl PeriodicPoints {
    /// Points with cells' corners at `origin` and every `spacing` (> 0, per axis) from there.
    pub fn new(origin: Vec3, spacing: Vec3, layout: PeriodicLayout, seed: u64) -> Self {
        let mut random = SplitMix64::new(seed);
        let mut points = match layout {
            PeriodicLayout::BodyCentred => body_centred(),
            PeriodicLayout::Jittered => jittered(&mut random),
            PeriodicLayout::BlueNoise => blue_noise(&mut random),
        };
        points.sort_by_key(|p| morton(p.as_ivec3()));
        let cells = (0..EDGE * EDGE * EDGE)
            .map(|cell| {
                let code = morton(IVec3::new(cell % EDGE, cell / EDGE % EDGE, cell / EDGE / EDGE));
                let begin = points.partition_point(|p| morton(p.as_ivec3()) < code);
                let end = points.partition_point(|p| morton(p.as_ivec3()) <= code);
                (begin as u32, end as u32)
            })
            .collect();
        Self { origin, spacing, inverse_spacing: spacing.recip(), points, cells, layout }
    }

    /// Whether a point is in the second of two halves of all points that lie among each other: corners and centres of cells, or the points of every other
    /// cell, or every other point along the curve.
    pub fn is_in_second_half(&self, id: u64) -> bool {
        let parity = match self.layout {
            // A cell's corner, then its centre; points along the curve.
            PeriodicLayout::BodyCentred | PeriodicLayout::BlueNoise => 0b1,
            // The lowest bits of x, y and z of the cell.
            PeriodicLayout::Jittered => 0b111,
        };
        (id & parity).count_ones() % 2 == 1
    }

    /// The grid of half the spacing, on which body-centred points lie.
    pub fn half_grid(&self) -> LayerGrid {
        LayerGrid { origin: self.origin, spacing: self.spacing * 0.5 }
    }

    /// The point that lies exactly at a position, if there is one.
    pub fn id_at(&self, position: Vec3) -> Option<u64> {
        let mut found = None;
        self.for_each_in_cells(self.cells_in(position, position), |id, x| {
            found = if x == position { Some(id) } else { found };
        });
        found
    }

    /// About how many points a box holds.
    pub fn count_in(&self, bounds: Bounds) -> u64 {
        let cells = (bounds.extent() * self.inverse_spacing).as_dvec3();
        let per_cell = self.points.len() as f64 / f64::from(EDGE * EDGE * EDGE);
        (cells.x * cells.y * cells.z * per_cell) as u64
    }

    /// Position of a point.
    pub fn position(&self, id: u64) -> Vec3 {
        let point = self.points.get((id % TILE_IDS) as usize).copied().unwrap_or_default();
        self.at(TILES.first_cell(id / TILE_IDS), point)
    }

    #[inline(always)]
    fn at(&self, first_cell: IVec3, point: Vec3) -> Vec3 {
        self.origin + (first_cell.as_vec3() + point) * self.spacing
    }

    /// Calls `each(id, position)` for the points in the cells from `first` to `last`.
    #[inline(always)]
    fn for_each_in_cells(&self, (first, last): (IVec3, IVec3), mut each: impl FnMut(u64, Vec3)) {
        for z in first.z..=last.z {
            for y in first.y..=last.y {
                self.for_each_of_row(first.x..last.x + 1, y, z, |_, tile, points| {
                    for index in points {
                        each(tile.id(index), self.at(tile.corner, self.points[index as usize]));
                    }
                });
            }
        }
    }

    /// Calls `each(x, tile, indices of points in it)` for the cells of a row.
    #[inline(always)]
    fn for_each_of_row(&self, xs: Range<i32>, y: i32, z: i32, mut each: impl FnMut(i32, &Tile, Range<u32>)) {
        let mut x = xs.start;
        while x < xs.end {
            // The cells of a row that lie in one tile: what the tile is, is found once for all of them.
            let number = TILES.of(IVec3::new(x, y, z));
            let tile = Tile { number, corner: TILES.first_cell(number) };
            let corner = tile.corner;
            let row = ((z - corner.z) * EDGE + y - corner.y) * EDGE;
            let end = xs.end.min(corner.x + EDGE);
            let cells = &self.cells[(row + x - corner.x) as usize..(row + end - corner.x) as usize];
            for (x, &(begin, end)) in (x..end).zip(cells) {
                each(x, &tile, begin..end);
            }
            x = end;
        }
    }

    /// The cells of a box.
    #[inline(always)]
    fn cells_in(&self, min: Vec3, max: Vec3) -> (IVec3, IVec3) {
        let place_of = |p: Vec3| (p - self.origin) * self.inverse_spacing;
        within_range((place_of(min) - SLACK).floor(), (place_of(max) + SLACK).floor())
    }

    /// Calls `each(id, position)` for all points of a box, and some beside it, in the order of [`gather`](Self::gather).
    #[inline(always)]
    pub fn for_each_in_box(&self, min: Vec3, max: Vec3, each: impl FnMut(u64, Vec3)) {
        self.for_each_in_cells(self.cells_in(min, max), each);
    }

    /// Calls `each(id, position)` for the points in a rounded box, in the order of [`gather`](Self::gather).
    #[inline(always)]
    pub fn for_each_near(&self, near: &RoundedBox, mut each: impl FnMut(u64, Vec3)) {
        let (min, max) = near.corners();
        if self.layout != PeriodicLayout::BodyCentred {
            return self.for_each_in_box(min, max, |id, position| {
                if near.holds(position) {
                    each(id, position);
                }
            });
        }
        // Both points of a cell begin a row of their own, and which points of a row are near is known without a look at each.
        let (first, last) = self.cells_in(min, max);
        for z in first.z..=last.z {
            for y in first.y..=last.y {
                let corner = self.at(IVec3::new(first.x, y, z), Vec3::ZERO);
                let center = corner + 0.5 * self.spacing;
                let corners =
                    numbers_in_row(near.of_row(corner.y, corner.z), corner.x, self.inverse_spacing.x);
                let centers =
                    numbers_in_row(near.of_row(center.y, center.z), center.x, self.inverse_spacing.x);
                let (begin, end) = (corners.start.min(centers.start), corners.end.max(centers.end));
                let cells = first.x + begin..(first.x + end).min(last.x + 1);
                self.for_each_of_row(cells, y, z, |x, tile, points| {
                    let mut point = |index: u32, numbers: &Range<i32>| {
                        if numbers.contains(&(x - first.x)) {
                            each(tile.id(index), self.at(tile.corner, self.points[index as usize]));
                        }
                    };
                    point(points.start, &corners);
                    point(points.start + 1, &centers);
                });
            }
        }
    }

    /// The points of the kernel, in a fixed order.
    #[inline(always)]
    pub fn gather(&self, kernel: &Kernel, out: &mut Neighbours) {
        let cells = self.cells_in(kernel.center - kernel.radius, kernel.center + kernel.radius);
        self.for_each_in_cells(cells, |id, position| {
            if let Some(weight) = kernel.weight(position) {
                out.push(id, weight);
            }
        });
    }

    /// The point nearest to the kernel's centre among those that its half-space admits, or among all if it admits none
    /// nearby.
    pub fn nearest(&self, kernel: &Kernel) -> u64 {
        let middle = ((kernel.center - self.origin) * self.inverse_spacing).floor();
        let mut nearest = Nearest::default();
        // No sphere of three spacings is empty in any of the layouts, in whatever half of it.
        let cells = within_range(middle - 3.0, middle + 3.0);
        self.for_each_in_cells(cells, |id, position| nearest.offer(kernel, id, position));
        nearest.id()
    }
}

fn morton(cell: IVec3) -> u32 {
    let cell = cell.clamp(IVec3::ZERO, IVec3::splat(EDGE - 1));
    let spread = |v: i32| (0..3).fold(0, |code, bit| code | ((v as u32) >> bit & 1) << (3 * bit));
    spread(cell.x) | spread(cell.y) << 1 | spread(cell.z) << 2
}

fn cells() -> impl Iterator<Item = Vec3> {
    (0..EDGE * EDGE * EDGE).map(|i| IVec3::new(i % EDGE, i / EDGE % EDGE, i / EDGE / EDGE).as_vec3())
}

/// The points of a spacing are among the corners of half of it.
fn body_centred() -> Vec<Vec3> {
    cells().flat_map(|cell| [cell, cell + 0.5]).collect()
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

    /// All points of a box and around it.
    fn points(set: &PeriodicPoints) -> Vec<(u64, Vec3)> {
        let mut points = Vec::new();
        set.for_each_in_box(Vec3::new(-3.0, -2.0, 0.0), Vec3::new(5.0, 4.5, 6.0), |id, position| {
            points.push((id, position));
        });
        points
    }

    /// Lookup finds what a search through all points finds, in every layout, and ids lead to their positions.
    #[test]
    fn lookups_equal_exhaustive_search() {
        for layout in [PeriodicLayout::BodyCentred, PeriodicLayout::Jittered, PeriodicLayout::BlueNoise] {
            let set = PeriodicPoints::new(Vec3::new(-0.9, 0.1, 2.2), Vec3::new(0.5, 0.25, 0.4), layout, 7);
            let points = points(&set);
            assert!(points.iter().all(|&(id, position)| set.position(id) == position));
            for (center, normal) in [
                (Vec3::new(0.3, 1.1, 2.9), Vec3::Y),
                (Vec3::new(-1.0, 0.0, 2.0), Vec3::Y),
                (Vec3::new(2.9, 2.4, 3.9), Vec3::new(0.6, -0.8, 0.0)),
            ] {
                let kernel = Kernel::new(center, Some(normal), 1.0, true);
                let mut found = Neighbours::default();
                set.gather(&kernel, &mut found);
                let found: HashSet<u64> = found.ids().iter().copied().collect();
                let inside = |&&(_, x): &&(u64, Vec3)| kernel.weight(x).is_some();
                let expected: HashSet<u64> = points.iter().filter(inside).map(|&(id, _)| id).collect();
                assert!(!found.is_empty());
                assert_eq!(found, expected, "{layout:?}");
                let admitted = points.iter().filter(|&&(_, x)| kernel.admits(x));
                let nearest = admitted.map(|&(_, x)| x.distance(center)).fold(f32::INFINITY, f32::min);
                assert_eq!(set.position(set.nearest(&kernel)).distance(center), nearest, "{layout:?}");
            }
        }
    }

    /// The body-centred points of a spacing are among those of half of it, to the bit, when both have the same origin.
    #[test]
    fn body_centred_points_of_half_the_spacing_contain_the_coarse_ones() {
        let (origin, spacing) = (Vec3::new(-0.9, 0.1, 2.2), Vec3::new(0.5, 0.25, 0.4));
        let set = |spacing| PeriodicPoints::new(origin, spacing, PeriodicLayout::BodyCentred, 0);
        let (coarse, fine) = (set(spacing), set(spacing * 0.5));
        for (_, position) in points(&coarse) {
            assert!(fine.id_at(position).is_some_and(|id| fine.position(id) == position), "{position}");
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
