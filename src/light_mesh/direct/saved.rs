//! The direct mesh in files: the visibility bits of its known points.

use std::collections::HashSet;

use rayon::prelude::*;

use super::field::DirectField;
use super::mesh::DirectMesh;
use super::stored_bits::StoredBits;
use crate::Bounds;
use crate::light_mesh::file::{MeshFile, MeshFileError, SectionsWriter};
use crate::light_mesh::points::MeshError;
use crate::light_mesh::store::{PointSections, PointStore};
use crate::lights::PackedLights;

const POINTS: PointSections =
    PointSections { layers: "direct.layers", points: "direct.points", inside: "direct.inside" };
const BITS: &str = "direct.bits";

impl DirectMesh {
    /// Adds the mesh to a file: values of all known points, in the order of their ids.
    ///
    /// # Errors
    /// See [`SectionsWriter::value`].
    pub(crate) fn save(
        &self,
        lights: &PackedLights,
        writer: &mut SectionsWriter,
    ) -> Result<(), MeshFileError> {
        let chunks = lights.chunks().len();
        // What something moved in front of is to be traced again, and not known.
        let known = self.store.known();
        let stale = self.field.stale_among(known.iter().map(|known| known.1), chunks);
        let stale: HashSet<u32> = stale.into_iter().collect();
        let known: Vec<(u64, u32)> = known.into_iter().filter(|(_, slot)| !stale.contains(slot)).collect();
        self.store.save(&known, &POINTS, writer)?;
        let mut bytes = vec![0u8; known.len() * chunks * 2];
        let bits = self.field.bits();
        let of_points = bytes.par_chunks_mut((chunks * 2).max(1)).zip(&known).with_min_len(1 << 10);
        of_points.for_each(|(bytes, &(_, slot))| {
            let own = bits.get(slot as usize * chunks..).unwrap_or_default();
            bytes.as_chunks_mut().0.iter_mut().zip(own).for_each(|(bytes, bits)| *bytes = bits.to_le_bytes());
        });
        writer.bytes(BITS, bytes);
        Ok(())
    }

    /// The mesh of a file, over a scene of the given bounds; its values are used where they lie in the file.
    ///
    /// # Errors
    /// [`MeshFileError::Damaged`].
    pub(crate) fn restore(
        bounds: Bounds,
        lights: &PackedLights,
        file: &MeshFile,
    ) -> Result<Self, MeshFileError> {
        let store = PointStore::restore(bounds, &POINTS, file)?;
        let bits = StoredBits::of_section(file.needed(BITS)?);
        let count = store.positions().len() * lights.chunks().len();
        match bits.filter(|bits| bits.as_slice().len() == count) {
            Some(bits) => Ok(Self { store, field: DirectField::of_bits(bits) }),
            None => Err(MeshFileError::damaged(BITS, "not one for each point and light")),
        }
    }

    /// Takes over the values of the points of another mesh, of the same scene and lights, that are unknown here; returns their number.
    ///
    /// # Errors
    /// [`MeshError::TooManySpacings`].
    pub(crate) fn absorb(&mut self, other: &Self, lights: &PackedLights) -> Result<u64, MeshError> {
        let slots = self.store.absorb(&other.store)?;
        self.field.append(&other.field, &slots, lights.chunks().len());
        Ok(slots.len() as u64)
    }
}
