//! Cells of space, and what stands for a surface in one.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::sampling::mix;
use crate::scene::SurfacePoint;

/// Cubes that space is cut into, level by level: each level halves the one before.
#[derive(Clone, Copy, Debug)]
pub struct Cells {
    /// Of a cube of level 0.
    width: f32,
}

/// A cube.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cell {
    /// Level.
    pub level: u8,
    index: [i32; 3],
}

/// Where the cubes begin, in widths of level 0: nowhere near the round coordinates at which models have their walls, which would lie on
/// the border of two cubes.
const ORIGIN: Vec3 = Vec3::new(0.381_966, 0.236_068, 0.723_607);

impl Cells {
    /// Cubes of a width at level 0.
    pub fn new(width: f32) -> Self {
        Self { width }
    }

    /// Width of a cube.
    #[inline(always)]
    pub fn width(&self, level: u8) -> f32 {
        self.width / f32::from(1u16 << level)
    }

    /// The cube that a position lies in.
    #[inline(always)]
    pub fn at(&self, level: u8, position: Vec3) -> Cell {
        let scale = f32::from(1u16 << level);
        let place = (position / self.width + ORIGIN) * scale;
        // Rounded down, as `floor` does for numbers that fit; a call of which costs more than all the rest.
        let down = |number: f32| {
            let whole = number as i32;
            whole.saturating_sub(i32::from(number < whole as f32))
        };
        Cell { level, index: place.to_array().map(down) }
    }

    /// The lower corner of a cube.
    pub fn corner(&self, cell: Cell) -> Vec3 {
        let scale = f32::from(1u16 << cell.level);
        (Vec3::from_array(cell.index.map(|index| index as f32)) / scale - ORIGIN) * self.width
    }

    /// The other cubes of a level that a surface point is nearly in: those within a quarter of their width.
    pub fn near(&self, level: u8, surface: &SurfacePoint) -> impl Iterator<Item = Cell> + use<> {
        let position = surface.position;
        let own = self.at(level, position);
        let reach = Vec3::splat(0.25 * self.width(level));
        let (low, high) = (self.at(level, position - reach).index, self.at(level, position + reach).index);
        (low[0]..=high[0])
            .flat_map(move |x| {
                (low[1]..=high[1])
                    .flat_map(move |y| (low[2]..=high[2]).map(move |z| Cell { level, index: [x, y, z] }))
            })
            .filter(move |cell| *cell != own)
    }

    /// The cubes around one that come closer to it than `reach` cubes, itself included, and that a surface in it could go on into: a plane
    /// through a point of it, or one that bends a little.
    pub fn around(&self, cell: Cell, surface: &SurfacePoint, reach: i32) -> impl Iterator<Item = Cell> + '_ {
        let width = self.width(cell.level);
        let (position, normal) = (surface.position, surface.shading_normal);
        let steps = -reach..=reach;
        steps.clone().flat_map(move |x| {
            let steps = steps.clone();
            steps.clone().flat_map(move |y| {
                steps.clone().filter_map(move |z| {
                    let index = [0, 1, 2].map(|axis| cell.index[axis].saturating_add([x, y, z][axis]));
                    let other = Cell { level: cell.level, index };
                    let height = (self.corner(other) + 0.5 * width - position).dot(normal);
                    // Half of the cube's extent along the normal.
                    let half = 0.5 * width * normal.abs().element_sum();
                    (height.abs() <= half + 0.25 * width).then_some(other)
                })
            })
        })
    }
}

impl Cell {
    /// One of 16 numbers, others for the cells of any square of 4×4 along the axes; those of 2×2 follow each other.
    pub fn set(self) -> u8 {
        let [x, y, z] = self.index;
        let (a, b) = (x.wrapping_add(z) & 3, y.wrapping_add(z) & 3);
        ((a & 1) | (b & 1) << 1 | (a & 2) << 1 | (b & 2) << 2) as u8
    }

    /// A hash: other cells practically never have the same.
    #[inline(always)]
    pub fn key(self) -> u64 {
        let [x, y, z] = self.index.map(|number| u64::from(number as u32));
        mix(mix(x | y << 32) ^ (z | u64::from(self.level) << 32))
    }
}

/// A point that stands for a surface in a cell.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct CellPoint {
    /// The point.
    pub surface: SurfacePoint,
    /// Places spread over what it stands for.
    pub spread: [Vec3; 4],
    /// Whether it may not be seen from all of the surface in the cell: other points lie in about the same plane and are not seen by it, or
    /// something stands on it.
    pub divided: bool,
}

impl CellPoint {
    /// A point that stands for itself alone.
    pub fn alone(surface: &SurfacePoint) -> Self {
        Self { surface: *surface, spread: [surface.position; 4], divided: false }
    }

    /// Points spread over what it stands for.
    pub fn spread(&self) -> [SurfacePoint; 4] {
        self.spread.map(|position| SurfacePoint { position, ..self.surface })
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;

    const CELLS: Cells = Cells { width: 1.0 };

    /// Interpolation mixes the cells of a neighbourhood; each gives it other directions.
    #[test]
    fn cells_of_a_square_have_different_sets() {
        let base = CELLS.at(1, Vec3::splat(-7.3)).index;
        for plane in 0..3 {
            let sets: HashSet<u8> = (0..16)
                .map(|number| {
                    let mut index = base;
                    index[plane] += number / 4;
                    index[(plane + 1) % 3] += number % 4;
                    Cell { level: 1, index }.set()
                })
                .collect();
            assert_eq!(sets.len(), 16);
        }
    }

    /// No position panics, however far, and each lies in its cell.
    #[test]
    fn every_position_has_a_cell() {
        for x in [0.0, -3.7, 1e30, f32::INFINITY, f32::NAN] {
            for level in 0..4 {
                let surface = SurfacePoint::flat(Vec3::new(x, 0.3, -1e12), Vec3::Y);
                assert!(CELLS.near(level, &surface).count() < 27);
                let cell = CELLS.at(level, Vec3::splat(-3.7));
                let inside = (Vec3::splat(-3.7) - CELLS.corner(cell)) / CELLS.width(level);
                assert!(inside.cmpge(Vec3::ZERO).all() && inside.cmple(Vec3::ONE).all(), "{inside}");
            }
        }
    }
}
