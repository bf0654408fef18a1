//! The conventional tracer (method §10): one occlusion ray per light at every surface point.

use glam::Vec3;
use pulp::NullaryFnOnce;

use crate::accel::Accel;
use crate::lights::VisibilityBits;
use crate::render::frame::BlockIntegrator;
use crate::render::stats::{RenderStats, ShadeCounters};
use crate::render::surface_group::{SurfaceGroup, light_of_seen};
use crate::render::tiles::Tile;
use crate::render::trace::{PathVertex, TilePaths};
use crate::simd::{LANES, vectorize};
use crate::world::World;

/// Shades with all shadow rays traced.
pub struct ConventionalIntegrator<'a, A> {
    /// What is shaded.
    pub world: World<'a, A>,
    /// What direct light is multiplied by before k_d.
    pub scale: f32,
}

impl<A: Accel> BlockIntegrator for ConventionalIntegrator<'_, A> {
    fn evaluate(&mut self, _: &[TilePaths], _: &mut RenderStats) {}

    fn shade(&self, _: &Tile, vertices: &[PathVertex], light: &mut [Vec3]) -> ShadeCounters {
        vectorize(Shade { integrator: self, vertices, light })
    }
}

/// Shading of a tile, as work for the best instruction set.
struct Shade<'a, A> {
    integrator: &'a ConventionalIntegrator<'a, A>,
    vertices: &'a [PathVertex],
    light: &'a mut [Vec3],
}

impl<A: Accel> NullaryFnOnce for Shade<'_, A> {
    type Output = ShadeCounters;

    #[inline(always)]
    fn call(self) -> ShadeCounters {
        let ConventionalIntegrator { world: World { accel, lights, .. }, scale } = self.integrator;
        let chunks = lights.chunks();
        let mut shadow_rays = 0;
        let mut bits: Vec<VisibilityBits> = vec![0; chunks.len() * LANES];
        for (members, light) in self.vertices.chunks(LANES).zip(self.light.chunks_mut(LANES)) {
            bits.fill(0);
            let mut group = SurfaceGroup::new(members);
            for (index, chunk) in chunks.iter().enumerate() {
                for light in (0..LANES).filter(|light| chunk.used >> light & 1 == 1) {
                    let facing = group.aim(chunk, light);
                    if facing == 0 {
                        continue;
                    }
                    shadow_rays += u64::from(facing.count_ones());
                    let seeing = group.seeing(*accel, facing);
                    for point in 0..members.len() {
                        bits[point * chunks.len() + index] |=
                            ((seeing >> point & 1) << light) as VisibilityBits;
                    }
                }
            }
            light_of_seen(lights, members, &bits, light);
            light.iter_mut().for_each(|light| *light *= *scale);
        }
        ShadeCounters { shadow_rays, ..ShadeCounters::default() }
    }
}
