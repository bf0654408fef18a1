//! Which integrator `auto` takes (method §10).
//!
//! Costs are estimated in occlusion rays of conventional shading, from counts alone: the choice is part of the image, which must
//! not depend on time. A scene whose settings can be met by both ways is tried on a few tiles. What the trial evaluates of
//! the light mesh stays known, so that it costs little where the light mesh is taken.

use glam::Vec3;
use rayon::prelude::*;

use super::error::RenderError;
use super::frame::{BlockIntegrator, Frame};
use super::integrators::LightMeshIntegrator;
use super::meshes::LightMeshes;
use super::need::needed_points;
use super::paths::{PathVertex, TilePaths};
use super::reason::{Choice, Reason};
use super::stats::{HybridError, RenderStats, ShadeCounters, timed};
use super::surface_group::SurfaceGroup;
use super::tiles::{TILE, Tile};
use crate::accel::Accel;
use crate::lights::PackedLights;
use crate::scene::Camera;
use crate::settings::{IndirectForm, IndirectSettings, Integrator, Settings};
use crate::simd::LANES;

/// In images too small for a trial, from so many lights above the horizon on the light mesh is taken.
const MANY_LIGHTS: f32 = 4.0;

/// The part of the tiles that is tried, in groups of 2 × 2, at most so many groups, and the least number of groups for which
/// there is a trial.
const TRIED: f32 = 0.02;
const MOST_TRIED: usize = 8;
const LEAST_GROUPS: usize = 20;

/// Costs in rays of conventional shading: of a surface point in conventional shading and in hybrid shading, of a ray
/// from a mesh point, and of a ray from a surface point in hybrid shading. They are what `lightmesh bench scenes` measured
/// where the two ways cost about the same: among leaves, and under few lights. Where packets of neighbouring pixels see the same, a ray
/// of hybrid shading costs twice as much, but there the light mesh is far ahead.
const CONVENTIONAL_POINT: f32 = 2.0;
const HYBRID_POINT: f32 = 3.5;
const MESH_RAY: f32 = 1.5;
const HYBRID_RAY: f32 = 1.0;

/// What a light mesh has to save, as a share of conventional shading: who is level is exact, and the estimate is one.
const LEAST_SAVED: f32 = 0.1;

/// Whether settings ask for nothing that only a light mesh gives.
pub(super) fn is_open(settings: &Settings) -> bool {
    // Light from points on surfaces goes with either.
    let in_space = |indirect: &IndirectSettings| indirect.form != IndirectForm::Surface;
    settings.shading.is_hybrid() && !settings.mesh.indirect.as_ref().is_some_and(in_space)
}

/// Takes an integrator for a frame.
///
/// # Errors
/// See [`RenderError`].
pub(super) fn choose<A: Accel>(
    frame: &Frame<A>,
    camera: &Camera,
    settings: &Settings,
    meshes: &mut LightMeshes,
    stats: &mut RenderStats,
) -> Result<Choice, RenderError> {
    let shading = &settings.shading;
    if !is_open(settings) {
        return Ok(Choice { integrator: Integrator::LightMesh, reason: Reason::Settings });
    }
    let by_lights = |integrator, lights| Ok(Choice { integrator, reason: Reason::Lights(lights) });
    let world = frame.world;
    if world.lights.is_empty() {
        return by_lights(Integrator::Conventional, 0.0);
    }
    let (groups, whole) = trial_tiles(frame.view.resolution);
    let tiles: Vec<Tile> = groups.concat();
    let mut paths = Vec::new();
    frame.trace(&tiles, &mut paths, stats)?;
    let points: usize = paths.iter().map(|paths| paths.vertices.len()).sum();
    let conventional: u64 = paths.par_iter().map(|paths| facing(world.lights, &paths.vertices)).sum();
    let lights = conventional as f32 / points.max(1) as f32;
    if whole < LEAST_GROUPS {
        let many = lights >= MANY_LIGHTS;
        return by_lights(if many { Integrator::LightMesh } else { Integrator::Conventional }, lights);
    }

    let interpolation = meshes.interpolation(world.scene, camera, settings)?;
    let per_point = {
        let lookup = meshes.direct.view(world.lights, &interpolation.direct).lookup;
        let needed = |paths: &[TilePaths]| needed_points(paths, lookup).len() as f32;
        let alone: f32 = paths.iter().map(|paths| needed(std::slice::from_ref(paths))).sum();
        let together: f32 = paths.chunks(4).map(needed).sum();
        mesh_points_per_pixel(alone / tiles.len() as f32, together / groups.len() as f32)
            * tiles.iter().map(Tile::pixels).sum::<usize>() as f32
            / points.max(1) as f32
    };
    let mut integrator = LightMeshIntegrator {
        world,
        direct: &mut meshes.direct,
        indirect: None,
        interpolation: &interpolation,
    };
    integrator.evaluate(&paths, stats);
    let mut shade = stats.seconds.shade;
    let tried: Vec<ShadeCounters> = timed(&mut shade, || {
        let shade = |(tile, paths): (&Tile, &TilePaths)| {
            integrator.shade(tile, paths, &mut vec![Vec3::ZERO; paths.vertices.len()], None)
        };
        tiles.par_iter().zip(&paths).map(shade).collect()
    });
    stats.seconds.shade = shade;
    let hybrid: u64 = tried.iter().map(|counters| counters.shadow_rays).sum();
    stats.rays.shadow += hybrid;
    let mut error = HybridError::default();
    tried.iter().for_each(|counters| error.add(counters.hybrid_error));
    if let Some(mistaken) = error.share().filter(|&error| error > shading.tolerance) {
        return Ok(Choice { integrator: Integrator::Conventional, reason: Reason::Mistaken(mistaken) });
    }
    let share = (HYBRID_POINT
        + MESH_RAY * per_point * world.lights.len() as f32
        + HYBRID_RAY * hybrid as f32 / points.max(1) as f32)
        / (CONVENTIONAL_POINT + lights);
    let integrator =
        if share <= 1.0 - LEAST_SAVED { Integrator::LightMesh } else { Integrator::Conventional };
    Ok(Choice { integrator, reason: Reason::Trial(share) })
}

/// Tiles to try, in groups of 2 × 2 (at the borders fewer) that lie all over the image; and the number of groups of the whole
/// image.
fn trial_tiles((width, height): (u32, u32)) -> (Vec<Vec<Tile>>, usize) {
    let (columns, rows) = (width.div_ceil(2 * TILE), height.div_ceil(2 * TILE));
    let whole = columns as usize * rows as usize;
    let count = ((whole as f32 * TRIED) as usize).clamp(1, MOST_TRIED);
    let tile = |x: u32, y: u32| {
        let (x, y) = (x * TILE, y * TILE);
        (x < width && y < height).then(|| Tile {
            x,
            y,
            width: TILE.min(width - x),
            height: TILE.min(height - y),
        })
    };
    let group = |number: usize| {
        // Multiples of these, modulo 1, cover the square evenly (Roberts, 2018).
        let at = |step: f32, count: u32| {
            let place = (0.5 + step * number as f32).fract();
            (place * count as f32) as u32
        };
        let (x, y) = (2 * at(0.754_877_7, columns), 2 * at(0.569_840_3, rows));
        [(0, 0), (1, 0), (0, 1), (1, 1)]
            .into_iter()
            .filter_map(move |(dx, dy)| tile(x + dx, y + dy))
            .collect()
    };
    ((0..count).map(group).collect(), whole)
}

/// Mesh points per pixel of the whole image, from the mean numbers that a tile and a group of 2 × 2 tiles need.
///
/// Neighbouring tiles share points: a square of side a needs (α·(a + margin))² of them, of which tile and group give α, and a
/// large image α² per pixel.
fn mesh_points_per_pixel(tile: f32, group: f32) -> f32 {
    ((group.sqrt() - tile.sqrt()) / TILE as f32).powi(2)
}

/// Number of rays that conventional shading traces from some surface points.
fn facing(lights: &PackedLights, vertices: &[PathVertex]) -> u64 {
    let rays = |points: &[PathVertex]| -> u64 {
        let mut group = SurfaceGroup::new(points);
        let mut rays = 0;
        for chunk in lights.chunks() {
            for light in 0..chunk.used.count_ones() as usize {
                rays += u64::from(group.aim(chunk, light).count_ones());
            }
        }
        rays
    };
    vertices.chunks(LANES).map(rays).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Trial tiles are tiles of the image, all different, and few.
    #[test]
    fn trial_tiles_lie_in_the_image() {
        for resolution in [(1, 1), (33, 65), (800, 600), (1920, 1080), (5000, 40)] {
            let (groups, whole) = trial_tiles(resolution);
            let tiles = groups.concat();
            assert!(!tiles.is_empty() && groups.len() <= MOST_TRIED && groups.len() <= whole);
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
        let density = mesh_points_per_pixel(needed(TILE as f32), needed(2.0 * TILE as f32));
        assert!((density * (TILE * TILE) as f32 - 16.0).abs() < 1e-3);
    }
}
