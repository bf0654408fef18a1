//! The wavefront: what all integrators share (spec §9).

use std::time::Instant;

use glam::Vec3;
use rayon::prelude::*;

use super::paths::{PathVertex, TilePaths, trace_paths};
use super::stats::{RenderStats, add_since};
use super::tiles::{TILE, TILES_PER_TASK, Tile, blocks};
use super::{Film, Progress};
use crate::accel::Accel;
use crate::light_mesh::PointMask;
use crate::scene::{Camera, CameraRays, Scene};
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

/// Pixels per block: enough to keep all threads busy and packets full, at some 70 bytes of path each.
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
    let trace_block = |block: &[Tile], paths: &mut Vec<TilePaths>, stats: &mut RenderStats| {
        let start = Instant::now();
        paths.resize_with(block.len(), TilePaths::default);
        block
            .par_iter()
            .zip(&mut *paths)
            .with_max_len(TILES_PER_TASK)
            .for_each(|(tile, paths)| trace_paths(accel, scene, &camera, settings, tile, paths));
        add_since(&mut stats.seconds.paths, start);
    };
    // Kept from block to block: the first use of memory costs a sixth of the camera paths.
    let mut paths: Vec<TilePaths> = Vec::new();

    // Light that passes between surfaces several times is solved for at once, so that blocks leave no trace.
    let mut traced = false;
    if integrator.wants_whole_image() {
        let mut needed = Vec::new();
        for block in &blocks {
            trace_block(block, &mut paths, &mut stats);
            needed.extend(integrator.needed_for_whole_image(&paths));
        }
        traced = blocks.len() == 1;
        let start = Instant::now();
        integrator.prepare_whole_image(PointMask::union(needed), &mut stats);
        add_since(&mut stats.seconds.mesh, start);
    }

    let mut done = 0;
    for block in &blocks {
        if !traced {
            trace_block(block, &mut paths, &mut stats);
        }
        for tile in &paths {
            stats.rays.camera += tile.camera_rays;
            stats.rays.reflection += tile.reflection_rays;
        }

        let start = Instant::now();
        integrator.prepare(&paths, &mut stats);
        add_since(&mut stats.seconds.mesh, start);

        let start = Instant::now();
        let counters: Vec<ShadeCounters> = block
            .par_iter()
            .zip(&mut paths)
            .with_max_len(TILES_PER_TASK)
            .map(|(tile, paths)| shade_tile(integrator, tile, paths))
            .collect();
        for counters in counters {
            stats.rays.shadow += counters.shadow_rays;
            stats.mesh_points.direct.nearest_fallback += counters.direct_fallbacks;
            stats.mesh_points.indirect.nearest_fallback += counters.indirect_fallbacks;
        }
        expose(block, &paths, settings.samples_per_pixel, &mut film);
        add_since(&mut stats.seconds.shade, start);
        done += block.iter().map(|tile| tile.pixels() as u64).sum::<u64>();
        progress.pixels(done, total);
    }
    (film, stats)
}

/// Adds the light that the vertices of a tile send towards the camera: eqs. (6) and (8), the sum over each path of
/// weight · (Emiss + k_d · I), whose first part is there already.
fn shade_tile<I: BlockIntegrator>(integrator: &I, tile: &Tile, paths: &mut TilePaths) -> ShadeCounters {
    let mut light = vec![Vec3::ZERO; paths.vertices.len()];
    let counters = integrator.shade(tile, &paths.vertices, &mut light);
    for (vertex, light) in paths.vertices.iter().zip(light) {
        paths.radiance[vertex.pixel as usize] += vertex.reflectance * light;
    }
    counters
}

/// Puts the pixels of a block on the film: means over their samples.
fn expose(block: &[Tile], paths: &[TilePaths], samples: u32, film: &mut Film) {
    let width = film.resolution.0 as usize;
    let scale = 1.0 / samples as f32;
    // Rows of tiles lie one after the other on the film, and in the block.
    let rows_of_tiles = film.pixels.par_chunks_mut(width * TILE as usize).enumerate();
    rows_of_tiles.with_max_len(1).for_each(|(row, pixels)| {
        let top = row as u32 * TILE;
        let members = block.partition_point(|tile| tile.y < top)..block.partition_point(|tile| tile.y <= top);
        for (tile, paths) in block[members.clone()].iter().zip(&paths[members]) {
            let lines = pixels.chunks_mut(width).zip(paths.radiance.chunks(tile.width as usize));
            for (line, values) in lines {
                for (pixel, value) in line[tile.x as usize..].iter_mut().zip(values) {
                    *pixel = (*value * scale).to_array();
                }
            }
        }
    });
}

/// What I(y) is multiplied by before k_d: 1, or 1/π for Lambertian reflectors (spec §12).
pub(super) fn direct_scale(settings: &Settings) -> f32 {
    if settings.lambertian { std::f32::consts::FRAC_1_PI } else { 1.0 }
}
