//! Gathering: what the points of a surface mesh see around them.

use std::f32::consts::PI;
use std::ops::Range;

use glam::Vec3;
use pulp::NullaryFnOnce;
use rayon::prelude::*;

use super::cells::Cell;
use super::directions::HemisphereDirections;
use super::gathered::{Gathered, GatheredRay};
use super::last_place::LastPlace;
use super::points::{NO_POINT, SurfacePoints};
use super::survey::line_between;
use crate::accel::{Accel, Coherence, LaneMask, PacketLanes, RayHitPacket, RayPacket, hit_of_lane};
use crate::light_mesh::direct_light::{Candidate, DirectLight, Square};
use crate::light_mesh::packed_colour::PackedColour;
use crate::sampling::hash_to_unit_cube;
use crate::scene::{Ray, SurfacePoint};
use crate::simd::{LANES, vectorize};
use crate::world::World;

/// Rays of a packet.
const WIDTH: usize = 16;
/// Points that gather before what they hit is placed: while few cells are known, places of hits have to be kept.
const POINTS_PER_BATCH: usize = 1024;
/// Points per parallel task.
const POINTS_PER_TASK: usize = 16;
/// Light in a cell is uneven where it differs by more than this part of its mean.
const UNEVEN: f32 = 0.5;

/// What is gathered: how, and with which rays.
pub struct Gather<'a, A> {
    /// The world.
    pub world: World<'a, A>,
    /// What direct light is multiplied by before k_d.
    pub scale: f32,
    /// The directions.
    pub directions: &'a HemisphereDirections,
    /// Which of them.
    pub range: Range<u32>,
    /// Width of cells per distance up to which their mean light will do where it is even.
    pub fineness: f32,
    /// Rays to emitters.
    pub emitter_samples: u32,
}

/// A ray that ended at a surface that sends light on.
#[derive(Clone, Copy)]
struct Arrival {
    /// Its index among the task's.
    ray: u32,
    /// Where it ended.
    surface: SurfacePoint,
    diffuse: Vec3,
    distance: f32,
    /// In [0, 1), evenly spread over the rays of a point: chooses a light.
    number: f32,
}

/// A task's share.
#[derive(Default)]
struct Part {
    emitted: Vec<Vec3>,
    closeness: Vec<f32>,
    gathered: Vec<GatheredRay>,
    /// By ray: what comes along it from lights over one reflection.
    direct: Vec<Vec3>,
    /// Rays that ended in cells that were not surveyed.
    open: Vec<Arrival>,
    scratch: DirectLight,
    /// Other rays.
    rays: u64,
}

impl<A: Accel> Gather<'_, A> {
    /// Traces the rays of some points; cells that they end in are surveyed. Returns what they see, and the number of rays to lights,
    /// between points and in surveys.
    pub fn run(&self, points: &mut SurfacePoints, numbers: Vec<u32>) -> (Gathered, u64) {
        let mut gathered = Gathered::default();
        let mut rays = 0;
        for batch in numbers.chunks(POINTS_PER_BATCH) {
            rays += self.add_batch(points, batch, &mut gathered);
        }
        gathered.ends = (1..=numbers.len()).map(|index| index * self.range.len()).collect();
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
        let ends = parts.iter().flat_map(|part| &part.open);
        let cells: Vec<Cell> = ends.map(|arrival| points.cells.at(0, arrival.surface.position)).collect();
        let mut rays = points.survey(self.world, cells.into_iter());
        let points = &*points;
        let shares: Vec<Vec<f32>> =
            parts.par_iter_mut().map(|part| vectorize(SettleTask { gather: self, points, part })).collect();
        for (part, unknown) in parts.iter().zip(shares) {
            rays += part.rays;
            out.emitted.extend_from_slice(&part.emitted);
            out.closeness.extend_from_slice(&part.closeness);
            out.rays.extend_from_slice(&part.gathered);
            out.shares.extend(unknown);
        }
        rays
    }

    /// Finds, for up to 16 rays, the points that stand for where they ended, and the light of lights there.
    #[inline(always)]
    fn settle(&self, points: &SurfacePoints, arrivals: &[Arrival], last: &mut LastPlace, part: &mut Part) {
        let World { accel, lights, .. } = self.world;
        let width = points.cells.width(0);
        let mut nearest = [[NO_POINT; 2]; WIDTH];
        let mut known: LaneMask = 0;
        for (lane, arrival) in arrivals.iter().enumerate().take(WIDTH) {
            match points.of_next_cell(points.cells.at(0, arrival.surface.position), last) {
                Some(numbers) => {
                    nearest[lane] = points.nearest(numbers, width, &arrival.surface);
                    known |= 1 << lane;
                }
                None => part.open.push(*arrival),
            }
        }
        // Lights are asked about by what the best point knows, seen or not.
        let adviser = nearest.map(|[best, _]| best);
        let lanes = |mask: LaneMask| (0..WIDTH).filter(move |lane| mask >> lane & 1 == 1);
        let divided = |number: u32| number != NO_POINT && points.divided(number);
        // Where a wall divides a cell, the ray's end has to see the point.
        let mut asking =
            lanes(known).filter(|&lane| divided(nearest[lane][0])).fold(0, |mask, lane| mask | 1 << lane);
        for _ in 0..2 {
            if asking == 0 {
                break;
            }
            let mut packet = RayPacket::<WIDTH>::empty();
            for lane in lanes(asking) {
                let point = points.surface(nearest[lane][0]);
                packet.set_lane(lane, &line_between(&arrivals[lane].surface, point, width));
            }
            part.rays += u64::from(asking.count_ones());
            let blocked = asking & accel.occluded_packet(asking, &mut packet, Coherence::Incoherent);
            for lane in lanes(blocked) {
                nearest[lane] = [nearest[lane][1], NO_POINT];
            }
            asking = blocked
                & lanes(blocked)
                    .filter(|&lane| nearest[lane][0] != NO_POINT)
                    .fold(0, |mask, lane| mask | 1 << lane);
        }

        let mut packet = RayPacket::<WIDTH>::empty();
        let mut active: LaneMask = 0;
        let mut offered = [Vec3::ZERO; WIDTH];
        for lane in lanes(known) {
            let Arrival { ray, surface, diffuse, distance, number } = &arrivals[lane];
            let ray = *ray as usize;
            let point = nearest[lane][0];
            part.gathered[ray].point = point;
            let reflected = *diffuse * self.scale;
            let mean = if point == NO_POINT { None } else { points.light(point) };
            if let Some(light) = mean
                && light.unevenness <= UNEVEN
                && width <= self.fineness * distance
            {
                part.direct[ray] = reflected * light.mean;
                continue;
            }
            // A ray stands for a part of the surface.
            let square = Square::new(lights, self.footprint(*distance));
            let chosen = match adviser[lane] {
                NO_POINT => part.scratch.choose(lights, surface, square, *number),
                adviser => points.light(adviser).and_then(|light| light.choose(*number)),
            };
            let Some(Candidate { light, weight }) = chosen else { continue };
            let (chunk, index) = (light as usize / LANES, light as usize % LANES);
            let mut factor = lights.factor(chunk, index, surface) * weight;
            if factor <= 0.0 {
                continue;
            }
            let origin = surface.ray_origin();
            let way = Vec3::from_array(lights.chunks()[chunk].way(index, origin.to_array(), origin, 0));
            factor *= square.factor(&lights.chunks()[chunk], index, surface);
            offered[lane] = reflected * Vec3::from_array(lights.intensity(chunk, index)) * factor;
            // What no number can hold, next to a light of enormous intensity, is left out.
            if offered[lane].is_finite() {
                packet.set_lane(lane, &Ray { t_far: 1.0, ..Ray::new(origin, way) });
                active |= 1 << lane;
            }
        }
        part.rays += u64::from(active.count_ones());
        let blocked = accel.occluded_packet(active, &mut packet, Coherence::Incoherent);
        for lane in lanes(active & !blocked) {
            part.direct[arrivals[lane].ray as usize] = offered[lane];
        }
    }

    /// Width of what a ray stands for at a distance: its share of the hemisphere, of all directions.
    #[inline(always)]
    fn footprint(&self, distance: f32) -> f32 {
        distance * (PI / self.directions.count() as f32).sqrt()
    }

    /// Adds what emitters send to a point, over π and times N: the light of points on them, chosen by their power. Returns the number of
    /// rays.
    #[inline(always)]
    fn add_emitters(&self, surface: &SurfacePoint, sum: &mut Vec3) -> u64 {
        let World { accel, scene, lights, emissive } = self.world;
        let all_direct = emissive.is_empty() || lights.has_emitters();
        let count = if all_direct { 0 } else { self.emitter_samples };
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
        let (mut part, mut last) = (Part::default(), LastPlace::default());
        let mut arrivals = Vec::with_capacity(WIDTH);
        let count = gather.range.len() as f32;
        for &number in numbers {
            let surface = points.surface(number);
            let (directions, turn) = gather.directions.at(points.set(number), surface);
            let directions = &directions[gather.range.start as usize..gather.range.end as usize];
            let origin = surface.ray_origin();
            let shift = hash_to_unit_cube(surface.position).x;
            let (mut emitted, mut closeness) = (Vec3::ZERO, 0.0);
            for (chunk, directions) in directions.chunks(WIDTH).enumerate() {
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
                let first = part.gathered.len();
                part.gathered.resize(first + directions.len(), GatheredRay::NOTHING);
                part.direct.resize(first + directions.len(), Vec3::ZERO);
                for lane in (0..directions.len()).filter(|lane| active >> lane & 1 == 1) {
                    let Some(hit) = hit_of_lane(&packet, lane) else {
                        emitted += scene.background;
                        continue;
                    };
                    let seen = scene.interaction(&hit, turned[lane]);
                    closeness += 1.0 / hit.t;
                    if gather.world.gathers(&seen) {
                        let ours = count * directions[lane].z / PI;
                        let pdf = emissive.pdf(scene, origin, &hit, &seen.point);
                        let weight = ours / gather.pdf(directions[lane].z, pdf);
                        emitted += seen.emission * if weight.is_finite() { weight } else { 0.0 };
                    }
                    if seen.diffuse != Vec3::ZERO {
                        part.gathered[first + lane].diffuse = PackedColour::new(seen.diffuse);
                        let index = (chunk * WIDTH + lane) as u32 + gather.range.start;
                        arrivals.push(Arrival {
                            ray: (first + lane) as u32,
                            surface: seen.point,
                            diffuse: seen.diffuse,
                            distance: hit.t,
                            number: (shift + GOLDEN * index as f32).fract(),
                        });
                    }
                }
                gather.settle(points, &arrivals, &mut last, &mut part);
                arrivals.clear();
            }
            part.rays += gather.add_emitters(surface, &mut emitted);
            part.emitted.push(emitted);
            part.closeness.push(closeness);
        }
        part
    }
}

/// Multiples of it, modulo 1, lie as evenly as any sequence of numbers can.
const GOLDEN: f32 = 0.618_034;

/// Settling the rest of the rays of a task, when all cells are known: returns, by point, all that its rays would bring along over what
/// those bring that end near a point.
struct SettleTask<'a, A> {
    gather: &'a Gather<'a, A>,
    points: &'a SurfacePoints,
    part: &'a mut Part,
}

impl<A: Accel> NullaryFnOnce for SettleTask<'_, A> {
    type Output = Vec<f32>;

    #[inline(always)]
    fn call(self) -> Vec<f32> {
        let Self { gather, points, part } = self;
        let mut last = LastPlace::default();
        for arrivals in std::mem::take(&mut part.open).chunks(WIDTH) {
            gather.settle(points, arrivals, &mut last, part);
        }
        let count = gather.range.len().max(1);
        let of_point = |(index, emitted): (usize, &mut Vec3)| {
            let rays = index * count..(index + 1) * count;
            *emitted += part.direct[rays.clone()].iter().sum::<Vec3>();
            let (mut all, mut known) = (0.0, 0.0);
            for ray in &part.gathered[rays] {
                let amount = ray.diffuse().element_sum();
                all += amount;
                known += if ray.point == NO_POINT { 0.0 } else { amount };
            }
            if known > 0.0 { all / known } else { 1.0 }
        };
        part.emitted.iter_mut().enumerate().map(of_point).collect()
    }
}
