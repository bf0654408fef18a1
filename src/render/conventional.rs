//! The conventional tracer (spec §10): one occlusion ray per light at every surface point.

use glam::Vec3;

use super::paths::{PathVertex, TilePaths};
use super::stats::RenderStats;
use super::surface_group::{SurfaceGroup, emit_seen};
use super::tiles::Tile;
use super::wavefront::{BlockIntegrator, ShadeCounters};
use crate::accel::Accel;
use crate::light_mesh::{LANES, LightTable, VisibilityBits};

/// Shades with all shadow rays traced.
pub(super) struct ConventionalIntegrator<'a, A> {
    pub accel: &'a A,
    pub lights: LightTable,
    /// What direct light is multiplied by before k_d.
    pub scale: f32,
}

impl<A: Accel> BlockIntegrator for ConventionalIntegrator<'_, A> {
    fn prepare(&mut self, _: &[TilePaths], _: &mut RenderStats) {}

    fn shade(
        &self,
        _: &Tile,
        vertices: &[PathVertex],
        emit: &mut dyn FnMut(&PathVertex, Vec3),
    ) -> ShadeCounters {
        pulp::Arch::new().dispatch(|| {
            let chunks = self.lights.chunks();
            let mut shadow_rays = 0;
            let mut bits: Vec<VisibilityBits> = vec![0; chunks.len() * LANES];
            for members in vertices.chunks(LANES) {
                bits.fill(0);
                let mut group = SurfaceGroup::new(members);
                for (index, chunk) in chunks.iter().enumerate() {
                    for light in (0..LANES).filter(|light| chunk.used >> light & 1 == 1) {
                        let facing = group.aim(chunk, light);
                        if facing == 0 {
                            continue;
                        }
                        shadow_rays += u64::from(facing.count_ones());
                        let seeing = group.seeing(self.accel, facing);
                        for point in 0..members.len() {
                            bits[point * chunks.len() + index] |=
                                ((seeing >> point & 1) << light) as VisibilityBits;
                        }
                    }
                }
                let mut scaled = |vertex: &PathVertex, light: Vec3| emit(vertex, light * self.scale);
                emit_seen(&self.lights, members, &bits, &mut scaled);
            }
            ShadeCounters { shadow_rays, ..ShadeCounters::default() }
        })
    }
}
