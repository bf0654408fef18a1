//! The light-mesh integrator: steps 4 to 11 of the paper's algorithm for a block of surface points.

use glam::Vec3;
use pulp::NullaryFnOnce;

use super::averaged::Averages;
use super::hybrid::shade_hybrid;
use crate::accel::Accel;
use crate::light_mesh::direct::DirectMesh;
use crate::light_mesh::indirect::{IndirectMesh, IndirectView};
use crate::light_mesh::lookup::LookupScratch;
use crate::render::frame::BlockIntegrator;
use crate::render::layers::LightParts;
use crate::render::meshes::MeshInterpolation;
use crate::render::need::needed_points;
use crate::render::paths::TilePaths;
use crate::render::stats::{RenderStats, ShadeCounters, timed};
use crate::render::tiles::Tile;
use crate::simd::vectorize;
use crate::world::World;

/// Shades by interpolation of light meshes. Indirect mesh points must be known; direct ones are evaluated block by block.
pub struct LightMeshIntegrator<'a, A> {
    /// What is shaded.
    pub world: World<'a, A>,
    /// Its mesh of direct light.
    pub direct: &'a mut DirectMesh,
    /// Its mesh of indirect light, if it has one in free space.
    pub indirect: Option<&'a IndirectMesh>,
    /// How they are interpolated.
    pub interpolation: &'a MeshInterpolation,
}

/// Shading of a tile, as work for the best instruction set.
struct Shade<'a, 'p, A> {
    integrator: &'a LightMeshIntegrator<'a, A>,
    tile: &'a Tile,
    paths: &'a TilePaths,
    light: &'a mut [Vec3],
    parts: Option<&'a mut LightParts<'p>>,
}

impl<A: Accel> NullaryFnOnce for Shade<'_, '_, A> {
    type Output = ShadeCounters;

    #[inline(always)]
    fn call(self) -> ShadeCounters {
        let Self { integrator, tile, paths, light, mut parts } = self;
        let vertices = &paths.vertices;
        let LightMeshIntegrator { world, direct, indirect, interpolation } = integrator;
        let accel = world.accel;
        let direct = direct.view(world.lights, &interpolation.direct);
        let mut counters = ShadeCounters::default();
        let mut scratch = LookupScratch::for_tile();
        if interpolation.hybrid {
            let parts = parts.as_deref_mut();
            counters = shade_hybrid(accel, direct, interpolation, tile, paths, &mut scratch, light, parts);
        } else {
            let tolerance = interpolation.pixel_tolerance;
            let parts = parts.as_deref_mut();
            let has_parts = parts.is_some();
            let averages = Averages { accel, direct, tolerance, tile, vertices, parts };
            if has_parts {
                averages.fill::<true>(&mut scratch, light);
            } else {
                averages.fill::<false>(&mut scratch, light);
            }
        }
        counters.shadow_rays += scratch.rays;
        counters.direct_fallbacks = scratch.fallbacks;

        light.iter_mut().for_each(|light| *light *= interpolation.direct_scale);
        if let Some(parts) = &mut parts {
            let errors = parts.error.iter_mut().flatten();
            errors.for_each(|error| *error *= interpolation.direct_scale);
            parts.count_points(vertices, |vertex, found| {
                let points = &direct.lookup.store.points;
                interpolation.direct.neighbourhoods.find(points, &vertex.surface, found);
            });
        }
        if let (Some(indirect), Some(view)) = (indirect, &interpolation.indirect) {
            let light = parts.map_or(light, |parts| &mut parts.indirect);
            add_indirect(accel, indirect.view(view), paths, light, &mut counters);
        }
        counters
    }
}

/// Adds the indirect light of a mesh in free space to that of the vertices of a tile.
#[inline(always)]
pub(super) fn add_indirect<A: Accel>(
    accel: &A,
    indirect: IndirectView,
    paths: &TilePaths,
    light: &mut [Vec3],
    counters: &mut ShadeCounters,
) {
    let mut scratch = LookupScratch::for_tile();
    for (vertex, light) in paths.vertices.iter().zip(light) {
        *light += indirect.illumination(accel, &vertex.surface, &mut scratch);
    }
    counters.shadow_rays += scratch.rays;
    counters.indirect_fallbacks = scratch.fallbacks;
}

impl<A: Accel> BlockIntegrator for LightMeshIntegrator<'_, A> {
    fn evaluate(&mut self, paths: &[TilePaths], stats: &mut RenderStats) {
        let Self { world, direct, interpolation, .. } = self;
        let mut seconds = stats.seconds.mesh;
        timed(&mut seconds, || {
            let lookup = direct.view(world.lights, &interpolation.direct).lookup;
            let needed = needed_points(paths, lookup);
            stats.mesh_points.direct.needed += needed.len();
            stats.add_direct(direct.evaluate(*world, &interpolation.direct, &needed));
        });
        stats.seconds.mesh = seconds;
    }

    fn shade(
        &self,
        tile: &Tile,
        paths: &TilePaths,
        light: &mut [Vec3],
        parts: Option<&mut LightParts>,
    ) -> ShadeCounters {
        vectorize(Shade { integrator: self, tile, paths, light, parts })
    }
}
