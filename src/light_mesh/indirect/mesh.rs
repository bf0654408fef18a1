//! The indirect light mesh: its points, and the light that is known at them.

use glam::Vec3;

use super::interpolation::IndirectInterpolation;
use super::octahedral::ENTRIES;
use super::patches::Patches;
use crate::Bounds;
use crate::light_mesh::points::{AutoSpacing, MeshError, Neighbourhoods, PointSet};
use crate::light_mesh::store::{PointMask, PointStore};
use crate::sampling::SphereStrata;
use crate::settings::{IndirectForm, IndirectSettings, IndirectShading};

/// Indirect light mesh.
pub struct IndirectMesh {
    pub(super) store: PointStore,
    /// Directions of rays, before each point turns them its own way.
    pub(super) directions: Vec<Vec3>,
    pub(super) settings: IndirectSettings,
    /// What its points see.
    pub(super) patches: Patches,
    /// IndirectLight by slot, [`IndirectMesh::entries`] each, as means over directions; the first is that of all light.
    pub(super) values: Vec<[f32; 3]>,
}

impl IndirectMesh {
    /// Mesh over a scene of the given bounds, with no point known.
    pub fn new(bounds: Bounds, settings: &IndirectSettings) -> Self {
        Self {
            store: PointStore::new(PointSet::new(bounds)),
            directions: SphereStrata::new(settings.directions).middles(),
            settings: settings.clone(),
            patches: Patches::default(),
            values: Vec::new(),
        }
    }

    /// How the mesh is interpolated by these settings; the layers of points that they name are added to the mesh.
    ///
    /// # Errors
    /// See [`MeshError`].
    pub fn interpolation(&mut self, shading: &IndirectShading) -> Result<IndirectInterpolation, MeshError> {
        let neighbourhoods = Neighbourhoods::new(
            &mut self.store.points,
            &self.settings.points,
            &shading.kernel,
            AutoSpacing::GATHERED,
        )?;
        Ok(IndirectInterpolation { neighbourhoods, shading: shading.clone() })
    }

    /// Whether hits look up the direct mesh one by one, as in the paper's form, instead of sharing what falls on a patch.
    pub(super) fn looks_up_hits(&self) -> bool {
        self.settings.form == IndirectForm::Scalar
    }

    /// Whether it matters which patches its rays hit.
    pub(super) fn uses_patches(&self) -> bool {
        !self.looks_up_hits() || self.settings.bounces > 1
    }

    /// RGB values per mesh point.
    pub(super) fn entries(&self) -> usize {
        match self.settings.form {
            IndirectForm::Scalar => 1,
            _ => ENTRIES,
        }
    }

    /// Points, and what is known of them.
    pub(crate) fn store(&self) -> &PointStore {
        &self.store
    }

    /// Bytes of slots, values and patches, without the room that lists keep for more.
    pub fn memory_bytes(&self) -> usize {
        self.store.memory_bytes() + self.patches.memory_bytes() + self.values.len() * size_of::<[f32; 3]>()
    }

    /// The same once some points have slots and values; which patches they see is not known before.
    pub(crate) fn bytes_with(&self, needed: &PointMask) -> usize {
        let growth = self.store.growth(needed);
        let values = growth.points * self.entries() * size_of::<[f32; 3]>();
        self.memory_bytes() - self.store.memory_bytes() + self.store.bytes_with(growth) + values
    }

    /// The values of the point in a slot.
    #[inline(always)]
    pub(super) fn value(&self, slot: u32) -> &[[f32; 3]] {
        let entries = self.entries();
        &self.values[slot as usize * entries..][..entries]
    }
}
