//! The wavefront: what all integrators share (spec §9).

use std::time::Instant;

use glam::Vec3;
use rayon::prelude::*;

use super::camera_rays::CameraRays;
use super::paths::{PathVertex, TilePaths, trace_paths};
use super::stats::{RenderStats, add_since};
use super::tiles::{Tile, blocks};
use super::{Film, Progress};
use crate::accel::Accel;
use crate::light_mesh::PointMask;
use crate::scene::{Camera, Scene, SurfacePoint};
use crate::settings::Settings;

/// What differs between the integrators: how the surface points of a block get their light.
pub(super) trait BlockIntegrator: Sync {
    /// Whether there are mesh points that have to be evaluated for the whole image at once.
    fn wants_whole_image(&self) -> bool {
        false
    }

    /// Those of them that the paths need: bricks and masks.
    fn needed_for_whole_image(&self, _paths: &[TilePaths]) -> Vec<(u64, u64)> {
        Vec::new()
    }

    /// Evaluates what [`needed_for_whole_image`](BlockIntegrator::needed_for_whole_image) gave for all blocks.
    fn prepare_whole_image(&mut self, _needed: PointMask, _stats: &mut RenderStats) {}

    /// Makes ready what the surface points of a block need.
    fn prepare(&mut self, paths: &[TilePaths], stats: &mut RenderStats);

    /// Shades surface points of a tile: fills `light` with one E for each, such that k_d·E is the light sent back.
    fn shade(&self, tile: &Tile, vertices: &[PathVertex], light: &mut [Vec3]) -> ShadeCounters;
}

/// What shading one tile counted.
#[derive(Clone, Copy, Default)]
pub(super) struct ShadeCounters {
    pub shadow_rays: u64,
    pub direct_fallbacks: u64,
    pub indirect_fallbacks: u64,
}

/// Pixels per block: enough to keep all threads busy and packets full, at some 100 bytes of path each.
const BLOCK_PIXELS: u64 = 1 << 20;

/// Renders with an integrator.
pub(super) fn wavefront<A: Accel, I: BlockIntegrator>(
    accel: &A,
    scene: &Scene,
    camera: &Camera,
    settings: &Settings,
    integrator: &mut I,
    progress: &dyn Progress,
) -> (Film, RenderStats) {
    let (width, height) = settings.resolution;
    let total = u64::from(width) * u64::from(height);
    let mut film = Film { resolution: settings.resolution, pixels: vec![[0.0; 3]; total as usize] };
    let mut stats = RenderStats::default();
    let camera = CameraRays::new(camera, settings.resolution, settings.samples_per_pixel);
    let block_pixels = settings.block_pixels.unwrap_or(BLOCK_PIXELS) / u64::from(settings.samples_per_pixel);
    let blocks = blocks(settings.resolution, block_pixels);
    let trace_block = |block: &[Tile], stats: &mut RenderStats| -> Vec<TilePaths> {
        let start = Instant::now();
        let paths = block.par_iter().map(|tile| trace_paths(accel, scene, &camera, settings, tile)).collect();
        add_since(&mut stats.seconds.paths, start);
        paths
    };

    // Light that passes between surfaces several times is solved for at once, so that blocks leave no trace.
    let mut only_block = None;
    let mut needed = Vec::new();
    for block in &blocks {
        if !integrator.wants_whole_image() {
            break;
        }
        let paths = trace_block(block, &mut stats);
        needed.extend(integrator.needed_for_whole_image(&paths));
        if blocks.len() == 1 {
            only_block = Some(paths);
        }
    }
    if integrator.wants_whole_image() {
        let start = Instant::now();
        integrator.prepare_whole_image(PointMask::union(needed), &mut stats);
        add_since(&mut stats.seconds.mesh, start);
    }

    let mut done = 0;
    for block in &blocks {
        let paths = only_block.take().unwrap_or_else(|| trace_block(block, &mut stats));
        for tile in &paths {
            stats.rays.camera += tile.camera_rays;
            stats.rays.reflection += tile.reflection_rays;
        }

        let start = Instant::now();
        integrator.prepare(&paths, &mut stats);
        add_since(&mut stats.seconds.mesh, start);

        let start = Instant::now();
        let shaded: Vec<(Vec<Vec3>, ShadeCounters)> = block
            .par_iter()
            .zip(&paths)
            .map(|(tile, paths)| shade_tile(integrator, tile, paths, settings.samples_per_pixel))
            .collect();
        for (tile, (pixels, counters)) in block.iter().zip(&shaded) {
            for (row, values) in (tile.y..).zip(pixels.chunks(tile.width as usize)) {
                let at = row as usize * width as usize + tile.x as usize;
                for (pixel, value) in film.pixels[at..].iter_mut().zip(values) {
                    *pixel = value.to_array();
                }
            }
            stats.rays.shadow += counters.shadow_rays;
            stats.mesh_points.direct.nearest_fallback += counters.direct_fallbacks;
            stats.mesh_points.indirect.nearest_fallback += counters.indirect_fallbacks;
            done += tile.pixels() as u64;
        }
        add_since(&mut stats.seconds.shade, start);
        progress.pixels(done, total);
    }
    (film, stats)
}

/// Radiance of a tile's pixels: eqs. (6) and (8), the sum over each path of weight · (Emiss + k_d · I).
fn shade_tile<I: BlockIntegrator>(
    integrator: &I,
    tile: &Tile,
    paths: &TilePaths,
    samples: u32,
) -> (Vec<Vec3>, ShadeCounters) {
    let mut pixels = paths.background.clone();
    debug_assert_eq!(pixels.len(), tile.pixels());
    let mut light = vec![Vec3::ZERO; paths.vertices.len()];
    let counters = integrator.shade(tile, &paths.vertices, &mut light);
    for (vertex, light) in paths.vertices.iter().zip(light) {
        let SurfacePoint { emission, diffuse, .. } = vertex.surface;
        pixels[vertex.pixel as usize] += vertex.weight * (emission + diffuse * light);
    }
    let scale = 1.0 / samples as f32;
    pixels.iter_mut().for_each(|pixel| *pixel *= scale);
    (pixels, counters)
}

/// What I(y) is multiplied by before k_d: 1, or 1/π for Lambertian reflectors (spec §12).
pub(super) fn direct_scale(settings: &Settings) -> f32 {
    if settings.lambertian { std::f32::consts::FRAC_1_PI } else { 1.0 }
}
