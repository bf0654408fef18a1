//! The mesh points of D_y, eq. (3).

use glam::Vec3;

use super::cells::PointPacket;
use super::kernel::Kernel;
use crate::simd::{LANES, Lanes};

/// Mesh points of one row of a regular grid that are weighed together: a register of AVX2.
pub(super) const ROW: usize = 8;

/// Mesh points with weights, and slots once they are looked up; the order is fixed by the point set, so that sums never
/// depend on timing.
#[derive(Clone, Debug, Default)]
pub struct Neighbours {
    ids: Vec<u64>,
    weights: Vec<f32>,
    slots: Vec<u32>,
    count: usize,
}

impl Neighbours {
    /// Forgets all points.
    #[inline(always)]
    pub(crate) fn clear(&mut self) {
        self.count = 0;
    }

    /// Adds a point.
    #[inline(always)]
    pub(crate) fn push(&mut self, id: u64, weight: f32) {
        self.push_row(|_| id, &[weight]);
    }

    /// Adds those of up to `ROW` (8) points whose weight is above 0; `id(i)` names point i.
    ///
    /// All are written and the end moves past those that count: in a ball's rows a branch would be a coin toss.
    #[inline(always)]
    pub(crate) fn push_row(&mut self, id: impl Fn(usize) -> u64, weights: &[f32]) {
        self.make_room(ROW);
        for (i, &weight) in weights.iter().enumerate().take(ROW) {
            self.ids[self.count] = id(i);
            self.weights[self.count] = weight;
            self.count += usize::from(weight > 0.0);
        }
    }

    /// Adds the points of a packet that are in `lanes`, with their slots.
    #[inline(always)]
    pub(crate) fn push_packet(&mut self, packet: &PointPacket, weights: &Lanes, mut lanes: u16) {
        self.make_room(LANES);
        let room = self.count..self.count + LANES;
        let ids = &mut self.ids[room.clone()];
        let places = ids.iter_mut().zip(&mut self.weights[room.clone()]).zip(&mut self.slots[room]);
        for ((id, weight), slot) in places {
            if lanes == 0 {
                break;
            }
            let lane = lanes.trailing_zeros() as usize % LANES;
            (*id, *weight, *slot) = (packet.ids[lane], weights[lane], packet.slots[lane]);
            lanes &= lanes - 1;
            self.count += 1;
        }
    }

    #[inline(always)]
    fn make_room(&mut self, more: usize) {
        if self.count + more > self.ids.len() {
            self.grow(more);
        }
    }

    #[cold]
    #[inline(never)]
    fn grow(&mut self, more: usize) {
        let capacity = (self.ids.len() * 2).max(64) + more;
        self.ids.resize(capacity, 0);
        self.weights.resize(capacity, 0.0);
        self.slots.resize(capacity, 0);
    }

    /// Adds `first` to all ids.
    pub(crate) fn offset_ids(&mut self, first: u64) {
        self.ids[..self.count].iter_mut().for_each(|id| *id += first);
    }

    /// Looks up the slots.
    #[inline(always)]
    pub(crate) fn find_slots(&mut self, slot: impl Fn(u64) -> u32) {
        for (found, &id) in self.slots.iter_mut().zip(&self.ids[..self.count]) {
            *found = slot(id);
        }
    }

    /// Drops the points that don't `pass`, by index and slot, unless none passes; returns whether any did.
    pub(crate) fn keep(&mut self, mut pass: impl FnMut(usize, u32) -> bool) -> bool {
        let mut kept = 0;
        for i in 0..self.count {
            if pass(i, self.slots[i]) {
                self.ids[kept] = self.ids[i];
                self.weights[kept] = self.weights[i];
                self.slots[kept] = self.slots[i];
                kept += 1;
            }
        }
        if kept > 0 {
            self.count = kept;
        }
        kept > 0
    }

    /// Changes the weights so that their mean of a field that is linear in the height over the surface is the field at the
    /// surface, not at the points' centroid in front of it; `height` gives the points' heights by slot.
    ///
    /// Where all points are about as high, from which no slope follows, the weights stay as they are.
    pub(crate) fn extrapolate_to_surface(&mut self, height: impl Fn(u32) -> f32) {
        /// Spread of the heights, over their mean squared, from which on the slope counts for more than half.
        const LEAST_SPREAD: f32 = 0.02;
        let slots = &self.slots[..self.count];
        let weights = &mut self.weights[..self.count];
        let (mut m0, mut m1, mut m2) = (0.0, 0.0, 0.0);
        for (&slot, &weight) in slots.iter().zip(&*weights) {
            let height = height(slot);
            m0 += weight;
            m1 += weight * height;
            m2 += weight * height * height;
        }
        let floor = LEAST_SPREAD * m1 * m1;
        let spread = m0 * m2 - m1 * m1 + floor;
        if spread > 0.0 {
            // The line fitted to the field by weighted least squares, at height 0; times m0, so that the sum stays.
            for (&slot, weight) in slots.iter().zip(weights) {
                *weight *= (m0 * m2 + floor - m0 * m1 * height(slot)) / spread;
            }
        }
    }

    /// Leaves the first point alone.
    pub(crate) fn keep_first(&mut self) {
        self.count = self.count.min(1);
    }

    /// Whether there are none.
    #[inline(always)]
    pub(crate) fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// The points' ids.
    #[inline(always)]
    pub fn ids(&self) -> &[u64] {
        &self.ids[..self.count]
    }

    /// The points' slots, after [`Neighbours::find_slots`] or from packets.
    #[inline(always)]
    pub(crate) fn slots(&self) -> &[u32] {
        &self.slots[..self.count]
    }

    /// The points' weights: above 0, unless they are [extrapolated](Neighbours::extrapolate_to_surface).
    #[inline(always)]
    pub(crate) fn weights(&self) -> &[f32] {
        &self.weights[..self.count]
    }

    /// Slots and weights.
    #[inline(always)]
    pub(crate) fn iter(&self) -> impl Iterator<Item = (u32, f32)> + '_ {
        self.slots().iter().copied().zip(self.weights().iter().copied())
    }

    /// Sum of the weights.
    #[inline(always)]
    pub(crate) fn total_weight(&self) -> f32 {
        self.weights().iter().sum()
    }
}

/// Search for the nearest point; ties go to the one offered first.
pub(super) struct Nearest {
    any: (f32, u64),
    admitted: (f32, u64),
}

impl Default for Nearest {
    fn default() -> Self {
        Self { any: (f32::INFINITY, 0), admitted: (f32::INFINITY, 0) }
    }
}

impl Nearest {
    pub(super) fn offer(&mut self, kernel: &Kernel, id: u64, position: Vec3) {
        let distance = position.distance_squared(kernel.center);
        if distance < self.any.0 {
            self.any = (distance, id);
        }
        if distance < self.admitted.0 && kernel.admits(position) {
            self.admitted = (distance, id);
        }
    }

    pub(super) fn id(&self) -> u64 {
        if self.admitted.0.is_finite() { self.admitted.1 } else { self.any.1 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A field that is linear in the height comes out as at the surface to within the floor of the spread, and the sum of
    /// the weights stays; points of one height keep theirs.
    #[test]
    fn extrapolation_gives_linear_fields_at_the_surface() {
        let heights = [0.1, 0.4, 0.9, 1.3];
        let mut points = Neighbours::default();
        (0..4).for_each(|id| points.push(id, 1.0 + id as f32));
        points.find_slots(|id| id as u32);
        points.extrapolate_to_surface(|slot| heights[slot as usize]);
        assert!((points.total_weight() - 10.0).abs() < 1e-4);
        let field = |id: u64| 5.0 - 2.0 * heights[id as usize];
        let mean: f32 =
            points.ids().iter().zip(points.weights()).map(|(&id, w)| w * field(id)).sum::<f32>() / 10.0;
        // Mean height 0.92, spread 0.16 of 0.92²: 0.02/(0.18 + 0.02) of the slope is left.
        assert!((mean - 5.0).abs() < 0.25, "{mean}");

        let mut level = Neighbours::default();
        (0..4).for_each(|id| level.push(id, 1.0 + id as f32));
        level.extrapolate_to_surface(|_| 0.7);
        for (id, weight) in level.weights().iter().enumerate() {
            assert!((weight - (1.0 + id as f32)).abs() < 1e-4);
        }
    }
}
