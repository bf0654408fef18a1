//! The indirect light mesh (ILM): what mesh points receive from surfaces, eqs. (4) and (5).
//!
//! From every mesh point N rays go out, one through each part of a partition of the sphere. What a hit surface sends back
//! is Emiss + k_d·I from the direct light mesh, plus k_d·Ĩ_d from this mesh's previous iteration where there are
//! several bounces. Points that such hits need are evaluated the same lazy way, until nothing is missing.

mod gather;
mod octahedral;
mod patches;
mod solve;
mod view;

pub use view::{IndirectInterpolation, IndirectView};

use glam::Vec3;

use self::gather::Gathering;
use super::direct::{DirectEvaluation, DirectInterpolation, DirectMesh};
use super::points::{MeshError, Neighbourhoods, PointSet};
use super::store::{PointMask, PointStore};
use crate::Bounds;
use crate::accel::Accel;
use crate::sampling::SphereStrata;
use crate::settings::{IndirectForm, IndirectSettings, IndirectShading, Leaks};
use crate::world::World;

/// Indirect light mesh.
pub struct IndirectMesh {
    store: PointStore,
    strata: SphereStrata,
    settings: IndirectSettings,
    /// IndirectLight by slot, [`IndirectMesh::entries`] each, as means over directions; the first is that of all light.
    values: Vec<[f32; 3]>,
}

/// How surfaces send on the direct light that indirect mesh points receive.
#[derive(Clone, Copy)]
pub struct DirectTransport<'a> {
    /// How hits interpolate the direct mesh.
    pub interpolation: &'a DirectInterpolation,
    /// What I(y) is multiplied by before k_d.
    pub scale: f32,
}

/// What the evaluation of indirect mesh points took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct IndirectEvaluation {
    /// Indirect points that got a value.
    pub evaluated: u64,
    /// Rays from indirect mesh points.
    pub rays: u64,
    /// Direct points that hits lay near to.
    pub direct_needed: u64,
    /// Evaluation of those that were unknown.
    pub direct: DirectEvaluation,
    /// Occlusion rays towards emissive triangles and against leaks.
    pub shadow: u64,
    /// Rays that look for back faces around points that were known before.
    pub inside: u64,
}

impl IndirectMesh {
    /// Mesh over a scene of the given bounds, with no point known.
    pub fn new(bounds: Bounds, settings: &IndirectSettings) -> Self {
        Self {
            store: PointStore::new(PointSet::new(bounds)),
            strata: SphereStrata::new(settings.directions),
            settings: settings.clone(),
            values: Vec::new(),
        }
    }

    /// What it takes to interpolate the mesh by these settings; the points that they ask for become points of the mesh.
    ///
    /// # Errors
    /// See [`MeshError`].
    pub fn interpolation(&mut self, shading: &IndirectShading) -> Result<IndirectInterpolation, MeshError> {
        let neighbourhoods = Neighbourhoods::new(
            &mut self.store.points,
            &self.settings.points,
            &shading.kernel,
            Neighbourhoods::AUTO_SPACINGS / IndirectSettings::COARSENESS,
        )?;
        Ok(IndirectInterpolation { neighbourhoods, shading: shading.clone() })
    }

    /// RGB values per mesh point.
    fn entries(&self) -> usize {
        match self.settings.form {
            IndirectForm::Scalar => 1,
            IndirectForm::Directional => octahedral::ENTRIES,
        }
    }

    /// Evaluates those of the needed points that are unknown, and all that they depend on; direct mesh points at the
    /// hits are evaluated on the way.
    pub fn evaluate<A: Accel>(
        &mut self,
        world: World<A>,
        direct: &mut DirectMesh,
        transport: DirectTransport,
        interpolation: &IndirectInterpolation,
        needed: PointMask,
    ) -> IndirectEvaluation {
        let mut evaluation = IndirectEvaluation::default();
        let mut gathering = Gathering::default();
        let mut needed = needed;
        let leaks = interpolation.shading.kernel.leaks;
        loop {
            let known = self.store.positions().len();
            let new = self.store.allocate(&needed).to_vec();
            if new.is_empty() {
                break;
            }
            let hits = self.trace(world.accel, &new);
            if leaks == Leaks::Invalidate {
                evaluation.inside += self.store.find_inside(world.accel, world.scene, known);
                let inside = self.inside_by_hits(world.scene, &new, &hits);
                self.store.extend_inside(inside);
            }
            evaluation.evaluated += new.len() as u64;
            evaluation.rays += hits.len() as u64;
            let lookup = direct.view(world.lights, transport.interpolation).lookup;
            let direct_needed = self.needed_at(world.scene, &new, &hits, lookup);
            evaluation.direct_needed += direct_needed.len();
            evaluation.direct.add(direct.evaluate(world, transport.interpolation, &direct_needed));
            needed = if self.settings.bounces > 1 {
                self.needed_at(world.scene, &new, &hits, self.view(interpolation).lookup)
            } else {
                PointMask::default()
            };
            gathering.points.extend(new);
            gathering.hits.extend(hits);
        }
        if leaks == Leaks::Invalidate {
            evaluation.inside += self.store.find_inside(world.accel, world.scene, usize::MAX);
        }
        if !gathering.points.is_empty() {
            evaluation.shadow += self.solve(world, direct, transport, interpolation, &gathering);
        }
        evaluation
    }

    /// Points, and what is known of them.
    pub fn store(&self) -> &PointStore {
        &self.store
    }

    /// Bytes held by slots and values.
    pub fn memory_bytes(&self) -> usize {
        self.store.memory_bytes() + self.values.capacity() * size_of::<[f32; 3]>()
    }

    /// The values of the point in a slot.
    #[inline(always)]
    fn value(&self, slot: u32) -> &[[f32; 3]] {
        let entries = self.entries();
        &self.values[slot as usize * entries..][..entries]
    }

    /// Mean over all directions of the light at the point in a slot, RGB, whatever a surface's normal.
    pub fn mean(&self, slot: u32) -> Vec3 {
        self.value(slot).first().map_or(Vec3::ZERO, |&mean| mean.into())
    }
}
