//! Places of a tile where the mesh was mistaken about a light.

use crate::render::tiles::Tile;

/// What checks found of one light, by the tile's squares; masks have a bit per square.
pub(super) struct Places {
    /// Squares in which a check found the mesh mistaken, and in which several did.
    found: u64,
    several: u64,
    /// The patch that was checked, by square.
    checked: [u32; 64],
    /// Squares with points about which the mesh was mistaken, and how many.
    mistaken: u64,
    points: [u32; 64],
}

impl Places {
    /// No place.
    pub fn new() -> Self {
        Self { found: 0, several: 0, checked: [0; 64], mistaken: 0, points: [0; 64] }
    }

    /// Whether no check found the mesh mistaken.
    pub fn is_empty(&self) -> bool {
        self.found == 0
    }

    /// A check of a patch in a square found the mesh mistaken.
    pub fn add_check(&mut self, square: u8, patch: u32) {
        let bit = 1 << square;
        self.several |= self.found & bit;
        self.found |= bit;
        self.checked[usize::from(square)] = patch;
    }

    /// The mesh was mistaken about so many points of a square.
    pub fn add_points(&mut self, square: u8, points: u32) {
        self.mistaken |= u64::from(points > 0) << square;
        self.points[usize::from(square)] += points;
    }

    /// Calls `each` with the patch and the number of points of every place, squares next to each other, that a single check
    /// found.
    pub fn for_each_found_once(&self, mut each: impl FnMut(u32, u32)) {
        let mut found = self.found;
        while found != 0 {
            let (mut place, mut before) = (found & found.wrapping_neg(), 0);
            while place != before {
                before = place;
                place |= Tile::around(place) & self.mistaken;
            }
            if (found & place).count_ones() == 1 && self.several & place == 0 {
                let of_place = self.points.iter().enumerate().filter(|(square, _)| place >> square & 1 == 1);
                let checked = self.checked[(found & place).trailing_zeros() as usize];
                each(checked, of_place.map(|(_, points)| points).sum());
            }
            found &= !place;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of three places one is found by two checks, in squares that touch at a corner, one twice in one square, and one once: that has the
    /// points of its own squares.
    #[test]
    fn places_that_one_check_found_stand_apart() {
        let mut places = Places::new();
        for (square, patch) in [(0, 10), (9, 11), (7, 12), (7, 13), (44, 14)] {
            places.add_check(square, patch);
        }
        for (square, points) in [(0, 1), (9, 2), (7, 3), (44, 4), (45, 5), (54, 6), (63, 7), (32, 8)] {
            places.add_points(square, points);
        }
        let mut once = Vec::new();
        places.for_each_found_once(|patch, points| once.push((patch, points)));
        assert_eq!(once, [(14, 4 + 5 + 6 + 7)]);
    }
}
