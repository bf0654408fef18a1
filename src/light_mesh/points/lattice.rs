//! Regular point sets: positions by arithmetic, neighbours without a search (method §8).

use glam::{IVec3, Vec3};

use super::ids::{Blocks, within_range};
use super::kernel::Kernel;
use super::neighbours::{Nearest, Neighbours, ROW};
use super::rounded_box::{RoundedBox, numbers_in_row};
use crate::Bounds;

/// Bricks of 4×4×4 points.
const BRICKS: Blocks = Blocks::new(2);

/// Regular grid of mesh points without an end, grouped into bricks of 4×4×4.
///
/// Point ids run through the bricks: id = 64·brick + place within the brick, and 16 consecutive places
/// form a 4×2×2 block, so that a packet of neighbours by id is a packet of neighbours in space.
#[derive(Clone, Debug, PartialEq)]
pub struct Lattice {
    origin: Vec3,
    spacing: Vec3,
    inverse_spacing: Vec3,
}

/// The grid of a regular layer: its points lie at whole numbers of spacings from the origin, as single precision has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LayerGrid {
    /// One of its points.
    pub origin: Vec3,
    /// From one point to the next along each axis.
    pub spacing: Vec3,
}

/// The lowest bits of x, y and z in a point's id, see [`place`].
const PARITY: u64 = 0b1101;

/// Place of a cell within its brick.
#[inline(always)]
fn place(cell: IVec3) -> u64 {
    ((cell.x & 3) | (cell.y & 1) << 2 | (cell.z & 1) << 3 | (cell.y & 2) << 3 | (cell.z & 2) << 4) as u64
}

impl Lattice {
    /// Grid through `origin` with `spacing` per axis (> 0).
    pub fn new(origin: Vec3, spacing: Vec3) -> Self {
        Self { origin, spacing, inverse_spacing: spacing.recip() }
    }

    /// Where the points lie.
    pub fn grid(&self) -> LayerGrid {
        LayerGrid { origin: self.origin, spacing: self.spacing }
    }

    /// Whether a point is in the second of two halves of all points, each of whose six neighbours is in the other half: x + y + z is odd.
    pub fn is_in_second_half(id: u64) -> bool {
        (id & PARITY).count_ones() % 2 == 1
    }

    /// Position of a point.
    pub fn position(&self, id: u64) -> Vec3 {
        let place = (id % 64) as i32;
        let within =
            IVec3::new(place & 3, (place >> 2 & 1) + (place >> 3 & 2), (place >> 3 & 1) + (place >> 4 & 2));
        self.at(BRICKS.first_cell(id / 64) + within)
    }

    #[inline(always)]
    fn at(&self, cell: IVec3) -> Vec3 {
        self.origin + cell.as_vec3() * self.spacing
    }

    #[inline(always)]
    fn id(&self, cell: IVec3) -> u64 {
        BRICKS.of(cell) * 64 + place(cell)
    }

    /// The point that lies exactly at a position, if there is one.
    pub fn id_at(&self, position: Vec3) -> Option<u64> {
        let place = ((position - self.origin) * self.inverse_spacing).round();
        let (cell, last) = within_range(place, place);
        (cell == last && self.at(cell) == position).then(|| self.id(cell))
    }

    /// The corners of the cell that holds a position.
    pub fn corners(&self, position: Vec3) -> [u64; 8] {
        let place = ((position - self.origin) * self.inverse_spacing).floor();
        let (cell, _) = within_range(place, place);
        std::array::from_fn(|corner| {
            let corner = corner as i32;
            self.id(cell + IVec3::new(corner & 1, corner >> 1 & 1, corner >> 2))
        })
    }

    /// Number of points in a box.
    pub fn count_in(&self, bounds: Bounds) -> u64 {
        let first = ((bounds.min - self.origin) * self.inverse_spacing).ceil();
        let last = ((bounds.max - self.origin) * self.inverse_spacing).floor();
        let counts = (last - first + 1.0).max(Vec3::ZERO).as_dvec3();
        (counts.x * counts.y * counts.z) as u64
    }

    /// Calls `each(id, position)` for all points of a box, and perhaps some beside it, in the order of
    /// [`gather`](Self::gather).
    pub fn for_each_in_box(&self, min: Vec3, max: Vec3, mut each: impl FnMut(u64, Vec3)) {
        let place_of = |p: Vec3| ((p - self.origin) * self.inverse_spacing).floor();
        let (first, last) = within_range(place_of(min), place_of(max));
        for z in first.z..=last.z {
            for y in first.y..=last.y {
                for x in first.x..=last.x {
                    let cell = IVec3::new(x, y, z);
                    each(self.id(cell), self.at(cell));
                }
            }
        }
    }

    /// Calls `each(id, position)` for the points in a rounded box, in the order of [`gather`](Self::gather).
    #[inline(always)]
    pub fn for_each_near(&self, near: &RoundedBox, mut each: impl FnMut(u64, Vec3)) {
        let (min, max) = near.corners();
        let place_of = |p: Vec3| ((p - self.origin) * self.inverse_spacing).floor();
        let (first, last) = within_range(place_of(min), place_of(max));
        for z in first.z..=last.z {
            for y in first.y..=last.y {
                let begin = self.at(IVec3::new(first.x, y, z));
                let numbers = numbers_in_row(near.of_row(begin.y, begin.z), begin.x, self.inverse_spacing.x);
                for x in first.x + numbers.start..(first.x + numbers.end).min(last.x + 1) {
                    let cell = IVec3::new(x, y, z);
                    each(self.id(cell), self.at(cell));
                }
            }
        }
    }

    /// The points of the kernel, in ascending order of z, y, x.
    #[inline(always)]
    pub fn gather(&self, kernel: &Kernel, out: &mut Neighbours) {
        let first = ((kernel.center - kernel.radius - self.origin) * self.inverse_spacing).ceil();
        let last = ((kernel.center + kernel.radius - self.origin) * self.inverse_spacing).floor();
        let (first, last) = within_range(first, last);
        let offset = |cell: i32, axis: usize| {
            (self.origin[axis] + cell as f32 * self.spacing[axis]) - kernel.center[axis]
        };
        for z in first.z..=last.z {
            let dz = offset(z, 2);
            for y in first.y..=last.y {
                let row = kernel.row(offset(y, 1), dz);
                if !kernel.reaches(row) {
                    continue;
                }
                let mut begin = first.x;
                while begin <= last.x {
                    let mut weights = [0.0; ROW];
                    for (i, weight) in weights.iter_mut().enumerate() {
                        *weight = kernel.weigh(offset(begin + i as i32, 0), row);
                    }
                    let count = ((last.x - begin) as usize + 1).min(ROW);
                    out.push_row(|i| self.id(IVec3::new(begin + i as i32, y, z)), &weights[..count]);
                    begin += ROW as i32;
                }
            }
        }
    }

    /// The point nearest to the kernel's centre among those that its half-space admits, or among all if it
    /// admits none nearby. Ties go to the lowest z, then y, then x.
    pub fn nearest(&self, kernel: &Kernel) -> u64 {
        let middle = ((kernel.center - self.origin) * self.inverse_spacing).floor();
        // The nearest point of a half-space through y lies at most one cell beyond the cell of y.
        let (first, last) = within_range(middle - 1.0, middle + 2.0);
        let mut nearest = Nearest::default();
        for z in first.z..=last.z {
            for y in first.y..=last.y {
                for x in first.x..=last.x {
                    let cell = IVec3::new(x, y, z);
                    nearest.offer(kernel, self.id(cell), self.at(cell));
                }
            }
        }
        nearest.id()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    fn lattice() -> Lattice {
        Lattice::new(Vec3::new(-0.9, 0.1, 2.2), Vec3::new(0.5, 0.25, 0.4))
    }

    /// All points of a box and around it.
    fn points(lattice: &Lattice) -> Vec<(u64, Vec3)> {
        let mut points = Vec::new();
        lattice.for_each_in_box(Vec3::new(-3.0, -2.0, 0.0), Vec3::new(5.0, 4.5, 6.0), |id, position| {
            points.push((id, position));
        });
        points
    }

    /// Ids and positions belong together: each leads to the other, and none occurs twice.
    #[test]
    fn every_id_has_its_own_position() {
        let lattice = lattice();
        let points = points(&lattice);
        for &(id, position) in &points {
            assert_eq!(lattice.position(id), position);
        }
        let ids: HashSet<u64> = points.iter().map(|&(id, _)| id).collect();
        assert_eq!(ids.len(), points.len());
        assert!(points.len() > 16 * 26 * 15);
    }

    /// Each half lies around every point of the other: neighbours along each axis are in different halves.
    #[test]
    fn halves_alternate_along_each_axis() {
        let lattice = lattice();
        for (id, position) in points(&lattice) {
            for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
                // Rounding may keep the neighbour from being exactly there, which a search forgives.
                let next = lattice.nearest(&Kernel::new(position + axis * lattice.spacing, None, 1.0, false));
                assert_ne!(Lattice::is_in_second_half(id), Lattice::is_in_second_half(next), "{position}");
            }
        }
    }

    /// The points of a spacing are among those of half of it, to the bit, when both have the same origin.
    #[test]
    fn lattices_of_half_the_spacing_contain_the_coarse_one() {
        let coarse = lattice();
        let fine = Lattice::new(coarse.origin, coarse.spacing * 0.5);
        for (id, position) in points(&coarse) {
            assert!(fine.id_at(position).is_some_and(|id| fine.position(id) == position), "{position}");
            assert_eq!(coarse.id_at(position), Some(id));
        }
        let within = |&(_, position): &(u64, Vec3)| coarse.id_at(position).is_some();
        let (all, shared) =
            (points(&fine).len(), points(&fine).iter().filter(|&point| within(point)).count());
        // One in eight, but for the faces of the box.
        assert!(shared * 7 < all && all < shared * 9, "{shared} of {all}");
    }

    /// The gathered points are those that a search through all points finds.
    #[test]
    fn gather_equals_exhaustive_search() {
        let lattice = lattice();
        for (center, normal) in [
            (Vec3::new(0.3, 1.1, 2.9), None),
            (Vec3::new(-1.0, 0.0, 2.0), Some(Vec3::Y)),
            (Vec3::new(2.9, 2.4, 3.9), Some(Vec3::new(0.6, -0.8, 0.0))),
        ] {
            let kernel = Kernel::new(center, normal, 1.0, false);
            let mut found = Neighbours::default();
            lattice.gather(&kernel, &mut found);
            let found: HashSet<u64> = found.ids().iter().copied().collect();
            let within = |position: Vec3| {
                let d = position - center;
                d.length_squared() < 1.0 && normal.is_none_or(|n| n.dot(d) >= 0.0)
            };
            let expected: HashSet<u64> =
                points(&lattice).into_iter().filter(|&(_, x)| within(x)).map(|(id, _)| id).collect();
            assert!(!found.is_empty());
            assert_eq!(found, expected);
        }
    }

    /// The nearest admitted point is what a search through all points finds.
    #[test]
    fn nearest_equals_exhaustive_search() {
        let lattice = lattice();
        for i in 0..50 {
            let t = i as f32 / 50.0;
            let center = Vec3::new(-1.0 + 4.0 * t, 2.5 * (t * 7.0).fract(), 2.0 + 2.0 * (t * 3.0).fract());
            let normal = Vec3::new((i as f32).sin(), (i as f32).cos(), 0.3).normalize();
            let kernel = Kernel::new(center, Some(normal), 1.0, false);
            let expected = points(&lattice)
                .into_iter()
                .filter(|&(_, x)| normal.dot(x - center) >= 0.0)
                .map(|(_, x)| x.distance_squared(center))
                .fold(f32::INFINITY, f32::min);
            let found = lattice.position(lattice.nearest(&kernel)).distance_squared(center);
            assert_eq!(found, expected, "centre {center}, normal {normal}");
        }
    }
}
