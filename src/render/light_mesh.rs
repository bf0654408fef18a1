//! The light-mesh integrator: steps 4 to 11 of the paper's algorithm for a block of surface points.

use glam::Vec3;
use rayon::prelude::*;

use super::LightMeshes;
use super::hybrid::shade_hybrid;
use super::paths::{PathVertex, TilePaths};
use super::stats::RenderStats;
use super::tiles::Tile;
use super::wavefront::{BlockIntegrator, ShadeCounters, direct_scale};
use crate::accel::Accel;
use crate::light_mesh::{MeshPoints, NeededPoints, Neighbours, PointMask, Scratch};
use crate::scene::Scene;
use crate::settings::{Estimator, Resolve, Settings};

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
        .map(|tile| {
            pulp::Arch::new().dispatch(|| {
                let mut needed = NeededPoints::default();
                let mut neighbours = Neighbours::default();
                for vertex in &tile.vertices {
                    points.neighbours(&vertex.surface, &mut neighbours);
                    neighbours.ids().iter().for_each(|&id| needed.insert(id));
                }
                needed.into_bricks().collect()
            })
        })
        .collect();
    parts.concat()
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

    fn shade(
        &self,
        tile: &Tile,
        vertices: &[PathVertex],
        emit: &mut dyn FnMut(&PathVertex, Vec3),
    ) -> ShadeCounters {
        pulp::Arch::new().dispatch(|| {
            let scale = direct_scale(self.settings);
            let LightMeshes { direct, indirect } = &*self.meshes;
            let mut scratch = Scratch::default();
            let mut indirect_scratch = Scratch::default();
            let mut add_indirect = |vertex: &PathVertex, direct_light: Vec3| {
                let mut illumination = direct_light * scale;
                if let Some(indirect) = indirect {
                    illumination += indirect.illumination(self.accel, &vertex.surface, &mut indirect_scratch);
                }
                emit(vertex, illumination);
            };
            let mut shadow_rays = 0;
            if self.settings.light_mesh.resolve == Resolve::Trace
                && self.settings.light_mesh.estimator == Estimator::PerLight
            {
                shadow_rays =
                    shade_hybrid(self.accel, direct, tile, vertices, &mut scratch, &mut add_indirect);
            } else {
                for vertex in vertices {
                    add_indirect(vertex, direct.illumination(self.accel, &vertex.surface, &mut scratch));
                }
            }
            ShadeCounters {
                shadow_rays: shadow_rays + scratch.rays + indirect_scratch.rays,
                direct_fallbacks: scratch.fallbacks,
                indirect_fallbacks: indirect_scratch.fallbacks,
            }
        })
    }
}
