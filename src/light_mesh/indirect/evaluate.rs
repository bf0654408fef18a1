//! Evaluation: making needed indirect mesh points known, and all that they depend on.

use super::gather::Gathering;
use super::interpolation::{DirectTransport, IndirectInterpolation};
use super::mesh::IndirectMesh;
use crate::accel::Accel;
use crate::light_mesh::direct::{DirectEvaluation, DirectMesh};
use crate::light_mesh::store::PointMask;
use crate::scene::SurfacePoint;
use crate::settings::Leaks;
use crate::world::World;

/// Width of patches over the spacing of the mesh points: half of the default R. R itself is an argument of shading, and values
/// don't depend on it.
const PATCH_WIDTH: f32 = 0.75;

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
    /// Occlusion rays from what its points see towards lights, from them towards emissive triangles, and against leaks.
    pub shadow: u64,
    /// Rays that look for back faces around points that were known before.
    pub inside: u64,
}

impl IndirectMesh {
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
            self.store.allocate(&needed);
            let new = self.store.positions()[known..].to_vec();
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
            if self.looks_up_hits() {
                let lookup = direct.view(world.lights, transport.interpolation).lookup;
                let direct_needed = self.needed_at(world.scene, &new, &hits, lookup);
                evaluation.direct_needed += direct_needed.len();
                evaluation.direct.add(direct.evaluate(world, transport.interpolation, &direct_needed));
            }
            let known = self.patches.len();
            let width = |surface: &SurfacePoint| {
                PATCH_WIDTH * interpolation.neighbourhoods.spacing_at(surface.position)
            };
            evaluation.shadow += self.sort_hits(world, &mut gathering, &new, &hits, width);
            needed = if self.settings.bounces > 1 {
                self.view(interpolation).lookup.needed_anywhere(self.patches.surfaces(known))
            } else {
                PointMask::default()
            };
            gathering.points.extend(new);
            if self.looks_up_hits() {
                gathering.hits.extend(hits);
            }
        }
        if leaks == Leaks::Invalidate {
            evaluation.inside += self.store.find_inside(world.accel, world.scene, usize::MAX);
        }
        if !gathering.points.is_empty() {
            evaluation.shadow += self.solve(world, direct, transport, interpolation, &gathering);
        }
        evaluation
    }
}
