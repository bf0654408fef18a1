//! Gathering: what the points of a surface mesh see around them.

use std::f32::consts::PI;
use std::ops::Range;

use glam::Vec3;
use pulp::NullaryFnOnce;
use rayon::prelude::*;

use super::directions::HemisphereDirections;
use super::points::{FINEST, LastPlace, NO_POINT, SurfacePoints};
use crate::accel::{Accel, Coherence, LaneMask, PacketLanes, RayHitPacket, RayPacket, hit_of_lane};
use crate::light_mesh::packed_colour::PackedColour;
use crate::sampling::hash_to_unit_cube;
use crate::scene::{Ray, SurfacePoint};
use crate::simd::vectorize;
use crate::world::World;

/// Rays of a packet.
const WIDTH: usize = 16;
/// Points that gather before what they hit is placed: while few cells are known, places of hits have to be kept.
const POINTS_PER_BATCH: usize = 1024;
/// Points per parallel task.
const POINTS_PER_TASK: usize = 16;

/// What a ray found.
#[derive(Clone, Copy, Debug)]
pub struct GatheredRay {
    /// Number of the point that stands for the surface that it found, or [`NO_POINT`] where that sends no light on.
    pub point: u32,
    diffuse: PackedColour,
}

impl GatheredRay {
    const NOTHING: Self = Self { point: NO_POINT, diffuse: PackedColour::BLACK };

    /// The point that stands for where it ended, and how much of the light there it brings along, times a weight.
    pub fn carries(self, weight: f32) -> (u32, f32) {
        (self.point, self.diffuse().element_sum() / 3.0 * weight)
    }

    /// k_d where the ray ended.
    #[inline(always)]
    pub fn diffuse(self) -> Vec3 {
        self.diffuse.colour()
    }
}

/// What some points see, each with as many rays.
#[derive(Default)]
pub struct Gathered {
    /// Numbers of the points.
    pub points: Vec<u32>,
    /// Sum over a point's rays of the light that needs no bounce: of emitters and background.
    pub emitted: Vec<Vec3>,
    /// Sum over a point's rays of 1/t.
    pub closeness: Vec<f32>,
    /// By point.
    pub rays: Vec<GatheredRay>,
}

impl Gathered {
    /// The rays of the point of an index, none if it has none.
    #[inline(always)]
    pub fn rays_of(&self, index: usize) -> &[GatheredRay] {
        let count = self.rays.len().checked_div(self.points.len()).unwrap_or(0);
        self.rays.get(index * count..(index + 1) * count).unwrap_or_default()
    }

    /// Adds what other points see with as many rays.
    pub fn append(&mut self, mut other: Self) {
        self.points.append(&mut other.points);
        self.emitted.append(&mut other.emitted);
        self.closeness.append(&mut other.closeness);
        self.rays.append(&mut other.rays);
    }
}

/// What is gathered: how, and with which rays.
pub struct Gather<'a, A> {
    /// The world.
    pub world: World<'a, A>,
    /// The directions.
    pub directions: &'a HemisphereDirections,
    /// Which of them.
    pub range: Range<u32>,
    /// Width of cells per distance: how finely light that comes from far away is told apart.
    pub fineness: f32,
    /// Rays to emitters.
    pub emitter_samples: u32,
}

/// A ray for which the point that is wanted isn't known.
struct Open {
    /// Its index among the task's.
    ray: u32,
    /// Level of the cells to look into next.
    level: u8,
    /// Level of the smallest cells that it asks for.
    finest: u8,
    /// Where it ended.
    surface: SurfacePoint,
}

/// A task's share.
#[derive(Default)]
struct Part {
    emitted: Vec<Vec3>,
    closeness: Vec<f32>,
    gathered: Vec<GatheredRay>,
    /// Rays for which the point that is wanted isn't known.
    open: Vec<Open>,
    rays: u64,
}

impl<A: Accel> Gather<'_, A> {
    /// Traces the rays of some points; cells that they end in are surveyed. Returns what they see, and the number of rays to emitters and
    /// in surveys.
    pub fn run(&self, points: &mut SurfacePoints, numbers: Vec<u32>) -> (Gathered, u64) {
        let mut gathered = Gathered::default();
        let mut rays = 0;
        for batch in numbers.chunks(POINTS_PER_BATCH) {
            rays += self.add_batch(points, batch, &mut gathered);
        }
        gathered.points = numbers;
        (gathered, rays)
    }

    /// Adds what some points see; returns the number of other rays.
    fn add_batch(&self, points: &mut SurfacePoints, numbers: &[u32], out: &mut Gathered) -> u64 {
        let mut parts: Vec<Part> = numbers
            .par_chunks(POINTS_PER_TASK)
            .with_max_len(1)
            .map(|numbers| vectorize(GatherTask { gather: self, points, numbers }))
            .collect();
        let mut rays = parts.iter().map(|part| part.rays).sum::<u64>();
        for level in 0..=FINEST {
            let of_level = |part: &Part| {
                let open = part.open.iter().filter(|open| open.level == level);
                open.map(|open| open.surface).collect::<Vec<SurfacePoint>>()
            };
            let surfaces: Vec<Vec<SurfacePoint>> = parts.iter().map(of_level).collect();
            let tasks: Vec<Vec<&SurfacePoint>> = surfaces.iter().map(|task| task.iter().collect()).collect();
            let (places, traced) = points.place(self.world, level, &tasks);
            rays += traced;
            for (part, places) in parts.iter_mut().zip(places) {
                let mut places = places.into_iter();
                let gathered = &mut part.gathered;
                part.open.retain_mut(|open| {
                    if open.level != level {
                        return true;
                    }
                    open.level += 1;
                    let Some(place) = places.next().flatten() else {
                        // Where a cell has no point for a surface, smaller cells may.
                        return true;
                    };
                    gathered[open.ray as usize].point = place;
                    level < open.finest && points.uneven(place)
                });
            }
        }
        for part in &mut parts {
            for Open { ray, surface, .. } in part.open.drain(..) {
                let point = &mut part.gathered[ray as usize].point;
                if *point == NO_POINT {
                    *point = points.own(self.world, &surface);
                }
            }
            out.emitted.extend_from_slice(&part.emitted);
            out.closeness.extend_from_slice(&part.closeness);
            out.rays.extend_from_slice(&part.gathered);
        }
        rays
    }

    /// Adds what emitters send to a point, over π and times N: the light of points on them, chosen by their power. Returns the number of
    /// rays.
    #[inline(always)]
    fn add_emitters(&self, surface: &SurfacePoint, sum: &mut Vec3) -> u64 {
        let World { accel, scene, emissive, .. } = self.world;
        let count = if emissive.is_empty() { 0 } else { self.emitter_samples };
        let x = surface.ray_origin();
        // Other points for other rays.
        let noise = hash_to_unit_cube(x + self.range.start as f32);
        let mut rays = 0;
        for first in (0..count).step_by(WIDTH) {
            let mut packet = RayPacket::<WIDTH>::empty();
            let mut active: LaneMask = 0;
            let mut found = [Vec3::ZERO; WIDTH];
            for (lane, k) in (first..count.min(first + WIDTH as u32)).enumerate() {
                let Some(sample) = emissive.sample(scene, x, k, count, noise) else { continue };
                let cosine = surface.shading_normal.dot(sample.direction);
                if cosine > 0.0 && surface.geometric_normal.dot(sample.direction) > 0.0 {
                    packet.set_lane(lane, &Ray::between(x, sample.surface.ray_origin()));
                    active |= 1 << lane;
                    found[lane] = sample.emission * (cosine / PI / self.pdf(cosine, sample.pdf));
                }
            }
            rays += u64::from(active.count_ones());
            let blocked = accel.occluded_packet(active, &mut packet, Coherence::Incoherent);
            for (lane, &light) in found.iter().enumerate() {
                if (active & !blocked) >> lane & 1 == 1 {
                    *sum += light * self.range.len() as f32;
                }
            }
        }
        rays
    }

    /// Rays per solid angle in a direction, of both kinds.
    #[inline(always)]
    fn pdf(&self, cosine: f32, emitter: f32) -> f32 {
        self.range.len() as f32 * cosine / PI + self.emitter_samples as f32 * emitter
    }
}

/// Tracing the rays of some points, as work for the best instruction set.
struct GatherTask<'a, A> {
    gather: &'a Gather<'a, A>,
    points: &'a SurfacePoints,
    numbers: &'a [u32],
}

impl<A: Accel> NullaryFnOnce for GatherTask<'_, A> {
    type Output = Part;

    #[inline(always)]
    fn call(self) -> Part {
        let Self { gather, points, numbers } = self;
        let World { accel, scene, emissive, .. } = gather.world;
        let (mut part, mut last) = (Part::default(), <[LastPlace; FINEST as usize + 1]>::default());
        let count = gather.range.len() as f32;
        for &number in numbers {
            let surface = points.surface(number);
            let (directions, turn) = gather.directions.at(points.set(number), surface);
            let directions = &directions[gather.range.start as usize..gather.range.end as usize];
            let origin = surface.ray_origin();
            let (mut emitted, mut closeness) = (Vec3::ZERO, 0.0);
            for directions in directions.chunks(WIDTH) {
                let mut packet = RayHitPacket::<WIDTH>::empty();
                let mut active: LaneMask = 0;
                let mut turned = [Vec3::ZERO; WIDTH];
                for (lane, &direction) in directions.iter().enumerate() {
                    turned[lane] = turn * direction;
                    // Below the surface, which a shading normal may turn it to, nothing is seen.
                    if turned[lane].dot(surface.geometric_normal) > 0.0 {
                        packet.set_lane(lane, &Ray::new(origin, turned[lane]));
                        active |= 1 << lane;
                    }
                }
                accel.intersect_packet(active, &mut packet, Coherence::Incoherent);
                for lane in 0..directions.len() {
                    if active >> lane & 1 == 0 {
                        part.gathered.push(GatheredRay::NOTHING);
                        continue;
                    }
                    let Some(hit) = hit_of_lane(&packet, lane) else {
                        emitted += scene.background;
                        part.gathered.push(GatheredRay::NOTHING);
                        continue;
                    };
                    let seen = scene.interaction(&hit, turned[lane]);
                    closeness += 1.0 / hit.t;
                    if seen.emission != Vec3::ZERO {
                        let ours = count * directions[lane].z / PI;
                        let pdf = emissive.pdf(scene, origin, &hit, &seen.point);
                        let weight = ours / gather.pdf(directions[lane].z, pdf);
                        emitted += seen.emission * if weight.is_finite() { weight } else { 0.0 };
                    }
                    if seen.diffuse == Vec3::ZERO {
                        part.gathered.push(GatheredRay::NOTHING);
                        continue;
                    }
                    let finest = points.level_of(gather.fineness * hit.t);
                    let (mut point, mut level) = (NO_POINT, 0);
                    loop {
                        let last = &mut last[usize::from(level)];
                        let place = last.find(points, accel, level, &seen.point, &mut part.rays);
                        point = place.unwrap_or(point);
                        if place.is_some_and(|place| level >= finest || !points.uneven(place)) {
                            break;
                        }
                        if place.is_none() {
                            let ray = part.gathered.len() as u32;
                            part.open.push(Open { ray, level, finest, surface: seen.point });
                            break;
                        }
                        level += 1;
                    }
                    part.gathered.push(GatheredRay { point, diffuse: PackedColour::new(seen.diffuse) });
                }
            }
            part.rays += gather.add_emitters(surface, &mut emitted);
            part.emitted.push(emitted);
            part.closeness.push(closeness);
        }
        part
    }
}
