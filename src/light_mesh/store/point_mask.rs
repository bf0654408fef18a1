//! Sets of mesh points.

/// A set of mesh points: bricks with a bit for each of their 64 points, in ascending order of brick.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PointMask(Vec<(u64, u64)>);

impl PointMask {
    /// Union of unordered lists of (brick, points of the brick).
    pub(crate) fn union(parts: impl IntoIterator<Item = (u64, u64)>) -> Self {
        let mut all: Vec<(u64, u64)> = parts.into_iter().collect();
        all.sort_unstable_by_key(|&(brick, _)| brick);
        all.dedup_by(|next, kept| {
            let same = next.0 == kept.0;
            if same {
                kept.1 |= next.1;
            }
            same
        });
        Self(all)
    }

    /// Bytes that a light mesh takes for every brick of which points are known, whatever it knows of them: their slots, and a place in a hash map, which has
    /// a byte beside key and value.
    pub(crate) const BYTES_OF_BRICK: usize = size_of::<[u32; 64]>() + size_of::<(u64, u32)>() + 1;

    /// Adds the points of another set.
    pub(crate) fn add(&mut self, other: &Self) {
        *self = Self::union(self.bricks().chain(other.bricks()));
    }

    /// Bricks in ascending order, each with the bits of its points.
    pub(crate) fn bricks(&self) -> impl Iterator<Item = (u64, u64)> + '_ {
        self.0.iter().copied()
    }

    /// Number of points.
    pub fn len(&self) -> u64 {
        self.0.iter().map(|&(_, mask)| u64::from(mask.count_ones())).sum()
    }
}

/// Collects the points that one tile needs, before the tiles' lists are united.
///
/// A small open-addressed table from bricks to masks: a tile touches tens of bricks thousands of times.
pub struct NeededPoints {
    entries: Vec<(u64, u64)>,
    filled: usize,
    last: usize,
}

impl Default for NeededPoints {
    fn default() -> Self {
        Self { entries: vec![(u64::MAX, 0); 256], filled: 0, last: 0 }
    }
}

impl NeededPoints {
    /// Adds a point.
    #[inline(always)]
    pub(crate) fn insert(&mut self, id: u64) {
        let brick = id / 64;
        let bit = 1 << (id % 64);
        if self.entries[self.last].0 == brick {
            self.entries[self.last].1 |= bit;
        } else {
            self.insert_brick(brick, bit);
        }
    }

    fn insert_brick(&mut self, brick: u64, mask: u64) {
        let size = self.entries.len();
        let mut at = (brick.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 32) as usize & (size - 1);
        loop {
            let entry = &mut self.entries[at];
            if entry.0 == brick {
                entry.1 |= mask;
                self.last = at;
                return;
            }
            if entry.0 == u64::MAX {
                break;
            }
            at = (at + 1) & (size - 1);
        }
        if self.filled * 2 >= size {
            let old = std::mem::replace(&mut self.entries, vec![(u64::MAX, 0); size * 2]);
            self.filled = 0;
            for (brick, mask) in old {
                if brick != u64::MAX {
                    self.insert_brick(brick, mask);
                }
            }
            return self.insert_brick(brick, mask);
        }
        self.entries[at] = (brick, mask);
        self.filled += 1;
        self.last = at;
    }

    /// Bricks and the masks of their needed points, in no particular order.
    pub fn into_bricks(self) -> impl Iterator<Item = (u64, u64)> {
        self.entries.into_iter().filter(|&(brick, _)| brick != u64::MAX)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The tile's table loses nothing when it grows.
    #[test]
    fn needed_points_survive_growth() {
        let mut needed = NeededPoints::default();
        for i in 0..5000u64 {
            needed.insert(i * 64 * 37 + i % 64);
            needed.insert(i * 64 * 37 + (i + 5) % 64);
        }
        let mask = PointMask::union(needed.into_bricks());
        assert_eq!(mask.len(), 10_000);
        let expected: Vec<u64> = (0..5000u64)
            .flat_map(|i| {
                let (a, b) = (i % 64, (i + 5) % 64);
                [i * 64 * 37 + a.min(b), i * 64 * 37 + a.max(b)]
            })
            .collect();
        let ids = mask.bricks().flat_map(|(brick, places)| {
            (0..64).filter(move |place| places >> place & 1 == 1).map(move |place| brick * 64 + place)
        });
        assert_eq!(ids.collect::<Vec<_>>(), expected);
    }
}
