//! The conventional tracer (method §10): one occlusion ray per light at every surface point.

use glam::Vec3;
use pulp::NullaryFnOnce;

use super::light_mesh::add_indirect;
use crate::accel::Accel;
use crate::light_mesh::indirect::IndirectView;
use crate::lights::VisibilityBits;
use crate::render::frame::BlockIntegrator;
use crate::render::layers::LightParts;
use crate::render::paths::TilePaths;
use crate::render::shadow_edges::{TileVisibility, smooth_shadow_edges};
use crate::render::stats::{RenderStats, ShadeCounters};
use crate::render::surface_group::{SurfaceGroup, light_of_seen};
use crate::render::tiles::Tile;
use crate::simd::{LANES, vectorize};
use crate::world::World;

/// Shades with all shadow rays traced.
pub struct ConventionalIntegrator<'a, A> {
    /// What is shaded.
    pub world: World<'a, A>,
    /// What direct light is multiplied by before k_d.
    pub scale: f32,
    /// Indirect light in free space, if it is to be added.
    pub(in crate::render) indirect: Option<IndirectView<'a>>,
}

impl<A: Accel> BlockIntegrator for ConventionalIntegrator<'_, A> {
    fn evaluate(&mut self, _: &[TilePaths], _: &mut RenderStats) {}

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

/// Shading of a tile, as work for the best instruction set.
struct Shade<'a, 'p, A> {
    integrator: &'a ConventionalIntegrator<'a, A>,
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
        let ConventionalIntegrator { world: World { accel, lights, .. }, scale, indirect } = integrator;
        let mut shadow_rays = 0;
        let mut visibility = TileVisibility::new(paths.vertices.len(), lights);
        for (first, members) in (0..).step_by(LANES).zip(paths.vertices.chunks(LANES)) {
            let mut group = SurfaceGroup::new(members);
            for (index, chunk) in lights.chunks().iter().enumerate() {
                for light in (0..LANES).filter(|light| chunk.used >> light & 1 == 1) {
                    let facing = group.aim(chunk, light);
                    if facing == 0 {
                        continue;
                    }
                    shadow_rays += u64::from(facing.count_ones());
                    let seeing = group.seeing(*accel, facing);
                    for point in 0..members.len() {
                        visibility.seen_mut(first + point)[index] |=
                            ((seeing >> point & 1) << light) as VisibilityBits;
                    }
                }
            }
            let points = first..first + members.len();
            light_of_seen(lights, members, visibility.rows(points.clone()), &mut light[points]);
        }
        let mut groups = parts.as_mut().and_then(|parts| parts.groups.as_mut());
        if let Some(groups) = &mut groups {
            visibility.add_by_group(lights, &paths.vertices, groups);
        }
        shadow_rays += smooth_shadow_edges(*accel, lights, tile, paths, &visibility, *scale, light, groups);
        light.iter_mut().for_each(|light| *light *= *scale);
        let mut counters = ShadeCounters { shadow_rays, ..ShadeCounters::default() };
        if let Some(indirect) = indirect {
            let light = parts.map_or(light, |parts| &mut parts.indirect);
            add_indirect(*accel, *indirect, paths, light, &mut counters);
        }
        counters
    }
}
