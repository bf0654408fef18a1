//! Known points in files: their layers, their ids, and which of them lie inside of geometry.
//!
//! Ids are kept as bricks with a bit for each known point. Values follow each other in the order of ids, so that neither slots nor positions have
//! to be kept.

use glam::Vec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::point_mask::PointMask;
use super::point_store::PointStore;
use super::slots::SlotTable;
use crate::Bounds;
use crate::light_mesh::file::{MeshFile, MeshFileError, SectionsWriter};
use crate::light_mesh::points::{MeshError, PointSet};
use crate::light_mesh::slot::UNKNOWN;
use crate::settings::{PointLayout, PointSettings, Spacing};

/// Names of the sections of a mesh's points.
pub struct PointSections {
    /// Layouts and spacings.
    pub layers: &'static str,
    /// Ids.
    pub points: &'static str,
    /// Which lie inside of geometry.
    pub inside: &'static str,
}

/// Points of one layout and spacing.
#[derive(Serialize, Deserialize)]
struct SavedLayer {
    layout: PointLayout,
    spacing: Vec3,
    levels: u32,
}

/// Bytes of a brick: its number, and a bit for each of its points.
const BRICK: usize = 16;

impl PointStore {
    /// Ids of all known points in ascending order, and their slots; points that share a slot are one, with the lowest of their ids.
    pub(crate) fn known(&self) -> Vec<(u64, u32)> {
        let mut seen = vec![false; self.positions().len()];
        let is_new = |&(_, slot): &(u64, u32)| {
            seen.get_mut(slot as usize).is_some_and(|seen| !std::mem::replace(seen, true))
        };
        self.slots.known().into_iter().filter(is_new).collect()
    }

    /// Writes what is known of the points, which are all of [`Self::known`].
    ///
    /// # Errors
    /// See [`SectionsWriter::value`].
    pub(crate) fn save(
        &self,
        known: &[(u64, u32)],
        names: &PointSections,
        writer: &mut SectionsWriter,
    ) -> Result<(), MeshFileError> {
        let layer = |(layout, spacing, levels): (&PointLayout, Vec3, u32)| SavedLayer {
            layout: layout.clone(),
            spacing,
            levels,
        };
        writer.value(names.layers, &self.points.layers().map(layer).collect::<Vec<_>>())?;
        let bricks = PointMask::union(known.iter().map(|&(id, _)| (id / 64, 1 << (id % 64))));
        let brick = |(brick, mask): (u64, u64)| [brick.to_le_bytes(), mask.to_le_bytes()];
        writer.bytes(names.points, bricks.bricks().flat_map(brick).flatten().collect());
        // Only where all of them were looked at: what is missing is found out by rays once more.
        let all = self.inside_len() == self.positions().len();
        let inside = known.iter().filter(|_| all).map(|&(_, slot)| u8::from(self.is_inside(slot)));
        writer.bytes(names.inside, inside.collect());
        Ok(())
    }

    /// Reads what [`Self::save`] wrote, over a scene of the given bounds.
    ///
    /// # Errors
    /// [`MeshFileError::Damaged`].
    pub(crate) fn restore(
        bounds: Bounds,
        names: &PointSections,
        file: &MeshFile,
    ) -> Result<Self, MeshFileError> {
        let damaged = |what: &str| MeshFileError::damaged(names.points, what);
        let mut points = PointSet::new(bounds);
        for (number, layer) in file.value::<Vec<SavedLayer>>(names.layers)?.into_iter().enumerate() {
            let SavedLayer { layout, spacing, levels } = layer;
            let spacing_units = Spacing::Units(spacing);
            let settings = PointSettings { layout, spacing: spacing_units, levels, regions: Vec::new() };
            settings.check().map_err(|error| MeshFileError::damaged(names.layers, error))?;
            let own = points.layer(&settings.layout, spacing, levels);
            if own != Ok(number) {
                return Err(MeshFileError::damaged(names.layers, "their order is wrong"));
            }
        }
        let section = file.needed(names.points)?;
        let (bricks, rest) = section.bytes().as_chunks::<BRICK>();
        let number =
            |bytes: &[u8]| bytes.iter().rev().fold(0u64, |number, byte| number << 8 | u64::from(*byte));
        let bricks: Vec<(u64, u64)> =
            bricks.iter().map(|bytes| (number(&bytes[..8]), number(&bytes[8..]))).collect();
        let exists = |&(brick, mask): &(u64, u64)| mask != 0 && points.has_points(brick * 64, mask);
        if !rest.is_empty()
            || !bricks.is_sorted_by(|a, b| a.0 < b.0)
            || !bricks.iter().all(|brick| brick.0 < u64::MAX / 64 && exists(brick))
        {
            return Err(damaged("no such points"));
        }
        let mut slots = SlotTable::default();
        let ids = slots.allocate(&PointMask::union(bricks), |_, _| None);
        if ids.len() >= UNKNOWN as usize {
            return Err(damaged("too many points"));
        }
        let positions = ids.par_iter().map(|&id| points.position(id)).collect::<Vec<Vec3>>();
        let inside = file.needed(names.inside)?;
        let inside: Vec<bool> = inside.bytes().iter().map(|inside| *inside != 0).collect();
        if !inside.is_empty() && inside.len() != positions.len() {
            return Err(MeshFileError::damaged(names.inside, "not one for each point"));
        }
        Ok(Self::of_parts(points, slots, positions, inside))
    }

    /// Makes the points of another store known that are not; returns the slots of those there, in the order of the slots that they get here, which
    /// are the last ones.
    ///
    /// # Errors
    /// [`MeshError::TooManySpacings`].
    pub(crate) fn absorb(&mut self, other: &Self) -> Result<Vec<u32>, MeshError> {
        let mut own_layers = Vec::new();
        for (layout, spacing, levels) in other.points.layers() {
            own_layers.push(self.points.layer(layout, spacing, levels)?);
        }
        let renumbered = |&(id, slot): &(u64, u32)| Some((PointSet::in_layer(id, &own_layers)?, slot));
        let mut known: Vec<(u64, u32)> = other.known().iter().filter_map(renumbered).collect();
        known.sort_unstable();
        let needed = PointMask::union(known.iter().map(|&(id, _)| (id / 64, 1 << (id % 64))));
        let new = self.allocate(&needed);
        let slot_of =
            |id: &u64| known.binary_search_by_key(id, |known| known.0).ok().and_then(|at| known.get(at));
        Ok(new.iter().filter_map(slot_of).map(|known| known.1).collect())
    }
}
