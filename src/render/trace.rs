//! First stage: the camera paths of a tile, steps 2 and 3 of the paper's algorithm, as a wavefront.

use glam::Vec3;
use pulp::NullaryFnOnce;

use super::tiles::Tile;
use crate::accel::{Accel, Coherence, PacketLanes, RayHitPacket, hit_of_lane};
use crate::light_mesh::surface::PixelGroups;
use crate::scene::{CameraRays, Hit, Interaction, PixelFootprint, Ray, Scene, SurfacePoint};
use crate::settings::ViewSettings;
use crate::simd::vectorize;
use crate::world::World;

/// A surface point on a camera path, and how much of its illumination reaches the pixel.
///
/// A block's vertices are written once and read twice from memory: only what that needs is here.
#[derive(Clone, Copy, Debug)]
pub struct PathVertex {
    /// The point.
    pub surface: SurfacePoint,
    /// k_d times the product of the k_s before it.
    pub reflectance: Vec3,
    /// Pixel within the tile.
    pub pixel: u32,
}

/// The camera paths of a tile: all surface points that have to be shaded.
#[derive(Default)]
pub struct TilePaths {
    /// Surface points; those of 16 neighbouring rays follow each other.
    pub vertices: Vec<PathVertex>,
    /// Radiance, summed over the samples of each pixel of the tile: of background and emission once the paths are traced,
    /// of everything once their vertices are shaded.
    pub radiance: Vec<Vec3>,
    /// Camera rays traced.
    pub camera_rays: u64,
    /// Mirror reflections traced.
    pub reflection_rays: u64,
}

impl TilePaths {
    /// The surface points in groups that are close together.
    pub fn groups(&self, footprint: &PixelFootprint) -> PixelGroups {
        pixel_groups(&self.vertices, self.radiance.len(), footprint)
    }
}

/// The surface points of a tile of so many pixels in groups that are close together.
#[inline(always)]
pub fn pixel_groups(vertices: &[PathVertex], pixels: usize, footprint: &PixelFootprint) -> PixelGroups {
    let surfaces = vertices.iter().map(|vertex| (vertex.pixel, &vertex.surface));
    PixelGroups::new(surfaces, pixels, footprint)
}

/// A camera ray or reflection under way.
struct Pending {
    ray: Ray,
    weight: Vec3,
    pixel: u32,
}

/// Rays of a camera packet.
const WIDTH: usize = 16;

/// How many culled back faces a camera ray may pass: more are taken for a trap (coincident faces).
const MAX_PASSES: u32 = 1024;

/// Traces the camera paths of a tile; what `paths` held before is gone, but its memory is used again.
pub fn trace_paths<A: Accel>(
    world: World<A>,
    camera: &CameraRays,
    view: &ViewSettings,
    tile: &Tile,
    paths: &mut TilePaths,
) {
    vectorize(TracePaths { world, camera, view, tile, paths });
}

/// The camera paths of a tile, as work for the best instruction set.
struct TracePaths<'a, A> {
    world: World<'a, A>,
    camera: &'a CameraRays,
    view: &'a ViewSettings,
    tile: &'a Tile,
    paths: &'a mut TilePaths,
}

impl<A: Accel> NullaryFnOnce for TracePaths<'_, A> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { world, camera, view, tile, paths } = self;
        trace_tile(world, camera, view, tile, paths);
    }
}

#[inline(always)]
fn trace_tile<A: Accel>(
    world: World<A>,
    camera: &CameraRays,
    view: &ViewSettings,
    tile: &Tile,
    paths: &mut TilePaths,
) {
    let samples = view.samples_per_pixel;
    paths.vertices.clear();
    paths.vertices.reserve(tile.pixels() * samples as usize);
    paths.radiance.clear();
    paths.radiance.resize(tile.pixels(), Vec3::ZERO);
    paths.camera_rays = (tile.pixels() as u64) * u64::from(samples);
    paths.reflection_rays = 0;
    let World { accel, scene, .. } = world;
    let mut tracer = Tracer { accel, scene, paths, reflections: Vec::new(), view };
    let mut square = Vec::with_capacity(WIDTH);
    for pixels in tile.squares() {
        square.clear();
        square.extend(pixels);
        for sample in 0..samples {
            let rays = square.iter().map(|&(x, y, pixel)| Pending {
                ray: camera.ray(x, y, sample),
                weight: Vec3::ONE,
                pixel,
            });
            tracer.trace(rays, 1, Coherence::Coherent);
        }
    }
    let mut wave = std::mem::take(&mut tracer.reflections);
    let mut depth = 2;
    while !wave.is_empty() {
        tracer.paths.reflection_rays += wave.len() as u64;
        let mut rays = wave.into_iter().peekable();
        while rays.peek().is_some() {
            tracer.trace(rays.by_ref().take(WIDTH), depth, Coherence::Incoherent);
        }
        wave = std::mem::take(&mut tracer.reflections);
        depth += 1;
    }
}

struct Tracer<'a, A> {
    accel: &'a A,
    scene: &'a Scene,
    view: &'a ViewSettings,
    paths: &'a mut TilePaths,
    reflections: Vec<Pending>,
}

impl<A: Accel> Tracer<'_, A> {
    /// Traces up to 16 rays as a packet; `depth` counts the surface points that they lead to, from 1.
    #[inline(always)]
    fn trace(&mut self, rays: impl Iterator<Item = Pending>, depth: u32, coherence: Coherence) {
        let mut packet = RayHitPacket::<WIDTH>::empty();
        let mut pending: [Option<Pending>; WIDTH] = [const { None }; WIDTH];
        let mut active = 0;
        for (lane, (slot, ray)) in pending.iter_mut().zip(rays).enumerate() {
            packet.set_lane(lane, &ray.ray);
            active |= 1 << lane;
            *slot = Some(ray);
        }
        self.accel.intersect_packet(active, &mut packet, coherence);
        for (lane, ray) in pending.iter().enumerate() {
            if let Some(ray) = ray {
                self.arrive(ray, hit_of_lane(&packet, lane), depth);
            }
        }
    }

    /// Takes up what a ray found.
    #[inline(always)]
    fn arrive(&mut self, pending: &Pending, hit: Option<Hit>, depth: u32) {
        let seen = self.first_visible(&pending.ray, hit);
        let radiance = &mut self.paths.radiance[pending.pixel as usize];
        let Some(seen) = seen else {
            *radiance += pending.weight * self.scene.background;
            return;
        };
        *radiance += pending.weight * seen.emission;
        let surface = seen.point;
        let reflectance = pending.weight * seen.diffuse;
        self.paths.vertices.push(PathVertex { surface, reflectance, pixel: pending.pixel });
        let weight = pending.weight * seen.specular;
        if weight.max_element() > self.view.weight_threshold && depth < self.view.max_depth {
            let direction = pending.ray.direction;
            let mirrored = direction.reflect(surface.shading_normal);
            // A shading normal may turn the reflection below the surface; the geometric one can't.
            let direction = if mirrored.dot(surface.geometric_normal) > 0.0 {
                mirrored
            } else {
                direction.reflect(surface.geometric_normal)
            };
            self.reflections.push(Pending {
                ray: Ray::new(surface.ray_origin(), direction),
                weight,
                pixel: pending.pixel,
            });
        }
    }

    /// The first surface on a ray that is not a culled back face (method §7).
    #[inline(always)]
    fn first_visible(&self, ray: &Ray, mut hit: Option<Hit>) -> Option<Interaction> {
        let mut ray = *ray;
        for _ in 0..MAX_PASSES {
            let seen = self.scene.interaction(hit.as_ref()?, ray.direction);
            if !seen.culled {
                return Some(seen);
            }
            let surface = seen.point;
            // On behind the surface, which is the far side of the normal that faces the viewer.
            ray.origin = surface.position - surface.geometric_normal * surface.offset;
            hit = self.accel.intersect(&ray);
        }
        None
    }
}
