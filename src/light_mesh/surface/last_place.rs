//! The cell that was looked into last.

use std::ops::Range;

use super::cells::Cell;

/// Remembers the cell that was looked into last: surface points that follow each other often lie in one.
#[derive(Default)]
pub struct LastPlace {
    last: Option<(Cell, Range<u32>)>,
}

impl LastPlace {
    /// The points of a cell that was surveyed, which `find` finds where it is another one than the last.
    #[inline(always)]
    pub fn numbers(
        &mut self,
        cell: Cell,
        find: impl FnOnce(Cell) -> Option<Range<u32>>,
    ) -> Option<Range<u32>> {
        if let Some((last, numbers)) = &self.last
            && *last == cell
        {
            return Some(numbers.clone());
        }
        let numbers = find(cell)?;
        self.last = Some((cell, numbers.clone()));
        Some(numbers)
    }
}
