//! The light-mesh integrator: steps 4 to 11 of the paper's algorithm for a block of surface points.

use glam::Vec3;
use pulp::NullaryFnOnce;
use rayon::prelude::*;

use super::LightMeshes;
use super::hybrid::shade_hybrid;
use super::paths::{PathVertex, TilePaths};
use super::stats::RenderStats;
use super::tiles::{TILES_PER_TASK, Tile};
use super::wavefront::{BlockIntegrator, ShadeCounters, direct_scale};
use crate::accel::Accel;
use crate::light_mesh::{MeshPoints, PointMask, Scratch};
use crate::scene::Scene;
use crate::settings::{Estimator, Resolve, Settings};
use crate::simd::vectorize;

/// Shades by interpolation of light meshes.
pub(super) struct LightMeshIntegrator<'a, A> {
    pub accel: &'a A,
    pub scene: &'a Scene,
    pub settings: &'a Settings,
    pub meshes: &'a mut LightMeshes,
}

/// The mesh points in the neighbourhoods of the paths' surface points: bricks and masks, unordered.
fn needed_by(paths: &[TilePaths], points: &MeshPoints) -> Vec<(u64, u64)> {
    let parts: Vec<Vec<(u64, u64)>> = paths
        .par_iter()
        .with_max_len(TILES_PER_TASK)
        .map(|paths| vectorize(Needed { paths, points }))
        .collect();
    parts.concat()
}

/// Finding the mesh points of a tile, as work for the best instruction set.
struct Needed<'a> {
    paths: &'a TilePaths,
    points: &'a MeshPoints,
}

impl NullaryFnOnce for Needed<'_> {
    type Output = Vec<(u64, u64)>;

    #[inline(always)]
    fn call(self) -> Self::Output {
        self.points.needed(self.paths.vertices.iter().map(|vertex| &vertex.surface))
    }
}

/// Shading of a tile, as work for the best instruction set.
struct Shade<'a, A> {
    integrator: &'a LightMeshIntegrator<'a, A>,
    tile: &'a Tile,
    vertices: &'a [PathVertex],
    light: &'a mut [Vec3],
}

impl<A: Accel> NullaryFnOnce for Shade<'_, A> {
    type Output = ShadeCounters;

    #[inline(always)]
    fn call(self) -> ShadeCounters {
        let Self { integrator: LightMeshIntegrator { accel, settings, meshes, .. }, tile, vertices, light } =
            self;
        let mut counters = ShadeCounters::default();
        let mut scratch = Scratch::for_tile();
        if settings.light_mesh.resolve == Resolve::Trace
            && settings.light_mesh.estimator == Estimator::PerLight
        {
            counters.shadow_rays = shade_hybrid(*accel, &meshes.direct, tile, vertices, &mut scratch, light);
        } else {
            let mut before = Vec3::NAN;
            for (number, (vertex, light)) in vertices.iter().zip(&mut *light).enumerate() {
                let surface = &vertex.surface;
                let normal = surface.shading_normal;
                let after = vertices.get(number + 1).map_or(Vec3::NAN, |next| next.surface.shading_normal);
                *light = if normal == before || normal == after {
                    meshes.direct.illumination_in_row(*accel, surface, &mut scratch)
                } else {
                    meshes.direct.illumination(*accel, surface, &mut scratch)
                };
                before = normal;
            }
        }
        counters.shadow_rays += scratch.rays;
        counters.direct_fallbacks = scratch.fallbacks;

        let scale = direct_scale(settings);
        light.iter_mut().for_each(|light| *light *= scale);
        if let Some(indirect) = &meshes.indirect {
            let mut scratch = Scratch::for_tile();
            for (vertex, light) in vertices.iter().zip(light) {
                *light += indirect.illumination(*accel, &vertex.surface, &mut scratch);
            }
            counters.shadow_rays += scratch.rays;
            counters.indirect_fallbacks = scratch.fallbacks;
        }
        counters
    }
}

impl<A: Accel> BlockIntegrator for LightMeshIntegrator<'_, A> {
    fn wants_whole_image(&self) -> bool {
        self.meshes.indirect.is_some()
    }

    fn needed_for_whole_image(&self, paths: &[TilePaths]) -> Vec<(u64, u64)> {
        self.meshes.indirect.as_ref().map_or(Vec::new(), |indirect| needed_by(paths, &indirect.points))
    }

    fn prepare_whole_image(&mut self, needed: PointMask, stats: &mut RenderStats) {
        let LightMeshes { direct, indirect } = &mut *self.meshes;
        if let Some(indirect) = indirect {
            let scale = direct_scale(self.settings);
            let rays = indirect.evaluate(self.accel, self.scene, direct, scale, needed);
            stats.rays.indirect += rays.indirect;
            stats.rays.shadow += rays.shadow;
        }
    }

    fn prepare(&mut self, paths: &[TilePaths], stats: &mut RenderStats) {
        let needed = PointMask::union(needed_by(paths, &self.meshes.direct.points));
        stats.rays.shadow += self.meshes.direct.evaluate(self.accel, self.scene, &needed);
    }

    fn shade(&self, tile: &Tile, vertices: &[PathVertex], light: &mut [Vec3]) -> ShadeCounters {
        vectorize(Shade { integrator: self, tile, vertices, light })
    }
}
