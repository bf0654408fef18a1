//! Points of a surface mesh, taken from a file or from another mesh.

use super::cell_light::CellLight;
use super::cells::CellPoint;
use super::points::{NO_POINT, SurfacePoints, UNLINKED};
use super::saved::SavedCell;

impl SurfacePoints {
    /// All cells, in the order of their points' numbers.
    pub fn saved_cells(&self) -> Vec<SavedCell<'_>> {
        let mut cells: Vec<(u32, u32, u64)> =
            self.by_cell.iter().map(|(&key, &(first, count))| (first, count, key)).collect();
        cells.sort_unstable();
        let cell = |(first, count, key): (u32, u32, u64)| {
            let numbers = first as usize..(first + count) as usize;
            let points = self.points.get(numbers.clone()).unwrap_or_default();
            let level = self.levels.get(numbers.start).copied().unwrap_or_default();
            let lit: Vec<&CellLight> =
                (first..first + count).filter_map(|number| self.light(number)).collect();
            SavedCell {
                key,
                // A cell without points has no level, and needs none.
                level: if points.is_empty() { 0 } else { level },
                points: points.into(),
                lights: lit.into_iter().cloned().collect(),
            }
        };
        cells.into_iter().map(cell).collect()
    }

    /// By point: the point of level 0 that stands for it, or a reason why there is none.
    pub fn parents(&self) -> &[u32] {
        &self.parents
    }

    /// Adds a cell; returns whether it was unknown.
    pub fn add_cell(&mut self, key: u64, level: u8, points: &[CellPoint], lights: Vec<CellLight>) -> bool {
        let is_new = !self.by_cell.contains_key(&key);
        if is_new {
            self.add(key, level, points, lights);
        }
        is_new
    }

    /// Takes over which points stand for which; returns whether there is one entry for each, and all are points.
    pub fn set_parents(&mut self, parents: &[u32]) -> bool {
        let count = self.len() as u32;
        let exists = |parent: &u32| *parent < count || *parent == NO_POINT || *parent == UNLINKED;
        let fit = parents.len() == self.len() && parents.iter().all(exists);
        if fit {
            self.parents.copy_from_slice(parents);
        }
        fit
    }

    /// Takes over the cells of other points that are unknown here; returns the numbers that their points have here.
    pub fn absorb(&mut self, other: &Self) -> Vec<u32> {
        let mut numbers = Vec::with_capacity(other.len());
        for SavedCell { key, level, points, lights } in other.saved_cells() {
            self.add_cell(key, level, &points, lights.into_owned());
            // A cell has the same points whoever surveyed it.
            let own = self.by_cell.get(&key).filter(|(_, count)| *count as usize == points.len());
            let number = |index: u32| own.map_or(NO_POINT, |(first, _)| first + index);
            numbers.extend((0..points.len() as u32).map(number));
        }
        for (&number, &parent) in numbers.iter().zip(&other.parents) {
            let parent = numbers.get(parent as usize).copied().unwrap_or(parent);
            if let Some(own) = self.parents.get_mut(number as usize).filter(|own| **own == UNLINKED) {
                *own = parent;
            }
        }
        numbers
    }
}
