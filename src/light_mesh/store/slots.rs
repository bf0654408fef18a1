//! From the ids of known mesh points to the slots of their values.
//!
//! Values lie in arrays indexed by *slots*, in the order of evaluation. The table from points to slots
//! holds only bricks of 64 points that were touched, so that memory follows use and not the extent of the
//! point set.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

use super::point_mask::PointMask;
use crate::light_mesh::slot::UNKNOWN;

/// Multiplicative hashing of brick numbers, which are well spread already in their low bits.
#[derive(Default)]
struct BrickHasher(u64);

impl Hasher for BrickHasher {
    fn finish(&self) -> u64 {
        self.0
    }
    fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.write_u64(u64::from(byte));
        }
    }
    fn write_u64(&mut self, value: u64) {
        self.0 = (self.0 ^ value).wrapping_mul(0x9E37_79B9_7F4A_7C15).rotate_left(26);
    }
}

/// From point ids to slots.
#[derive(Default)]
pub struct SlotTable {
    /// From bricks to their numbers in `bricks`.
    directory: HashMap<u64, u32, BuildHasherDefault<BrickHasher>>,
    bricks: Vec<[u32; 64]>,
    used: u32,
}

impl SlotTable {
    #[inline(always)]
    fn brick(&self, brick: u64) -> u32 {
        self.directory.get(&brick).copied().unwrap_or(UNKNOWN)
    }

    /// Slot of a point, or [`UNKNOWN`].
    #[inline(always)]
    pub fn slot(&self, id: u64) -> u32 {
        match self.brick(id / 64) {
            UNKNOWN => UNKNOWN,
            brick => self.bricks[brick as usize][(id % 64) as usize],
        }
    }

    /// Gives slots to those points of the set that are unknown; returns their ids, whose slots follow
    /// each other after those given away before. From here on they count as known.
    ///
    /// `twin` may name another point at the same position: if that one is known, the two share its slot.
    pub fn allocate(&mut self, needed: &PointMask, twin: impl Fn(&Self, u64) -> Option<u32>) -> Vec<u64> {
        let mut new = Vec::new();
        for (brick, mask) in needed.bricks() {
            let mut entry = self.brick(brick);
            if entry == UNKNOWN {
                entry = self.bricks.len() as u32;
                self.bricks.push([UNKNOWN; 64]);
                self.directory.insert(brick, entry);
            }
            for place in (0..64).filter(|place| mask >> place & 1 == 1) {
                if self.bricks[entry as usize][place] != UNKNOWN {
                    continue;
                }
                let id = brick * 64 + place as u64;
                let slot = twin(self, id).unwrap_or_else(|| {
                    new.push(id);
                    self.used + new.len() as u32 - 1
                });
                self.bricks[entry as usize][place] = slot;
            }
        }
        self.used += new.len() as u32;
        new
    }

    /// Ids of all points that have slots, in ascending order, each with its slot.
    pub fn known(&self) -> Vec<(u64, u32)> {
        let mut bricks: Vec<(u64, u32)> =
            self.directory.iter().map(|(&brick, &entry)| (brick, entry)).collect();
        bricks.sort_unstable();
        let slots = |&(brick, entry): &(u64, u32)| {
            let slots = self.bricks.get(entry as usize).into_iter().flatten();
            (brick * 64..).zip(slots.copied())
        };
        bricks.iter().flat_map(slots).filter(|(_, slot)| *slot != UNKNOWN).collect()
    }

    /// Whether any point of a brick was ever given a slot.
    pub fn has_brick(&self, brick: u64) -> bool {
        self.brick(brick) != UNKNOWN
    }

    /// Number of bricks.
    pub fn bricks(&self) -> usize {
        self.bricks.len()
    }

    /// Makes room for further bricks.
    pub fn reserve(&mut self, bricks: usize) {
        self.bricks.reserve_exact(bricks);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A known point is never given a second slot: "evaluated at most once" rests on this.
    #[test]
    fn a_point_is_allocated_once() {
        let mut table = SlotTable::default();
        let first = PointMask::union([(3, 0b101), (900, 1 << 63), (3, 0b1)]);
        assert_eq!(table.allocate(&first, |_, _| None), [192, 194, 900 * 64 + 63]);
        let second = PointMask::union([(900, 3 << 62), (3, 0b111)]);
        assert_eq!(table.allocate(&second, |_, _| None), [193, 900 * 64 + 62]);
        assert_eq!(table.allocate(&second, |_, _| None), [] as [u64; 0]);
        assert_eq!(table.slot(194), 1);
        assert_eq!(table.slot(193), 3);
        assert_eq!(table.slot(195), UNKNOWN);
        assert_eq!(table.slot(64), UNKNOWN);
    }

    /// A point whose twin is known takes its slot, and needs no value of its own; also where both come at once.
    #[test]
    fn twins_share_a_slot() {
        let mut table = SlotTable::default();
        let twin = |table: &SlotTable, id: u64| {
            let slot = if id >= 640 { table.slot(id - 640) } else { UNKNOWN };
            (slot != UNKNOWN).then_some(slot)
        };
        assert_eq!(table.allocate(&PointMask::union([(1, 0b10)]), twin), [65]);
        assert_eq!(table.allocate(&PointMask::union([(1, 0b100), (11, 0b1110)]), twin), [66, 707]);
        assert_eq!([705, 706, 707].map(|id| table.slot(id)), [0, 1, 2]);
    }
}
