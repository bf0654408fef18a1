//! The indirect mesh in files: the values of its known points. What they see is not kept: points that are added find it anew.

use super::mesh::IndirectMesh;
use crate::Bounds;
use crate::light_mesh::file::{MeshFile, MeshFileError, SectionsWriter};
use crate::light_mesh::points::MeshError;
use crate::light_mesh::store::{PointSections, PointStore};
use crate::settings::IndirectSettings;

const POINTS: PointSections =
    PointSections { layers: "indirect.layers", points: "indirect.points", inside: "indirect.inside" };
const VALUES: &str = "indirect.values";

impl IndirectMesh {
    /// Names of its sections.
    pub(crate) const SECTIONS: [&str; 4] = [POINTS.layers, POINTS.points, POINTS.inside, VALUES];

    /// Adds the mesh to a file.
    ///
    /// # Errors
    /// See [`SectionsWriter::value`].
    pub(crate) fn save(&self, writer: &mut SectionsWriter) -> Result<(), MeshFileError> {
        let known = self.store.known();
        self.store.save(&known, &POINTS, writer)?;
        let values = known.iter().flat_map(|&(_, slot)| self.value(slot)).flatten();
        writer.bytes(VALUES, values.flat_map(|value| value.to_le_bytes()).collect());
        Ok(())
    }

    /// The mesh of a file, for these settings and over a scene of the given bounds; `None` if the file has none.
    ///
    /// # Errors
    /// [`MeshFileError::Damaged`].
    pub(crate) fn restore(
        bounds: Bounds,
        settings: &IndirectSettings,
        file: &MeshFile,
    ) -> Result<Option<Self>, MeshFileError> {
        let Some(values) = file.section(VALUES) else { return Ok(None) };
        let mut mesh = Self::new(bounds, settings);
        mesh.store = PointStore::restore(bounds, &POINTS, file)?;
        let (numbers, rest) = values.bytes().as_chunks::<4>();
        let numbers: Vec<f32> = numbers.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
        let (values, odd) = numbers.as_chunks::<3>();
        if !(rest.is_empty()
            && odd.is_empty()
            && values.len() == mesh.store.positions().len() * mesh.entries())
        {
            return Err(MeshFileError::damaged(VALUES, "not one for each point"));
        }
        mesh.values = values.to_vec();
        Ok(Some(mesh))
    }

    /// Takes over the values of the points of another mesh, of the same scene and settings, that are unknown here.
    ///
    /// # Errors
    /// [`MeshError::TooManySpacings`].
    pub(crate) fn absorb(&mut self, other: &Self) -> Result<(), MeshError> {
        let inside_known = self.store.inside_len() == self.store.positions().len()
            && other.store.inside_len() == other.store.positions().len();
        let slots = self.store.absorb(&other.store)?;
        let entries = self.entries();
        let values = |slot: &u32| other.values.get(*slot as usize * entries..).and_then(|v| v.get(..entries));
        self.values.extend(slots.iter().flat_map(|slot| values(slot).unwrap_or_default()));
        if inside_known {
            self.store.extend_inside(slots.iter().map(|&slot| other.store.is_inside(slot)).collect());
        }
        Ok(())
    }
}
