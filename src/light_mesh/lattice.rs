//! Regular point sets: positions by arithmetic, neighbours without a search (spec §8).

use glam::{I64Vec3, IVec3, Vec3};

use super::neighbours::{Ball, Neighbours, ROW};
use crate::scene::Bounds;

/// Mesh points per brick edge. Values are kept for whole bricks of 4×4×4 points or not at all.
const EDGE: i64 = 4;

/// Where in a spacing the first layer of points lies, measured from the lower corner of the bounds.
///
/// Just off one half: surfaces lie at the bounds' faces and at round fractions of the spacing far more
/// often than at this one, and a layer that lies in a surface would be evaluated inside it.
const PHASE: f32 = 0.472_136;

/// Regular grid of mesh points, grouped into bricks of 4×4×4.
///
/// Point ids run through the bricks: id = 64·brick + place within the brick, and 16 consecutive places
/// form a 4×2×2 block, so that a packet of neighbours by id is a packet of neighbours in space.
#[derive(Clone, Debug, PartialEq)]
pub struct Lattice {
    origin: Vec3,
    spacing: Vec3,
    inverse_spacing: Vec3,
    bricks: I64Vec3,
}

impl Lattice {
    /// Grid over `bounds` enlarged by `radius`, with `spacing` per axis (> 0).
    ///
    /// The grid is rounded up to whole bricks. Spacings so fine that coordinates could not be told apart
    /// are the caller's to refuse, see [`Lattice::too_fine`].
    pub fn new(bounds: Bounds, spacing: Vec3, radius: f32) -> Self {
        let bounds = if bounds.is_empty() { Bounds { min: Vec3::ZERO, max: Vec3::ZERO } } else { bounds };
        // One layer beyond R at least: the nearest point in front of a surface must exist.
        let margin = (Vec3::splat(radius) / spacing).ceil().max(Vec3::ONE) + (1.0 - PHASE);
        let origin = bounds.min - margin * spacing;
        let points = ((bounds.max - origin) / spacing + margin).ceil();
        let bricks = (points / EDGE as f32).ceil().as_i64vec3().max(I64Vec3::ONE);
        Self { origin, spacing, inverse_spacing: spacing.recip(), bricks }
    }

    /// Whether a spacing is too fine for single-precision coordinates over `bounds`: fewer than 16
    /// representable numbers between neighbouring points, or more points than ids.
    pub fn too_fine(bounds: Bounds, spacing: Vec3) -> bool {
        let largest = bounds.min.abs().max(bounds.max.abs());
        let points = (bounds.extent() / spacing).as_dvec3() + 16.0;
        !bounds.is_empty()
            && ((largest * (16.0 * f32::EPSILON)).cmpgt(spacing).any()
                || points.x * points.y * points.z > 2f64.powi(60))
    }

    /// Number of points.
    pub fn len(&self) -> u64 {
        self.brick_count() * 64
    }

    /// Number of bricks.
    pub fn brick_count(&self) -> u64 {
        (self.bricks.x * self.bricks.y * self.bricks.z) as u64
    }

    /// Position of a point.
    pub fn position(&self, id: u64) -> Vec3 {
        let brick = (id / 64) as i64;
        let x = brick % self.bricks.x;
        let y = brick / self.bricks.x % self.bricks.y;
        let z = brick / self.bricks.x / self.bricks.y;
        let place = (id % 64) as i64;
        let cell = I64Vec3::new(
            EDGE * x + (place & 3),
            EDGE * y + (place >> 2 & 1) + (place >> 3 & 2),
            EDGE * z + (place >> 3 & 1) + (place >> 4 & 2),
        );
        self.at(cell)
    }

    #[inline(always)]
    fn at(&self, cell: I64Vec3) -> Vec3 {
        self.origin + cell.as_vec3() * self.spacing
    }

    #[inline(always)]
    fn id(&self, cell: I64Vec3) -> u64 {
        let brick = ((cell.z >> 2) * self.bricks.y + (cell.y >> 2)) * self.bricks.x + (cell.x >> 2);
        let place =
            (cell.x & 3) | (cell.y & 1) << 2 | (cell.z & 1) << 3 | (cell.y & 2) << 3 | (cell.z & 2) << 4;
        (brick * 64 + place) as u64
    }

    /// Calls `each(id, position)` for all points of a box, and perhaps some beside it, in the order of
    /// [`gather`](Self::gather).
    pub fn for_each_in_box(&self, min: Vec3, max: Vec3, mut each: impl FnMut(u64, Vec3)) {
        let last_cell = self.bricks * EDGE - 1;
        let cell_of = |p: Vec3| ((p - self.origin) * self.inverse_spacing).floor().as_i64vec3();
        let (first, last) = (cell_of(min).max(I64Vec3::ZERO), cell_of(max).min(last_cell));
        for z in first.z..=last.z {
            for y in first.y..=last.y {
                for x in first.x..=last.x {
                    let cell = I64Vec3::new(x, y, z);
                    each(self.id(cell), self.at(cell));
                }
            }
        }
    }

    /// The points of the ball, in ascending order of z, y, x.
    #[inline(always)]
    pub fn gather(&self, ball: &Ball, out: &mut Neighbours) {
        // Cells fit 32 bits, since coordinates tell neighbouring points apart.
        let last_cell = (self.bricks * EDGE - 1).as_ivec3();
        let first = ((ball.center - ball.radius - self.origin) * self.inverse_spacing).ceil().as_ivec3();
        let last = ((ball.center + ball.radius - self.origin) * self.inverse_spacing).floor().as_ivec3();
        let (first, last) = (first.max(IVec3::ZERO), last.min(last_cell));
        let offset = |cell: i32, axis: usize| {
            (self.origin[axis] + cell as f32 * self.spacing[axis]) - ball.center[axis]
        };
        for z in first.z..=last.z {
            let dz = offset(z, 2);
            let slab = i64::from(z >> 2) * self.bricks.y;
            for y in first.y..=last.y {
                let row = ball.row(offset(y, 1), dz);
                if !ball.reaches(row) {
                    continue;
                }
                let brick = (slab + i64::from(y >> 2)) * self.bricks.x;
                let place = (y & 1) << 2 | (z & 1) << 3 | (y & 2) << 3 | (z & 2) << 4;
                let mut begin = first.x;
                while begin <= last.x {
                    let mut weights = [0.0; ROW];
                    for (i, weight) in weights.iter_mut().enumerate() {
                        *weight = ball.weigh(offset(begin + i as i32, 0), row);
                    }
                    let count = ((last.x - begin) as usize + 1).min(ROW);
                    out.push_row(
                        |i| {
                            let x = begin + i as i32;
                            ((brick + i64::from(x >> 2)) * 64 + i64::from(place | x & 3)) as u64
                        },
                        &weights[..count],
                    );
                    begin += ROW as i32;
                }
            }
        }
    }

    /// The point nearest to the ball's centre among those that its half-space admits, or among all if it
    /// admits none nearby. Ties go to the lowest z, then y, then x.
    pub fn nearest(&self, ball: &Ball) -> u64 {
        let middle = ((ball.center - self.origin) * self.inverse_spacing).floor().as_i64vec3();
        let mut best = (f32::INFINITY, I64Vec3::ZERO);
        let mut best_admitted = (f32::INFINITY, I64Vec3::ZERO);
        // The nearest point of a half-space through y lies at most one cell beyond the cell of y.
        for z in -1..=2 {
            for y in -1..=2 {
                for x in -1..=2 {
                    let cell = (middle + I64Vec3::new(x, y, z)).clamp(I64Vec3::ZERO, self.bricks * EDGE - 1);
                    let position = self.at(cell);
                    let distance = position.distance_squared(ball.center);
                    if distance < best.0 {
                        best = (distance, cell);
                    }
                    if distance < best_admitted.0 && ball.admits(position) {
                        best_admitted = (distance, cell);
                    }
                }
            }
        }
        self.id(if best_admitted.0.is_finite() { best_admitted.1 } else { best.1 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    fn lattice() -> Lattice {
        Lattice::new(
            Bounds { min: Vec3::new(-1.0, 0.0, 2.0), max: Vec3::new(3.0, 2.5, 4.0) },
            Vec3::new(0.5, 0.25, 0.4),
            1.0,
        )
    }

    /// Ids are a bijection between 0..len and the grid: each position occurs once.
    #[test]
    fn every_id_has_its_own_position() {
        let lattice = lattice();
        let positions: HashSet<[u32; 3]> =
            (0..lattice.len()).map(|id| lattice.position(id).to_array().map(f32::to_bits)).collect();
        assert_eq!(positions.len() as u64, lattice.len());
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
            let ball = Ball::new(center, normal, 1.0, false);
            let mut found = Neighbours::default();
            lattice.gather(&ball, &mut found);
            let found: HashSet<u64> = found.ids().iter().copied().collect();
            let expected: HashSet<u64> = (0..lattice.len())
                .filter(|&id| {
                    let d = lattice.position(id) - center;
                    d.length_squared() < 1.0 && normal.is_none_or(|n| n.dot(d) >= 0.0)
                })
                .collect();
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
            let ball = Ball::new(center, Some(normal), 1.0, false);
            let distance = |id: u64| lattice.position(id).distance_squared(center);
            let expected = (0..lattice.len())
                .filter(|&id| normal.dot(lattice.position(id) - center) >= 0.0)
                .map(distance)
                .fold(f32::INFINITY, f32::min);
            assert_eq!(distance(lattice.nearest(&ball)), expected, "centre {center}, normal {normal}");
        }
    }
}
