//! Rendering as a wavefront (spec §9): camera paths of an image block → needed mesh points → evaluation in
//! packets → shading.

mod camera_rays;
mod conventional;
mod paths;
mod stats;
mod tiles;

use std::time::Instant;

use glam::Vec3;
use rayon::prelude::*;

pub use camera_rays::CameraRays;
pub use stats::{MeshCounters, RayCounters, RenderStats, StageSeconds};

use self::conventional::see_lights_from_surface;
use self::paths::{PathVertex, TilePaths, trace_paths};
use self::stats::add_since;
use self::tiles::{Tile, blocks};
use crate::accel::Accel;
use crate::light_mesh::{
    DirectMesh, IndirectMesh, LANES, LightTable, MeshError, MeshPoints, NeededPoints, Neighbours, PointMask,
    Scratch, VisibilityBits, expand_bits,
};
use crate::scene::{Camera, Scene, SurfacePoint};
use crate::settings::{Estimator, Integrator, Resolve, Settings};

/// Linear RGB picture, row by row from the top left.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// Columns and rows.
    pub resolution: (u32, u32),
    /// Radiance, linear RGB.
    pub pixels: Vec<[f32; 3]>,
}

/// Hears how far a render is; called from the thread that called [`render`].
pub trait Progress {
    /// A block is done: `done` of `total` pixels.
    fn pixels(&self, done: u64, total: u64);
}

/// A listener that ignores all.
impl Progress for () {
    fn pixels(&self, _: u64, _: u64) {}
}

/// Light meshes of a scene; they keep their values from one render to the next.
pub struct LightMeshes {
    direct: DirectMesh,
    indirect: Option<IndirectMesh>,
}

impl LightMeshes {
    /// Meshes over a scene, with no point known.
    pub fn new(scene: &Scene, settings: &Settings) -> Result<Self, MeshError> {
        let indirect = settings.light_mesh.indirect.as_ref();
        Ok(Self {
            direct: DirectMesh::new(scene, &settings.light_mesh)?,
            indirect: indirect.map(|indirect| IndirectMesh::new(scene, indirect)).transpose()?,
        })
    }
}

/// Renders with light meshes. `meshes` must have been made for the same scene and light-mesh settings.
pub fn render_light_mesh<A: Accel>(
    accel: &A,
    scene: &Scene,
    camera: &Camera,
    settings: &Settings,
    meshes: &mut LightMeshes,
    progress: &dyn Progress,
) -> (Film, RenderStats) {
    let mut integrator = LightMeshIntegrator { accel, scene, settings, meshes };
    let (film, mut stats) = wavefront(accel, scene, camera, settings, &mut integrator, progress);
    let counters = &mut meshes.direct.points.counters;
    counters.nearest_fallback += stats.mesh_points.direct.nearest_fallback;
    stats.mesh_points.direct = *counters;
    stats.light_mesh_bytes = meshes.direct.memory_bytes() as u64;
    if let Some(indirect) = &mut meshes.indirect {
        let counters = &mut indirect.points.counters;
        counters.nearest_fallback += stats.mesh_points.indirect.nearest_fallback;
        stats.mesh_points.indirect = *counters;
        stats.light_mesh_bytes += indirect.memory_bytes() as u64;
    }
    (film, stats)
}

/// Renders with one occlusion ray per light at every surface point.
pub fn render_conventional<A: Accel>(
    accel: &A,
    scene: &Scene,
    camera: &Camera,
    settings: &Settings,
    progress: &dyn Progress,
) -> (Film, RenderStats) {
    let lights = LightTable::of_scene(scene);
    let mut integrator = ConventionalIntegrator { accel, lights, scale: direct_scale(settings) };
    wavefront(accel, scene, camera, settings, &mut integrator, progress)
}

/// Renders with the integrator that the settings name.
pub fn render<A: Accel>(
    accel: &A,
    scene: &Scene,
    camera: &Camera,
    settings: &Settings,
    progress: &dyn Progress,
) -> Result<(Film, RenderStats), MeshError> {
    match settings.integrator {
        Integrator::Conventional => Ok(render_conventional(accel, scene, camera, settings, progress)),
        Integrator::LightMesh => {
            let mut meshes = LightMeshes::new(scene, settings)?;
            Ok(render_light_mesh(accel, scene, camera, settings, &mut meshes, progress))
        }
    }
}

/// What differs between the integrators: how the surface points of a block get their light.
trait BlockIntegrator: Sync {
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

    /// Shades surface points: calls `emit(vertex, E)` for each, E such that k_d·E is the light sent back.
    fn shade(&self, vertices: &[PathVertex], emit: &mut dyn FnMut(&PathVertex, Vec3)) -> ShadeCounters;
}

/// What shading one tile counted.
#[derive(Clone, Copy, Default)]
struct ShadeCounters {
    shadow_rays: u64,
    direct_fallbacks: u64,
    indirect_fallbacks: u64,
}

/// Pixels per block: enough to keep all threads busy and packets full, at some 100 bytes of path each.
const BLOCK_PIXELS: u64 = 1 << 20;

fn wavefront<A: Accel, I: BlockIntegrator>(
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
        let paths = block
            .par_iter()
            .map(|tile| pulp::Arch::new().dispatch(|| trace_paths(accel, scene, &camera, settings, tile)))
            .collect();
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
    let counters = integrator.shade(&paths.vertices, &mut |vertex, illumination| {
        let SurfacePoint { emission, diffuse, .. } = vertex.surface;
        pixels[vertex.pixel as usize] += vertex.weight * (emission + diffuse * illumination);
    });
    let scale = 1.0 / samples as f32;
    pixels.iter_mut().for_each(|pixel| *pixel *= scale);
    (pixels, counters)
}

struct LightMeshIntegrator<'a, A> {
    accel: &'a A,
    scene: &'a Scene,
    settings: &'a Settings,
    meshes: &'a mut LightMeshes,
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
                    neighbours.iter().for_each(|(id, _)| needed.insert(id));
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

    fn shade(&self, vertices: &[PathVertex], emit: &mut dyn FnMut(&PathVertex, Vec3)) -> ShadeCounters {
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
                shadow_rays = shade_traced(
                    self.accel,
                    direct.lights(),
                    vertices,
                    &mut add_indirect,
                    |vertex, seen, mixed| {
                        direct.verdict(self.accel, &vertex.surface, &mut scratch, seen, mixed);
                    },
                );
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

/// What I(y) is multiplied by before k_d: 1, or 1/π for Lambertian reflectors (spec §12).
fn direct_scale(settings: &Settings) -> f32 {
    if settings.lambertian { std::f32::consts::FRAC_1_PI } else { 1.0 }
}

/// Shades with occlusion rays from the surface points to those lights that `decide` leaves open.
///
/// `decide(vertex, seen, undecided)` fills in, per chunk, the lights known to be visible and the lights to ask.
/// Returns the number of rays.
#[inline(always)]
fn shade_traced<A: Accel>(
    accel: &A,
    lights: &LightTable,
    vertices: &[PathVertex],
    emit: &mut dyn FnMut(&PathVertex, Vec3),
    mut decide: impl FnMut(&PathVertex, &mut [VisibilityBits], &mut [VisibilityBits]),
) -> u64 {
    let mut rays = 0;
    let chunks = lights.chunks().len();
    let mut bits = vec![0; chunks * LANES];
    let mut undecided = bits.clone();
    for group in vertices.chunks(LANES) {
        for (point, vertex) in group.iter().enumerate() {
            let range = point * chunks..(point + 1) * chunks;
            decide(vertex, &mut bits[range.clone()], &mut undecided[range]);
        }
        rays += see_lights_from_surface(accel, lights, group, &undecided, &mut bits);
        for (point, vertex) in group.iter().enumerate() {
            let visible = &bits[point * chunks..];
            let illumination = lights.illuminate(&vertex.surface, |chunk| {
                (visible[chunk] != 0).then(|| expand_bits(visible[chunk]))
            });
            emit(vertex, illumination);
        }
    }
    rays
}

struct ConventionalIntegrator<'a, A> {
    accel: &'a A,
    lights: LightTable,
    scale: f32,
}

impl<A: Accel> BlockIntegrator for ConventionalIntegrator<'_, A> {
    fn prepare(&mut self, _: &[TilePaths], _: &mut RenderStats) {}

    fn shade(&self, vertices: &[PathVertex], emit: &mut dyn FnMut(&PathVertex, Vec3)) -> ShadeCounters {
        pulp::Arch::new().dispatch(|| {
            let mut scaled = |vertex: &PathVertex, light: Vec3| emit(vertex, light * self.scale);
            let shadow_rays =
                shade_traced(self.accel, &self.lights, vertices, &mut scaled, |_, seen, undecided| {
                    seen.fill(0);
                    for (bits, chunk) in undecided.iter_mut().zip(self.lights.chunks()) {
                        *bits = chunk.used;
                    }
                });
            ShadeCounters { shadow_rays, ..ShadeCounters::default() }
        })
    }
}
