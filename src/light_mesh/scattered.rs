//! Mesh points from a list: any positions, found through a grid of cells.

use std::collections::HashMap;

use glam::{I64Vec3, Vec3};

use super::neighbours::{Ball, Neighbours};
use super::tiled::Nearest;
use crate::scene::Bounds;

/// Mesh points at given positions (spec §8), for neighbourhoods of one radius.
#[derive(Clone, Debug)]
pub struct ScatteredPoints {
    origin: Vec3,
    inverse_cell: f32,
    /// Positions, sorted by cell.
    points: Vec<Vec3>,
    /// Range of points of each cell that has any.
    cells: HashMap<I64Vec3, (u32, u32)>,
    first: I64Vec3,
    last: I64Vec3,
}

impl ScatteredPoints {
    /// Takes the positions (at least one, finite) for balls of radius `radius`.
    pub fn new(positions: &[Vec3], radius: f32) -> Self {
        let mut bounds = Bounds::EMPTY;
        positions.iter().for_each(|&p| bounds.extend(p));
        // Cells of R's size make a ball touch 27; not so small that their numbers overflow.
        let smallest = bounds.extent().max_element() * 1e-6;
        let inverse_cell = 1.0 / radius.max(smallest).max(f32::MIN_POSITIVE);
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

    /// Number of bricks of 64 points.
    pub fn brick_count(&self) -> u64 {
        self.len().div_ceil(64)
    }

    /// Position of a point.
    pub fn position(&self, id: u64) -> Vec3 {
        self.points[id as usize]
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

    /// The points of the ball, in a fixed order.
    #[inline(always)]
    pub fn gather(&self, ball: &Ball, out: &mut Neighbours) {
        let first = ((ball.center - ball.radius - self.origin) * self.inverse_cell).floor().as_i64vec3();
        let last = ((ball.center + ball.radius - self.origin) * self.inverse_cell).floor().as_i64vec3();
        self.for_each_in_cells(first, last, |id, position| {
            if let Some(weight) = ball.weight(position) {
                out.push(id, weight);
            }
        });
    }

    /// The point nearest to the ball's centre among those that its half-space admits, or among all if it admits none.
    ///
    /// Looks at all points: a neighbourhood without any is an exception.
    pub fn nearest(&self, ball: &Ball) -> u64 {
        let mut nearest = Nearest::default();
        for (id, &position) in self.points.iter().enumerate() {
            nearest.offer(ball, id as u64, position);
        }
        nearest.id()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::random::SplitMix64;
    use std::collections::HashSet;

    /// The ball's points are those that a search through all finds, far outside of the list's bounds too.
    #[test]
    fn gather_equals_exhaustive_search() {
        let mut random = SplitMix64::new(3);
        let positions: Vec<Vec3> = (0..3000)
            .map(|_| (random.in_box(Vec3::ZERO, Vec3::ONE) - 0.5) * Vec3::new(40.0, 3.0, 9.0))
            .collect();
        let set = ScatteredPoints::new(&positions, 0.7);
        for _ in 0..200 {
            let center = (random.in_box(Vec3::ZERO, Vec3::ONE) - 0.5) * Vec3::new(44.0, 4.0, 10.0);
            let ball = Ball::new(center, Some(Vec3::Z), 0.7, false);
            let mut found = Neighbours::default();
            set.gather(&ball, &mut found);
            let found: HashSet<u64> = found.ids().iter().copied().collect();
            let expected: HashSet<u64> =
                (0..set.len()).filter(|&id| ball.weight(set.position(id)).is_some()).collect();
            assert_eq!(found, expected);
        }
    }
}
