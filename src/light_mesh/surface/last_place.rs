//! The cell that was looked into last.

use std::ops::Range;

use super::cells::Cell;
use super::points::SurfacePoints;
use crate::accel::Accel;
use crate::scene::SurfacePoint;

/// Remembers the cell that was looked into last: surface points that follow each other often lie in one.
#[derive(Default)]
pub struct LastPlace {
    last: Option<(Cell, Range<u32>)>,
}

impl LastPlace {
    /// The point that stands for a surface point, if its cell has one. Counts rays.
    #[inline(always)]
    pub fn find<A: Accel>(
        &mut self,
        points: &SurfacePoints,
        accel: &A,
        level: u8,
        surface: &SurfacePoint,
        rays: &mut u64,
    ) -> Option<u32> {
        let numbers = self.numbers(points, points.cells.at(level, surface.position)).unwrap_or_default();
        points.find_in(accel, numbers, level, surface, rays)
    }

    /// The points of a cell that was surveyed.
    #[inline(always)]
    pub fn numbers(&mut self, points: &SurfacePoints, cell: Cell) -> Option<Range<u32>> {
        if let Some((last, numbers)) = &self.last
            && *last == cell
        {
            return Some(numbers.clone());
        }
        let numbers = points.of_cell(cell)?;
        self.last = Some((cell, numbers.clone()));
        Some(numbers)
    }
}
