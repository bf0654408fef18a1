//! Mesh points around small cells of space: found once, and weighed for every surface point in the cell.
//!
//! The surface points of a tile lie close together, so that searching for the D_y of each would find the same mesh points
//! again and again. Here a search is made per cell, and a surface point costs one weighing of sixteen points at a time.

use std::ops::Range;

use glam::{IVec3, Vec3};

use super::kernel::Kernel;
use crate::light_mesh::slot::UNKNOWN;
use crate::simd::{LANES, Lanes};

/// Cells and packets of candidates that are kept before all are forgotten: some megabytes per thread.
const MOST_CELLS: usize = 1 << 9;
const MOST_PACKETS: usize = 1 << 12;

/// Which of sixteen mesh points surface points see.
#[derive(Clone, Copy, Debug)]
pub struct Sight {
    /// Lanes that were asked for.
    pub known: u16,
    /// Those of them that are seen.
    pub clear: u16,
}

/// Sixteen mesh points that lie close to a cell.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub struct PointPacket {
    position: [Lanes; 3],
    /// The points' ids.
    pub ids: [u64; LANES],
    /// Their slots, as far as they are known.
    pub slots: [u32; LANES],
    /// Lanes whose points lay in the kernel of some surface point.
    pub needed: u16,
    /// For whose surface points `needed` is.
    pub group: u32,
    /// By the octant of surface points' normals: lanes of which it is known whether the cell's surface points see them, and
    /// those that they see.
    pub sight: [Sight; 8],
    /// Irradiance of the points for one normal, [`Surroundings::normal`], by channel.
    pub lit: [Lanes; 3],
    /// Amount of light at the points, summed over channels and directions; below 0 at points that don't count.
    pub amount: Lanes,
}

impl PointPacket {
    /// A packet of no points: their places are so far away that they weigh nothing.
    const EMPTY: Self = Self {
        position: [[f32::MAX; LANES]; 3],
        ids: [0; LANES],
        slots: [UNKNOWN; LANES],
        needed: 0,
        group: 0,
        sight: [Sight { known: 0, clear: 0 }; 8],
        lit: [[0.0; LANES]; 3],
        amount: [0.0; LANES],
    };

    /// Ids of the points that lay in the kernel of some surface point.
    pub fn needed_ids(&self) -> impl Iterator<Item = u64> + '_ {
        (0..LANES).filter(|lane| self.needed >> lane & 1 == 1).map(|lane| self.ids[lane])
    }

    /// Position of a point.
    #[inline(always)]
    pub fn position(&self, lane: usize) -> Vec3 {
        Vec3::from(self.position.map(|axis| axis[lane]))
    }

    /// Weights of the points in a ball, and the lanes that weigh anything.
    #[inline(always)]
    pub fn weigh(&self, kernel: &Kernel) -> (Lanes, u16) {
        let [x, y, z] = &self.position;
        let mut weights = [0.0; LANES];
        for lane in 0..LANES {
            let (dy, dz) = (y[lane] - kernel.center.y, z[lane] - kernel.center.z);
            weights[lane] = kernel.weigh(x[lane] - kernel.center.x, kernel.row(dy, dz));
        }
        (weights, that_count(&weights))
    }

    /// Adds the irradiance of those of its points that count, by channel, and last their weights, to sums by lane.
    #[inline(always)]
    pub fn add_lit(&self, weights: &Lanes, sums: &mut [Lanes; 4]) {
        let [r, g, b] = &self.lit;
        for lane in 0..LANES {
            // Points that don't count are marked by an amount below 0.
            let weight = if self.amount[lane] >= 0.0 && weights[lane] > 0.0 { weights[lane] } else { 0.0 };
            sums[0][lane] += weight * r[lane];
            sums[1][lane] += weight * g[lane];
            sums[2][lane] += weight * b[lane];
            sums[3][lane] += weight;
        }
    }
}

/// The lanes whose weight, from 0 to 1, is at least 2⁻⁶³: what is less doesn't count beside any other.
///
/// The second-highest bit of a weight's exponent decides. The lanes' bits are folded together half by half: the sixteen
/// results of a comparison would be taken out of a mask register one by one, which costs more than the weights.
#[inline(always)]
fn that_count(weights: &Lanes) -> u16 {
    let mut bits = [0u32; LANES];
    for lane in 0..LANES {
        bits[lane] = (weights[lane].to_bits() >> 29 & 1) << lane;
    }
    let mut half = [0; LANES / 2];
    for lane in 0..LANES / 2 {
        half[lane] = bits[lane] | bits[lane + LANES / 2];
    }
    let mut quarter = [0; LANES / 4];
    for lane in 0..LANES / 4 {
        quarter[lane] = half[lane] | half[lane + LANES / 4];
    }
    (quarter[0] | quarter[1] | quarter[2] | quarter[3]) as u16
}

/// Where the mesh points around a cell are put.
pub struct PacketWriter<'a> {
    packets: &'a mut Vec<PointPacket>,
    /// The next lane of the last packet.
    lane: usize,
}

impl PacketWriter<'_> {
    /// Adds a point.
    #[inline(always)]
    pub fn push(&mut self, id: u64, slot: u32, position: Vec3) {
        if self.lane == LANES {
            self.packets.push(PointPacket::EMPTY);
            self.lane = 0;
        }
        if let Some(packet) = self.packets.last_mut() {
            (0..3).for_each(|axis| packet.position[axis][self.lane] = position[axis]);
            (packet.ids[self.lane], packet.slots[self.lane]) = (id, slot);
        }
        self.lane += 1;
    }
}

/// A cell of space: the layer of mesh points that holds there, and its place in units of its side.
pub type Cell = (u32, IVec3);

/// The mesh points around a cell.
pub struct Surroundings<'a> {
    /// The points, in a fixed order.
    pub packets: &'a mut [PointPacket],
    /// The normal that the packets' `lit` is for; NaN to begin with.
    pub normal: &'a mut Vec3,
}

/// A cell that was met, its packets, and [`Surroundings::normal`].
struct KnownCell {
    cell: Cell,
    packets: Range<usize>,
    normal: Vec3,
}

/// The cells that were met, with the mesh points around each.
#[derive(Default)]
pub struct CellCache {
    cells: Vec<KnownCell>,
    /// From hashes of cells to their numbers plus one; a power of two of them, at most half in use.
    table: Vec<u32>,
    packets: Vec<PointPacket>,
    current: usize,
}

impl CellCache {
    /// The packets around a cell; `surround` writes each point that may be in the ball of some point of the cell, in a fixed
    /// order. Where much is kept already, `forget` receives all packets before they are dropped.
    #[inline(always)]
    pub fn around(
        &mut self,
        cell: Cell,
        surround: impl FnOnce(&mut PacketWriter),
        forget: impl FnMut(&PointPacket),
    ) -> Surroundings<'_> {
        if self.cells.get(self.current).is_none_or(|known| known.cell != cell) {
            self.turn_to(cell, surround, forget);
        }
        let known = &mut self.cells[self.current];
        Surroundings { packets: &mut self.packets[known.packets.clone()], normal: &mut known.normal }
    }

    /// All packets.
    pub fn packets(&self) -> &[PointPacket] {
        &self.packets
    }

    #[inline(never)]
    fn turn_to(
        &mut self,
        cell: Cell,
        surround: impl FnOnce(&mut PacketWriter),
        forget: impl FnMut(&PointPacket),
    ) {
        if self.table.is_empty() {
            self.table.resize(2 * MOST_CELLS, 0);
        }
        if self.cells.len() >= MOST_CELLS || self.packets.len() >= MOST_PACKETS {
            self.packets.iter().for_each(forget);
            self.packets.clear();
            self.cells.clear();
            self.table.fill(0);
        }
        let (layer, place) = cell;
        let mixed = [layer as i32, place.x, place.y, place.z].iter().fold(0u64, |hash, &v| {
            (hash ^ u64::from(v as u32)).wrapping_mul(0x9E37_79B9_7F4A_7C15).rotate_left(29)
        });
        let mut at = mixed as usize & (self.table.len() - 1);
        loop {
            match self.table[at] {
                0 => break,
                number if self.cells[number as usize - 1].cell == cell => {
                    self.current = number as usize - 1;
                    return;
                }
                _ => at = (at + 1) & (self.table.len() - 1),
            }
        }
        let first = self.packets.len();
        surround(&mut PacketWriter { packets: &mut self.packets, lane: LANES });
        self.cells.push(KnownCell { cell, packets: first..self.packets.len(), normal: Vec3::NAN });
        self.current = self.cells.len() - 1;
        self.table[at] = self.cells.len() as u32;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bit l stands for lane l, whatever the others hold, for every weight that there is.
    #[test]
    fn lanes_with_weight_are_told_apart() {
        for pattern in [0, 1, 0x8000, 0x0180, 0x5a5a, 0xffff, 0x1234] {
            for weight in [1.0, 0.999, 0.5, 1e-3, 1e-9, 2f32.powi(-63)] {
                for nothing in [0.0, 2f32.powi(-65), f32::MIN_POSITIVE] {
                    let weights =
                        std::array::from_fn(|lane| if pattern >> lane & 1 == 1 { weight } else { nothing });
                    assert_eq!(that_count(&weights), pattern, "{weight}");
                }
            }
        }
    }
}
