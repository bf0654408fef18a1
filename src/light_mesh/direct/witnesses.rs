//! What mesh points around several surface points together say of the lights.

use super::mesh::DirectView;
use crate::light_mesh::lookup::LookupScratch;
use crate::lights::VisibilityBits;
use crate::scene::SurfacePoint;
use crate::settings::Leaks;

/// The mesh points in the neighbourhoods of some surface points, and which lights they see.
///
/// Only the leak rule `invalidate` counts: where points on both sides of a wall differ, rays to the lights themselves decide.
#[derive(Default)]
pub(crate) struct Witnesses {
    slots: Vec<u32>,
    /// The lights that all of them see, by chunk.
    pub all: Vec<VisibilityBits>,
    /// The lights that any of them sees, by chunk.
    pub any: Vec<VisibilityBits>,
}

impl Witnesses {
    /// Takes the witnesses of other surface points.
    #[inline(always)]
    pub fn gather<'s>(
        &mut self,
        mesh: &DirectView,
        surfaces: impl Iterator<Item = &'s SurfacePoint>,
        scratch: &mut LookupScratch,
    ) {
        let Self { slots, all, any } = self;
        slots.clear();
        mesh.lookup.union(surfaces, scratch, slots);
        let is_inside = |slot: u32| mesh.lookup.store.is_inside(slot);
        if mesh.lookup.leaks == Leaks::Invalidate && slots.iter().any(|&slot| !is_inside(slot)) {
            slots.retain(|&slot| !is_inside(slot));
        }
        let chunks = mesh.estimator.lights.chunks().len();
        all.clear();
        all.resize(chunks, VisibilityBits::MAX);
        any.clear();
        any.resize(chunks, 0);
        for &slot in &*slots {
            let bits = mesh.estimator.bits(slot, chunks);
            for ((all, any), bits) in all.iter_mut().zip(&mut *any).zip(bits) {
                *all &= bits;
                *any |= bits;
            }
        }
    }

    /// The share of the witnesses that see a light, given by chunk and lane.
    #[inline(always)]
    pub fn share(&self, mesh: &DirectView, index: usize, light: usize) -> f32 {
        let chunks = mesh.estimator.lights.chunks().len();
        let sees = |slot: u32| u32::from(mesh.estimator.bits(slot, chunks)[index] >> light & 1);
        let seeing: u32 = self.slots.iter().map(|&slot| sees(slot)).sum();
        seeing as f32 / self.slots.len() as f32
    }
}
