//! The known points of a light mesh: their slots, positions, and which of them lie inside of geometry.

use glam::Vec3;
use rayon::prelude::*;

use super::point_mask::{NeededPoints, PointMask};
use super::slots::SlotTable;
use crate::accel::Accel;
use crate::light_mesh::leaks::{PROBES, is_inside};
use crate::light_mesh::points::PointSet;
use crate::light_mesh::slot::UNKNOWN;
use crate::scene::Scene;

/// The points of a light mesh with their slots, and what is known of each whatever the mesh is of.
pub struct PointStore {
    /// The points.
    pub points: PointSet,
    pub(super) slots: SlotTable,
    /// By slot.
    positions: Vec<Vec3>,
    /// Whether a point lies inside of geometry, by slot, as far as anybody wanted to know.
    inside: Vec<bool>,
}

/// What becomes known of a light mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Growth {
    /// Points.
    pub points: usize,
    /// Bricks of 64 points that no point was known of.
    pub bricks: usize,
}

impl PointStore {
    /// With no point known.
    pub(crate) fn new(points: PointSet) -> Self {
        Self { points, slots: SlotTable::default(), positions: Vec::new(), inside: Vec::new() }
    }

    /// Of points that are known already: by slot their positions, and which lie inside of geometry, as far as that was found out.
    pub(super) fn of_parts(
        points: PointSet,
        slots: SlotTable,
        positions: Vec<Vec3>,
        inside: Vec<bool>,
    ) -> Self {
        Self { points, slots, positions, inside }
    }

    /// Makes the needed points known; returns the ids of those that were not, in slot order: their slots are the last ones.
    pub(crate) fn allocate(&mut self, needed: &PointMask) -> Vec<u64> {
        let Self { points, slots, positions, .. } = self;
        let known = |slots: &SlotTable, id: u64| {
            points.twins(id).map(|twin| slots.slot(twin)).find(|slot| *slot != UNKNOWN)
        };
        let new = slots.allocate(needed, known);
        positions.extend(new.iter().map(|&id| points.position(id)));
        new
    }

    /// Slots of those of some points that are known, each once.
    pub(crate) fn known_slots(&self, points: &PointMask) -> Vec<u32> {
        let ids = points.bricks().flat_map(|(brick, mask)| {
            (0..64).filter(move |place| mask >> place & 1 == 1).map(move |place| brick * 64 + place)
        });
        let mut slots: Vec<u32> = ids.map(|id| self.slot(id)).filter(|&slot| slot != UNKNOWN).collect();
        slots.sort_unstable();
        // Points at one position share a slot.
        slots.dedup();
        slots
    }

    /// Forgets which points lie inside of geometry, since that has moved.
    pub(crate) fn forget_inside(&mut self) {
        self.inside.clear();
    }

    /// The coarser points that the unknown ones among some points build on.
    pub(crate) fn corners_of(&self, needed: &PointMask) -> PointMask {
        let mut corners = NeededPoints::default();
        for (brick, mask) in needed.bricks() {
            let ids = (0..64).filter(|place| mask >> place & 1 == 1).map(|place| brick * 64 + place);
            for id in ids.filter(|&id| self.slot(id) == UNKNOWN) {
                self.points.corners(id).into_iter().flatten().for_each(|corner| corners.insert(corner));
            }
        }
        PointMask::union(corners.into_bricks())
    }

    /// Slots of the coarser points that a point builds on, which must be known.
    pub(crate) fn corner_slots(&self, id: u64) -> Option<[u32; 8]> {
        self.points.corners(id).map(|corners| corners.map(|corner| self.slot(corner)))
    }

    /// Numbers of the layers that the known points belong to, by slot.
    pub(crate) fn layers(&self) -> Vec<u32> {
        let mut layers = vec![0; self.positions.len()];
        for (id, slot) in self.known() {
            layers
                .get_mut(slot as usize)
                .into_iter()
                .for_each(|layer| *layer = PointSet::layer_of(id) as u32);
        }
        layers
    }

    /// Slot of a point; `u32::MAX` where it is not known.
    #[inline(always)]
    pub(crate) fn slot(&self, id: u64) -> u32 {
        self.slots.slot(id)
    }

    /// Positions of the known points, by slot.
    #[inline(always)]
    pub(crate) fn positions(&self) -> &[Vec3] {
        &self.positions
    }

    /// Whether the point in a slot lies inside of geometry; false where that was never [found out](Self::find_inside).
    #[inline(always)]
    pub(crate) fn is_inside(&self, slot: u32) -> bool {
        self.inside.get(slot as usize).is_some_and(|&inside| inside)
    }

    /// Of how many points it was found out whether they lie inside of geometry.
    pub(crate) fn inside_len(&self) -> usize {
        self.inside.len()
    }

    /// Finds out which of the first `count` known points lie inside of geometry, once for each; returns the number of rays.
    pub(crate) fn find_inside<A: Accel>(&mut self, accel: &A, scene: &Scene, count: usize) -> u64 {
        let last = count.min(self.positions.len());
        let new = self.positions.get(self.inside.len()..last).unwrap_or_default();
        self.inside.par_extend(new.par_iter().map(|&x| is_inside(accel, scene, x)));
        new.len() as u64 * PROBES as u64
    }

    /// Takes over what is known of further points, whose slots follow those of which it was known before.
    pub(crate) fn extend_inside(&mut self, inside: Vec<bool>) {
        self.inside.extend(inside);
    }

    /// What becomes known with some points, and with the coarser ones that they build on: at most, since points that become known together may share
    /// slots.
    pub(crate) fn growth(&self, needed: &PointMask) -> Growth {
        let Self { points, slots, .. } = self;
        let mut growth = Growth::default();
        for (brick, mask) in needed.bricks() {
            growth.bricks += usize::from(!slots.has_brick(brick));
            let ids = (0..64).filter(|place| mask >> place & 1 == 1).map(|place| brick * 64 + place);
            let is_known = |id: u64| slots.slot(id) != UNKNOWN;
            growth.points += ids.filter(|&id| !is_known(id) && !points.twins(id).any(is_known)).count();
        }
        if growth.points > 0 && points.has_levels() {
            let coarser = self.growth(&self.corners_of(needed));
            growth.points += coarser.points;
            growth.bricks += coarser.bricks;
        }
        growth
    }

    /// Makes room for what becomes known, so that lists that grow bit by bit don't take twice as much.
    pub(crate) fn reserve(&mut self, growth: Growth) {
        self.slots.reserve(growth.bricks);
        self.positions.reserve_exact(growth.points);
    }

    /// Bytes of what is known.
    pub(crate) fn memory_bytes(&self) -> usize {
        self.bytes_with(Growth::default())
    }

    /// The same once more is known.
    pub(crate) fn bytes_with(&self, growth: Growth) -> usize {
        (self.slots.bricks() + growth.bricks) * PointMask::BYTES_OF_BRICK
            + (self.positions.len() + growth.points) * size_of::<Vec3>()
            + self.inside.len() * size_of::<bool>()
    }
}
