//! Places that are close to a box, and which points of a row are among them.

use std::ops::Range;

use glam::Vec3;

/// A box with rounded edges: all places that are closer than some distance to a box.
#[derive(Clone, Copy, Debug)]
pub struct RoundedBox {
    /// Corners of the box itself.
    pub min: Vec3,
    /// See `min`.
    pub max: Vec3,
    /// How far the places reach beyond it.
    pub reach: f32,
}

impl RoundedBox {
    /// Corners of the smallest box that holds all of it.
    #[inline(always)]
    pub fn corners(&self) -> (Vec3, Vec3) {
        (self.min - self.reach, self.max + self.reach)
    }

    /// How far a coordinate is from the box along an axis.
    #[inline(always)]
    fn beside(&self, axis: usize, at: f32) -> f32 {
        (self.min[axis] - at).max(at - self.max[axis]).max(0.0)
    }

    /// Whether it holds a position.
    #[inline(always)]
    pub fn holds(&self, position: Vec3) -> bool {
        let (x, y, z) = (self.beside(0, position.x), self.beside(1, position.y), self.beside(2, position.z));
        x * x + y * y + z * z < self.reach * self.reach
    }

    /// The part of a row along x, at some y and z, that it holds.
    #[inline(always)]
    pub fn of_row(&self, y: f32, z: f32) -> Option<(f32, f32)> {
        let (y, z) = (self.beside(1, y), self.beside(2, z));
        let squared = self.reach * self.reach - y * y - z * z;
        let beyond = squared.max(0.0).sqrt();
        (squared > 0.0).then_some((self.min.x - beyond, self.max.x + beyond))
    }
}

/// Numbers of the points at `origin`, `origin` + 1/`inverse_spacing` and so on that lie in a part of their row, given that none does before `origin`. If there
/// are none they begin at a number beyond all rows, so that another row's lowest number is lower.
#[inline(always)]
pub fn numbers_in_row(part: Option<(f32, f32)>, origin: f32, inverse_spacing: f32) -> Range<i32> {
    /// More than a layout has in a row.
    const MOST: i32 = 1 << 20;
    // Conversion to whole numbers rounds towards 0, in one instruction where rounding down takes a call on old processors.
    let after = |at: f32| {
        let place = (at - origin) * inverse_spacing;
        if place < 0.0 { 0 } else { (place as i32).min(MOST) + 1 }
    };
    part.map_or(Range { start: MOST, end: 0 }, |(begin, end)| after(begin)..after(end))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The points of a row that are counted out are those whose distance says so, also where none or all are.
    #[test]
    fn numbers_in_a_row_are_those_that_distances_give() {
        let near = RoundedBox { min: Vec3::new(-1.0, 2.0, 0.5), max: Vec3::new(0.5, 3.0, 0.5), reach: 1.3 };
        let (origin, spacing) = (-2.9, 0.37);
        let mut counts = Vec::new();
        for row in 0..200 {
            let (y, z) = (0.4 + 0.02 * row as f32, -0.9 + 0.013 * row as f32);
            let numbers = numbers_in_row(near.of_row(y, z), origin, 1.0 / spacing);
            let expected =
                (0..20).filter(|&number| near.holds(Vec3::new(origin + number as f32 * spacing, y, z)));
            assert_eq!(numbers.clone().collect::<Vec<_>>(), expected.collect::<Vec<_>>(), "{y} {z}");
            counts.push(numbers.len());
        }
        assert!(counts.contains(&0) && counts.iter().max() > Some(&10), "{counts:?}");
    }
}
