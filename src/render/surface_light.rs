//! Light that surfaces send to each other, found at points on surfaces (method §5): it goes with any integrator of direct light.

use std::f32::consts::PI;

use glam::Vec3;
use pulp::NullaryFnOnce;

use super::error::RenderError;
use super::frame::{BlockIntegrator, Frame};
use super::paths::TilePaths;
use super::stats::{RenderStats, ShadeCounters, timed};
use super::tiles::Tile;
use crate::accel::Accel;
use crate::light_mesh::surface::{SurfaceMesh, SurfaceView};
use crate::scene::Camera;
use crate::settings::{Normalization, Settings};
use crate::simd::vectorize;

/// Evaluates what the view of a frame needs of a surface mesh: its records, if they are `known`.
///
/// # Errors
/// [`RenderError::Stopped`].
pub fn evaluate_surface_light<A: Accel>(
    frame: &mut Frame<A>,
    mesh: &mut SurfaceMesh,
    camera: &Camera,
    known: Option<&[(u32, u32)]>,
    stats: &mut RenderStats,
) -> Result<(), RenderError> {
    let (world, resolution) = (frame.world, frame.view.resolution);
    mesh.turn_to(SurfaceView { footprint: camera.pixel_footprint(resolution), height: resolution.1 });
    if let Some(records) = known {
        mesh.need_again(records);
    } else {
        frame.trace_image(stats, |paths, stats| {
            let mut seconds = stats.seconds.mesh;
            timed(&mut seconds, || {
                let surfaces = paths.iter().map(|paths| paths.surfaces().collect()).collect();
                stats.add_surface(mesh.need(world, surfaces));
            });
            stats.seconds.mesh = seconds;
        })?;
    }
    let mut seconds = stats.seconds.mesh;
    timed(&mut seconds, || stats.add_surface(mesh.evaluate(world)));
    stats.seconds.mesh = seconds;
    Ok(())
}

/// Light from surfaces, in a view that it was evaluated for.
pub struct SurfaceLight<'a, A> {
    accel: &'a A,
    mesh: &'a SurfaceMesh,
    /// What it is multiplied by.
    scale: f32,
}

impl<'a, A> SurfaceLight<'a, A> {
    /// Of a mesh, by these settings.
    pub fn new(accel: &'a A, mesh: &'a SurfaceMesh, settings: &Settings) -> Self {
        let scale = match settings.shading.indirect.normalization {
            Normalization::Mean => 1.0,
            Normalization::Integral => 4.0 * PI,
        };
        Self { accel, mesh, scale }
    }
}

/// An integrator of direct light, and light from surfaces if there is any.
pub struct WithSurfaceLight<'a, I, A> {
    /// The integrator.
    pub direct: I,
    /// Light from surfaces.
    pub surface: Option<SurfaceLight<'a, A>>,
}

impl<I: BlockIntegrator, A: Accel> BlockIntegrator for WithSurfaceLight<'_, I, A> {
    fn evaluate(&mut self, paths: &[TilePaths], stats: &mut RenderStats) {
        self.direct.evaluate(paths, stats);
    }

    fn shade(&self, tile: &Tile, paths: &TilePaths, light: &mut [Vec3]) -> ShadeCounters {
        let mut counters = self.direct.shade(tile, paths, light);
        if let Some(surface) = &self.surface {
            counters.shadow_rays += vectorize(Add { surface, paths, light });
        }
        counters
    }
}

/// Adding light from surfaces to that of the surface points of a tile, as work for the best instruction set.
struct Add<'a, A> {
    surface: &'a SurfaceLight<'a, A>,
    paths: &'a TilePaths,
    light: &'a mut [Vec3],
}

impl<A: Accel> NullaryFnOnce for Add<'_, A> {
    type Output = u64;

    #[inline(always)]
    fn call(self) -> u64 {
        let Self { surface: SurfaceLight { accel, mesh, scale }, paths, light } = self;
        mesh.illuminate(*accel, paths.surfaces(), *scale, light)
    }
}
