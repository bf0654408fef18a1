//! First stage: the camera paths of a tile, steps 2 and 3 of the paper's algorithm, as a wavefront.

use std::ops::Range;

use glam::Vec3;
use pulp::NullaryFnOnce;

use super::merge::{SampleMerger, Seen};
use super::paths::TilePaths;
use super::spared::{SMALL, SeenTriangle, SparedRays};
use super::tiles::Tile;
use crate::accel::{
    Accel, Coherence, INVALID_ID, LaneMask, PacketLanes, RayHitPacket, hit_of_lane, on_triangle_of,
};
use crate::scene::{CameraRays, Hit, Interaction, Ray, Scene};
use crate::settings::ViewSettings;
use crate::simd::{each_lane, vectorize};
use crate::world::World;

/// A camera ray or reflection under way.
struct Pending {
    ray: Ray,
    weight: Vec3,
    pixel: u32,
}

/// Rays of a camera packet.
pub const WIDTH: usize = 16;

/// All of them.
const ALL: LaneMask = (1 << WIDTH) - 1;

/// How many culled back faces a camera ray may pass: more are taken for a trap (coincident faces).
const MAX_PASSES: u32 = 1024;

/// Traces the camera paths of a tile; what `paths` held before is gone, but its memory is used again.
pub fn trace_paths<A: Accel>(
    world: World<A>,
    camera: &CameraRays,
    view: &ViewSettings,
    spared: Option<&SparedRays>,
    tile: &Tile,
    paths: &mut TilePaths,
) {
    if paths.first.is_some() {
        vectorize(TracePaths::<A, true> { world, camera, view, spared, tile, paths });
    } else {
        vectorize(TracePaths::<A, false> { world, camera, view, spared, tile, paths });
    }
}

/// The camera paths of a tile, as work for the best instruction set. What `LAYERS` need is kept by code of its own: in passing it took a sixth of the
/// time without any.
struct TracePaths<'a, A, const LAYERS: bool> {
    world: World<'a, A>,
    camera: &'a CameraRays,
    view: &'a ViewSettings,
    spared: Option<&'a SparedRays>,
    tile: &'a Tile,
    paths: &'a mut TilePaths,
}

impl<A: Accel, const LAYERS: bool> NullaryFnOnce for TracePaths<'_, A, LAYERS> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { world, camera, view, spared, tile, paths } = self;
        trace_tile::<A, LAYERS>(world, camera, view, spared, tile, paths);
    }
}

#[inline(always)]
fn trace_tile<A: Accel, const LAYERS: bool>(
    world: World<A>,
    camera: &CameraRays,
    view: &ViewSettings,
    spared: Option<&SparedRays>,
    tile: &Tile,
    paths: &mut TilePaths,
) {
    let samples = view.samples_per_pixel;
    paths.vertices.clear();
    paths.vertices.reserve(tile.pixels());
    paths.origins.clear();
    paths.origin_ends.clear();
    paths.radiance.clear();
    paths.radiance.resize(tile.pixels(), Vec3::ZERO);
    paths.camera_rays = 0;
    paths.reflection_rays = 0;
    if let Some(first) = &mut paths.first {
        first.start(camera, tile.pixels());
    }
    let World { accel, scene, .. } = world;
    let merger = SampleMerger::new(camera.footprint(), tile.pixels(), samples);
    let mut tracer = Tracer::<A, LAYERS> { accel, scene, paths, merger, reflections: Vec::new(), view };
    let more = view.most_samples() - samples;
    let mut square = Vec::with_capacity(WIDTH);
    for pixels in tile.squares() {
        square.clear();
        square.extend(pixels);
        let first = (tracer.paths.vertices.len(), tracer.reflections.len());
        match spared.filter(|_| square.len() == WIDTH) {
            Some(spared) => tracer.trace_by_parts(camera, spared, &square, samples),
            None => tracer.trace_square(camera, &square, 0..samples),
        }
        if more > 0 {
            tracer.merger.keep_mixed(&mut square, samples);
            tracer.trace_square(camera, &square, samples..samples + more);
        }
        tracer.merger.finish(tracer.paths);
        if more > 0 {
            let pixels = square.iter().map(|&(_, _, pixel)| pixel);
            tracer.weaken(pixels, samples as f32 / (samples + more) as f32, first);
        }
    }
    let TilePaths { first, radiance, vertices, .. } = &mut *tracer.paths;
    if let Some(first) = first {
        first.end_camera_rays(radiance, vertices.len());
    }
    let mut wave = std::mem::take(&mut tracer.reflections);
    let mut depth = 2;
    while !wave.is_empty() {
        tracer.paths.reflection_rays += wave.len() as u64;
        let mut rays = wave.into_iter().peekable();
        while rays.peek().is_some() {
            tracer.trace(rays.by_ref().take(WIDTH), depth, Coherence::Incoherent);
        }
        tracer.merger.finish(tracer.paths);
        wave = std::mem::take(&mut tracer.reflections);
        depth += 1;
    }
}

struct Tracer<'a, A, const LAYERS: bool> {
    accel: &'a A,
    scene: &'a Scene,
    view: &'a ViewSettings,
    paths: &'a mut TilePaths,
    merger: SampleMerger,
    reflections: Vec<Pending>,
}

impl<A: Accel, const LAYERS: bool> Tracer<'_, A, LAYERS> {
    /// Traces some samples of the camera rays of up to 16 pixels, given by column, row, and index within the tile.
    #[inline(always)]
    fn trace_square(&mut self, camera: &CameraRays, pixels: &[(u32, u32, u32)], samples: Range<u32>) {
        let pending =
            |x, y, pixel, sample| Pending { ray: camera.ray(x, y, sample), weight: Vec3::ONE, pixel };
        if samples.len() == 1 {
            let rays = pixels.iter().map(|&(x, y, pixel)| pending(x, y, pixel, samples.start));
            self.paths.camera_rays += pixels.len() as u64;
            self.trace(rays, 1, Coherence::Coherent);
            return;
        }
        if samples.len().is_multiple_of(WIDTH) {
            for &(x, y, pixel) in pixels {
                for first in samples.clone().step_by(WIDTH) {
                    self.trace_pixel(camera, (x, y, pixel), first, None);
                }
            }
            return;
        }
        let rays = pixels
            .iter()
            .flat_map(|&(x, y, pixel)| samples.clone().map(move |sample| pending(x, y, pixel, sample)));
        self.paths.camera_rays += pixels.len() as u64 * samples.len() as u64;
        let mut rays = rays.peekable();
        while rays.peek().is_some() {
            self.trace(rays.by_ref().take(WIDTH), 1, Coherence::Coherent);
        }
    }

    /// Takes up the camera rays of 4×4 pixels; samples that lie between others that see one triangle need none of their own.
    #[inline(always)]
    fn trace_by_parts(
        &mut self,
        camera: &CameraRays,
        spared: &SparedRays,
        pixels: &[(u32, u32, u32)],
        samples: u32,
    ) {
        let Some(&(left, top, _)) = pixels.first() else { return };
        let corner = (left, top);
        let rays = &mut self.paths.camera_rays;
        let seen = spared.seen(self.accel, self.scene, camera, corner, rays);
        for &(x, y, pixel) in pixels {
            let seen = seen[((y - top) / SMALL * 2 + (x - left) / SMALL) as usize];
            for first in (0..samples).step_by(WIDTH) {
                self.trace_pixel(camera, (x, y, pixel), first, seen);
            }
        }
    }

    /// Takes up sixteen samples of a pixel; they are traced unless it is known what all of them see.
    #[inline(always)]
    fn trace_pixel(
        &mut self,
        camera: &CameraRays,
        (x, y, pixel): (u32, u32, u32),
        first: u32,
        seen: Option<SeenTriangle>,
    ) {
        let mut packet = RayHitPacket::<WIDTH>::empty();
        let origin = camera.origin();
        let [dir_x, dir_y, dir_z] = camera.directions(x, y, first);
        let RayHitPacket { ray, hit } = &mut packet;
        (ray.org_x, ray.org_y, ray.org_z) = ([origin.x; WIDTH], [origin.y; WIDTH], [origin.z; WIDTH]);
        (ray.dir_x, ray.dir_y, ray.dir_z) = (dir_x, dir_y, dir_z);
        (ray.tnear, ray.tfar) = ([0.0; WIDTH], [f32::INFINITY; WIDTH]);
        (hit.geom_id, hit.inst_id) = ([INVALID_ID; WIDTH], [INVALID_ID; WIDTH]);
        match seen {
            Some(seen) => seen.meet(&mut packet),
            None => {
                self.paths.camera_rays += WIDTH as u64;
                self.accel.intersect_packet(ALL, &mut packet, Coherence::Coherent);
            }
        }
        let mut left = ALL;
        while left != 0 {
            let lanes = left & on_triangle_of(&packet, left.trailing_zeros() as usize);
            left &= !lanes;
            if self.arrive_together(pixel, &packet, lanes) {
                continue;
            }
            for lane in each_lane(lanes) {
                let direction = Vec3::new(dir_x[lane], dir_y[lane], dir_z[lane]);
                let pending = Pending { ray: Ray::new(origin, direction), weight: Vec3::ONE, pixel };
                self.arrive(&pending, hit_of_lane(&packet, lane), 1);
            }
        }
    }

    /// Multiplies all that camera rays of some pixels found by a factor: each of them counts for less. The first of their vertices and
    /// reflections are given.
    #[inline(always)]
    fn weaken(&mut self, pixels: impl Iterator<Item = u32> + Clone, factor: f32, first: (usize, usize)) {
        for pixel in pixels.clone() {
            self.paths.radiance[pixel as usize] *= factor;
        }
        for vertex in &mut self.paths.vertices[first.0..] {
            if pixels.clone().any(|pixel| pixel == vertex.pixel) {
                vertex.reflectance *= factor;
            }
        }
        for reflection in &mut self.reflections[first.1..] {
            if pixels.clone().any(|pixel| pixel == reflection.pixel) {
                reflection.weight *= factor;
            }
        }
    }

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

    /// Takes up what those samples of a pixel found that hit one triangle, which is no mirror: mostly they are all. Returns whether it did.
    #[inline(always)]
    fn arrive_together(&mut self, pixel: u32, packet: &RayHitPacket<WIDTH>, lanes: LaneMask) -> bool {
        let RayHitPacket { ray, hit: hits } = packet;
        let first = lanes.trailing_zeros() as usize;
        let Some(hit) = hit_of_lane(packet, first).filter(|_| lanes & (lanes - 1) != 0) else { return false };
        let direction = Vec3::new(ray.dir_x[first], ray.dir_y[first], ray.dir_z[first]);
        let (seen, positions) = self.scene.interaction_of_lanes(&hit, lanes, &hits.u, &hits.v, direction);
        if seen.culled || self.is_mirrored(seen.specular, 1) {
            return false;
        }
        let surface = seen.point;
        let mut farthest = 0.0f32;
        for lane in 0..WIDTH {
            let [x, y, z] = [0, 1, 2].map(|axis| positions[axis][lane] - surface.position[axis]);
            let distance = if lanes >> lane & 1 == 1 { x * x + y * y + z * z } else { 0.0 };
            farthest = if distance > farthest { distance } else { farthest };
        }
        if !self.merger.is_narrow(&surface, farthest.sqrt()) {
            return false;
        }
        let above = surface.geometric_normal * surface.offset;
        let [x, y, z] = positions;
        let origins = each_lane(lanes).map(|lane| Vec3::new(x[lane], y[lane], z[lane]) + above);
        let samples = lanes.count_ones();
        let reflectance = seen.diffuse * samples as f32;
        let emission = seen.emission * samples as f32;
        self.paths.radiance[pixel as usize] += emission;
        if LAYERS && let Some(first) = &mut self.paths.first {
            first.add(self.scene, pixel, &hit, &seen, samples);
        }
        self.merger.add(Seen { surface, reflectance, emission, pixel, samples }, origins, self.paths);
        true
    }

    /// Whether a reflection of this weight is followed at the surface point of this number.
    #[inline(always)]
    fn is_mirrored(&self, weight: Vec3, depth: u32) -> bool {
        weight.max_element() > self.view.weight_threshold && depth < self.view.max_depth
    }

    /// Takes up what a ray found.
    #[inline(always)]
    fn arrive(&mut self, pending: &Pending, hit: Option<Hit>, depth: u32) {
        let mut hit = hit;
        let pixel = pending.pixel;
        let Some(seen) = self.first_visible(&pending.ray, &mut hit) else {
            let background = pending.weight * self.scene.background;
            self.paths.radiance[pixel as usize] += background;
            if LAYERS && let Some(first) = &mut self.paths.first {
                if depth > 1 { first.reflect(pixel, background) } else { first.miss(pixel) }
            }
            return;
        };
        let emission = pending.weight * seen.emission;
        self.paths.radiance[pixel as usize] += emission;
        if LAYERS && let (Some(first), Some(hit)) = (&mut self.paths.first, hit) {
            if depth > 1 {
                first.reflect(pixel, emission)
            } else {
                first.add(self.scene, pixel, &hit, &seen, 1)
            }
        }
        let surface = seen.point;
        let reflectance = pending.weight * seen.diffuse;
        let seen_once = Seen { surface, reflectance, emission, pixel, samples: 1 };
        self.merger.add(seen_once, [surface.ray_origin()], self.paths);
        let weight = pending.weight * seen.specular;
        if self.is_mirrored(weight, depth) {
            let direction = pending.ray.direction;
            let mirrored = direction.reflect(surface.shading_normal);
            // A shading normal may turn the reflection below the surface; the geometric one can't.
            let direction = if mirrored.dot(surface.geometric_normal) > 0.0 {
                mirrored
            } else {
                direction.reflect(surface.geometric_normal)
            };
            self.reflections.push(Pending { ray: Ray::new(surface.ray_origin(), direction), weight, pixel });
        }
    }

    /// The first surface on a ray that is not a culled back face (method §7), and in place of the first hit where it was hit.
    #[inline(always)]
    fn first_visible(&self, ray: &Ray, hit: &mut Option<Hit>) -> Option<Interaction> {
        let mut ray = *ray;
        for _ in 0..MAX_PASSES {
            let seen = self.scene.interaction(hit.as_ref()?, ray.direction);
            if !seen.culled {
                return Some(seen);
            }
            let surface = seen.point;
            // On behind the surface, which is the far side of the normal that faces the viewer.
            ray.origin = surface.position - surface.geometric_normal * surface.offset;
            *hit = self.accel.intersect(&ray);
        }
        None
    }
}
