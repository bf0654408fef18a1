//! Which integrator `auto` takes (method §10).
//!
//! Costs are estimated from counts alone: the choice is part of the image, which must not depend on time. A scene whose
//! settings can be met by both ways is tried on a few tiles. What the trial evaluates of the light mesh stays known, and the
//! tiles are kept, so that it costs next to nothing where the light mesh is taken.

mod costs;
mod trial;

use glam::Vec3;
use pulp::NullaryFnOnce;
use rayon::prelude::*;

use self::costs::{Costs, TileCost};
pub(super) use self::trial::WithTrial;
use self::trial::{Trial, TriedTile};
use super::error::RenderError;
use super::frame::{BlockIntegrator, Frame};
use super::integrators::LightMeshIntegrator;
use super::meshes::LightMeshes;
use super::need::needed_points;
use super::paths::{PathVertex, TilePaths};
use super::reason::{Choice, Reason};
use super::stats::{RenderStats, timed};
use super::surface_group::SurfaceGroup;
use super::tiles::{TILE, Tile};

use crate::accel::Accel;
use crate::light_mesh::lookup::Lookup;
use crate::lights::PackedLights;
use crate::scene::Camera;
use crate::settings::{IndirectForm, IndirectSettings, Integrator, Settings};
use crate::simd::{LANES, vectorize};

/// Under fewer lights above the horizon of a surface point a light mesh never won by more than 6 %: its own work, the same for
/// one light as for many, is about those rays.
const FEW_LIGHTS: f32 = 4.0;

/// In images too small for a trial, from so many lights above the horizon on the light mesh is taken.
const MANY_LIGHTS: f32 = 12.0;

/// The part of the tiles that is tried at most to find out what costs less, and in numbers; the least number of tiles of images for which there is
/// a trial. More tiles are tried, up to the greater number, while it is open whether the light mesh is mistaken: they are kept if it isn't.
const TRIED: f32 = 0.03;
const MOST_TRIED: [usize; 2] = [4, 32];
const LEAST_TILES: usize = 80;

/// Tiles that are tried before the next look at what they say.
const ROUND: usize = 4;

/// Whether settings ask for nothing that only a light mesh gives.
pub(super) fn is_open(settings: &Settings) -> bool {
    // Light from points on surfaces goes with either.
    let in_space = |indirect: &IndirectSettings| indirect.form != IndirectForm::Surface;
    settings.shading.is_hybrid() && !settings.mesh.indirect.as_ref().is_some_and(in_space)
}

/// Takes an integrator for a frame; with a light mesh come the tiles that it was tried on.
///
/// # Errors
/// See [`RenderError`].
pub(super) fn choose<A: Accel>(
    frame: &Frame<A>,
    camera: &Camera,
    settings: &Settings,
    meshes: &mut LightMeshes,
    stats: &mut RenderStats,
) -> Result<(Choice, Vec<TriedTile>), RenderError> {
    let shading = &settings.shading;
    let untried = |integrator, reason| Ok((Choice { integrator, reason }, Vec::new()));
    if !is_open(settings) {
        return untried(Integrator::LightMesh, Reason::Settings);
    }
    let by_lights = |integrator, lights| untried(integrator, Reason::Lights(lights));
    let world = frame.world;
    if world.lights.is_empty() {
        return by_lights(Integrator::Conventional, 0.0);
    }
    let (tiles, whole) = trial_tiles(frame.view.resolution);
    let costs = Costs::of(world.scene.triangle_count(), world.lights);
    let mut paths = Vec::new();
    let mut interpolation = None;
    let mut trial = Trial::default();
    let (mut points, mut rays) = (0, 0);
    for round in tiles.chunks(ROUND) {
        frame.trace(round, &mut paths, stats)?;
        let facing: Vec<u64> = paths
            .par_iter()
            .map(|paths| vectorize(Facing { lights: world.lights, vertices: &paths.vertices }))
            .collect();
        points += paths.iter().map(|paths| paths.vertices.len()).sum::<usize>();
        rays += facing.iter().sum::<u64>();
        let lights = rays as f32 / points.max(1) as f32;
        if lights < FEW_LIGHTS || whole < LEAST_TILES {
            let many = lights >= MANY_LIGHTS;
            return by_lights(if many { Integrator::LightMesh } else { Integrator::Conventional }, lights);
        }
        let interpolation = match &mut interpolation {
            Some(interpolation) => interpolation,
            empty => empty.insert(meshes.interpolation(world.scene, camera, settings)?),
        };
        let direct = &mut meshes.direct;
        let mut integrator = LightMeshIntegrator { world, direct, indirect: None, interpolation };
        integrator.evaluate(&paths, stats);
        let mut shade = stats.seconds.shade;
        timed(&mut shade, || {
            let try_tile = |((tile, paths), facing): ((&Tile, &TilePaths), u64)| {
                let mut light = vec![Vec3::ZERO; paths.vertices.len()];
                let counters = integrator.shade(tile, paths, &mut light, None);
                let lookup = integrator.direct.view(world.lights, &interpolation.direct).lookup;
                let mesh_points = mesh_points_per_pixel(tile, paths, lookup) * tile.pixels() as f32;
                let cost = costs.of_tile(paths.vertices.len(), facing, mesh_points, counters.shadow_rays);
                (TriedTile { tile: *tile, light, counters }, cost)
            };
            let tried = round.par_iter().zip(&paths).zip(facing).map(try_tile);
            let tried: Vec<(TriedTile, TileCost)> = tried.collect();
            trial.add(tried, stats);
        });
        stats.seconds.shade = shade;
        let cost_is_known = trial.tiles.len() >= most_for_cost(whole) || trial.is_cost_clear();
        if cost_is_known && (!trial.saves() || trial.is_mistake_clear(shading.tolerance)) {
            break;
        }
    }
    let (integrator, reason) = trial.verdict(shading.tolerance);
    let tried = if integrator == Integrator::LightMesh { trial.tiles } else { Vec::new() };
    Ok((Choice { integrator, reason }, tried))
}

/// Tiles that are tried at most to find out what costs less, of so many.
fn most_for_cost(whole: usize) -> usize {
    let [least, most] = MOST_TRIED;
    ((whole as f32 * TRIED) as usize).clamp(least, most)
}

/// Tiles to try, all over the image, in the order to try them; and the number of tiles of the whole image.
fn trial_tiles((width, height): (u32, u32)) -> (Vec<Tile>, usize) {
    let (columns, rows) = (width.div_ceil(TILE), height.div_ceil(TILE));
    let whole = columns as usize * rows as usize;
    let mut tiles: Vec<Tile> = Vec::new();
    for number in 0..MOST_TRIED[1] {
        // Multiples of these, modulo 1, cover the square evenly (Roberts, 2018).
        let at = |step: f32, count: u32| {
            let place = (0.5 + step * number as f32).fract();
            (place * count as f32) as u32 * TILE
        };
        let (x, y) = (at(0.754_877_7, columns), at(0.569_840_3, rows));
        let tile = Tile { x, y, width: TILE.min(width - x), height: TILE.min(height - y) };
        if !tiles.contains(&tile) {
            tiles.push(tile);
        }
    }
    (tiles, whole)
}

/// Mesh points per pixel of the whole image, from the numbers that a tile and a quarter of it need.
///
/// Neighbouring tiles share points: a square of side a needs (α·(a + margin))² of them, of which tile and quarter give α, and a
/// large image α² per pixel.
fn mesh_points_per_pixel(tile: &Tile, paths: &TilePaths, lookup: Lookup) -> f32 {
    let (width, height) = (tile.width / 2, tile.height / 2);
    let in_quarter = |vertex: &&PathVertex| {
        let (x, y) = (vertex.pixel % tile.width, vertex.pixel / tile.width);
        (width / 2..width / 2 + width).contains(&x) && (height / 2..height / 2 + height).contains(&y)
    };
    let vertices = paths.vertices.iter().filter(in_quarter).copied().collect();
    let quarter = TilePaths { vertices, ..TilePaths::default() };
    let needed = |paths: &TilePaths| needed_points(std::slice::from_ref(paths), lookup).len() as f32;
    density(tile, needed(paths), needed(&quarter))
}

/// Of a tile and its quarter with so many points each.
fn density(tile: &Tile, tile_points: f32, quarter_points: f32) -> f32 {
    (tile_points.sqrt() - quarter_points.sqrt()).powi(2) / (tile.pixels() as f32 / 4.0)
}

/// Counts the rays that conventional shading traces from some surface points, as work for the best instruction set.
struct Facing<'a> {
    lights: &'a PackedLights,
    vertices: &'a [PathVertex],
}

impl NullaryFnOnce for Facing<'_> {
    type Output = u64;

    #[inline(always)]
    fn call(self) -> u64 {
        let mut rays = 0;
        for points in self.vertices.chunks(LANES) {
            let mut group = SurfaceGroup::new(points);
            for chunk in self.lights.chunks() {
                for light in 0..chunk.used.count_ones() as usize {
                    rays += u64::from(group.aim(chunk, light).count_ones());
                }
            }
        }
        rays
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Trial tiles are tiles of the image, all different, and few.
    #[test]
    fn trial_tiles_lie_in_the_image() {
        for resolution in [(1, 1), (33, 65), (800, 600), (1920, 1080), (5000, 40)] {
            let (tiles, whole) = trial_tiles(resolution);
            assert!(!tiles.is_empty() && tiles.len() <= MOST_TRIED[1] && tiles.len() <= whole);
            for (number, tile) in tiles.iter().enumerate() {
                assert!(tile.x + tile.width <= resolution.0 && tile.y + tile.height <= resolution.1);
                assert!(tile.x % TILE == 0 && tile.y % TILE == 0 && tile.pixels() > 0);
                assert!(!tiles[..number].contains(tile), "{resolution:?}: {tile:?} twice");
            }
        }
    }

    /// Points on a plane, a quarter of a tile apart, needed within one spacing: 16 per tile's area.
    #[test]
    fn shared_mesh_points_are_counted_once() {
        let spacing = TILE as f32 / 4.0;
        let needed = |side: f32| ((side + 2.0 * spacing) / spacing).powi(2);
        let tile = Tile { x: 0, y: 0, width: TILE, height: TILE };
        let density = density(&tile, needed(TILE as f32), needed(TILE as f32 / 2.0));
        assert!((density * tile.pixels() as f32 - 16.0).abs() < 1e-3);
    }
}
