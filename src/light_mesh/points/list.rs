//! Mesh points from a list: any positions, found through a grid of cells whose size follows from the points alone.

use std::collections::HashMap;

use glam::{I64Vec3, Vec3};

use super::kernel::Kernel;
use super::neighbours::{Nearest, Neighbours};
use super::rounded_box::RoundedBox;
use crate::Bounds;

/// Mean number of points per cell that the cells' size aims at.
const PER_CELL: f32 = 4.0;

/// Cells along an axis at most.
const MOST_CELLS: f32 = 1024.0;

/// Mesh points at given positions (method §8).
#[derive(Clone, Debug)]
pub struct PointList {
    origin: Vec3,
    inverse_cell: f32,
    /// Positions, sorted by cell.
    points: Vec<Vec3>,
    /// Range of points of each cell that has any.
    cells: HashMap<I64Vec3, (u32, u32)>,
    first: I64Vec3,
    last: I64Vec3,
}

impl PointList {
    /// Takes the positions (at least one, finite).
    pub fn new(positions: &[Vec3]) -> Self {
        let mut bounds = Bounds::EMPTY;
        positions.iter().for_each(|&p| bounds.extend(p));
        // Cells follow the points' density; of points in a plane or on a line, that along it.
        let extent = bounds.extent();
        let length = extent.max_element();
        let share = (extent / length.max(f32::MIN_POSITIVE)).max(Vec3::splat(1.0 / MOST_CELLS));
        let per_volume = positions.len() as f32 / (share.x * share.y * share.z * PER_CELL);
        let cells = per_volume.cbrt().clamp(1.0, MOST_CELLS);
        let inverse_cell = cells / length.max(f32::MIN_POSITIVE);
        let origin = if bounds.is_empty() { Vec3::ZERO } else { bounds.min };
        let cell_of = |p: Vec3| ((p - origin) * inverse_cell).floor().as_i64vec3();
        let mut points = positions.to_vec();
        points.sort_by_key(|&p| {
            let cell = cell_of(p);
            (cell.z, cell.y, cell.x)
        });
        let mut cells: HashMap<I64Vec3, (u32, u32)> = HashMap::new();
        for (index, &point) in points.iter().enumerate() {
            let entry = cells.entry(cell_of(point)).or_insert((index as u32, index as u32));
            entry.1 = index as u32 + 1;
        }
        let last = cell_of(bounds.max.max(origin));
        Self { origin, inverse_cell, points, cells, first: I64Vec3::ZERO, last }
    }

    /// Number of points.
    pub fn len(&self) -> u64 {
        self.points.len() as u64
    }

    /// Lists of points share none with other layouts.
    pub fn id_at(&self, _: Vec3) -> Option<u64> {
        None
    }

    /// Number of points in a box.
    pub fn count_in(&self, bounds: Bounds) -> u64 {
        self.points.iter().filter(|&&point| bounds.contains(point)).count() as u64
    }

    /// Position of a point.
    pub fn position(&self, id: u64) -> Vec3 {
        self.points.get(id as usize).copied().unwrap_or_default()
    }

    #[inline(always)]
    fn for_each_in_cells(&self, first: I64Vec3, last: I64Vec3, mut each: impl FnMut(u64, Vec3)) {
        let (first, last) = (first.max(self.first), last.min(self.last));
        for z in first.z..=last.z {
            for y in first.y..=last.y {
                for x in first.x..=last.x {
                    if let Some(&(begin, end)) = self.cells.get(&I64Vec3::new(x, y, z)) {
                        for index in begin..end {
                            each(u64::from(index), self.points[index as usize]);
                        }
                    }
                }
            }
        }
    }

    /// Calls `each(id, position)` for all points of a box, and some beside it, in the order of [`gather`](Self::gather).
    pub fn for_each_in_box(&self, min: Vec3, max: Vec3, each: impl FnMut(u64, Vec3)) {
        let cell_of = |p: Vec3| ((p - self.origin) * self.inverse_cell).floor().as_i64vec3();
        self.for_each_in_cells(cell_of(min), cell_of(max), each);
    }

    /// Calls `each(id, position)` for the points in a rounded box, in the order of [`gather`](Self::gather).
    #[inline(always)]
    pub fn for_each_near(&self, near: &RoundedBox, mut each: impl FnMut(u64, Vec3)) {
        let (min, max) = near.corners();
        self.for_each_in_box(min, max, |id, position| {
            if near.holds(position) {
                each(id, position);
            }
        });
    }

    /// The points of the kernel, in a fixed order.
    #[inline(always)]
    pub fn gather(&self, kernel: &Kernel, out: &mut Neighbours) {
        let first = ((kernel.center - kernel.radius - self.origin) * self.inverse_cell).floor().as_i64vec3();
        let last = ((kernel.center + kernel.radius - self.origin) * self.inverse_cell).floor().as_i64vec3();
        self.for_each_in_cells(first, last, |id, position| {
            if let Some(weight) = kernel.weight(position) {
                out.push(id, weight);
            }
        });
    }

    /// The point nearest to the kernel's centre among those that its half-space admits, or among all if it admits none.
    ///
    /// Looks at all points: a neighbourhood without any is an exception.
    pub fn nearest(&self, kernel: &Kernel) -> u64 {
        let mut nearest = Nearest::default();
        for (id, &position) in self.points.iter().enumerate() {
            nearest.offer(kernel, id as u64, position);
        }
        nearest.id()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::SplitMix64;
    use std::collections::HashSet;

    /// The kernel's points are those that a search through all finds, far outside of the list's bounds too.
    #[test]
    fn gather_equals_exhaustive_search() {
        let mut random = SplitMix64::new(3);
        let positions: Vec<Vec3> = (0..3000)
            .map(|_| (random.in_box(Vec3::ZERO, Vec3::ONE) - 0.5) * Vec3::new(40.0, 3.0, 9.0))
            .collect();
        let set = PointList::new(&positions);
        for _ in 0..200 {
            let center = (random.in_box(Vec3::ZERO, Vec3::ONE) - 0.5) * Vec3::new(44.0, 4.0, 10.0);
            let kernel = Kernel::new(center, Some(Vec3::Z), 0.7, false);
            let mut found = Neighbours::default();
            set.gather(&kernel, &mut found);
            let found: HashSet<u64> = found.ids().iter().copied().collect();
            let inside = |&id: &u64| kernel.weight(set.position(id)).is_some();
            let expected: HashSet<u64> = (0..set.points.len() as u64).filter(inside).collect();
            assert_eq!(found, expected);
        }
    }
}
