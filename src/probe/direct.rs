//! Light of lights at a probe, with all occlusion rays traced.

use glam::Vec3;
use pulp::NullaryFnOnce;

use super::sensor::{Sensor, Values};
use crate::accel::{Accel, Coherence, LaneMask, RayPacket};
use crate::lights::{IncidentLights, LightChunk, PackedLights};
use crate::simd::{LANES, Lanes};
use crate::world::World;

/// Rays to each part of a lamp that has a size, a sector of a ball or a cluster of emissive triangles; and to parts that these find to be hidden
/// in part, and to clusters nearby: the share that is seen is known to within a hundredth then.
const FIRST_RAYS: u32 = 16;
const ALL_RAYS: u32 = 256;
/// Clusters nearer than so many of their radii are nearby: further away, they are small flat lamps to a few thousandths (method §4).
const NEARBY: f32 = 16.0;

/// Measuring the light of lights at a probe, as work for the best instruction set.
pub struct MeasureDirect<'a, A> {
    /// The world.
    pub world: World<'a, A>,
    /// What is measured.
    pub sensor: Sensor,
    /// Where.
    pub position: Vec3,
    /// Where rays start.
    pub origin: Vec3,
    /// What it is added to.
    pub values: &'a mut Values,
}

impl<A: Accel> NullaryFnOnce for MeasureDirect<'_, A> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { world, sensor, position, origin, values } = self;
        let mut incident =
            Incident { accel: world.accel, lights: world.lights, sensor: &sensor, origin, values };
        world.lights.incident_at(position, &mut incident);
    }
}

struct Incident<'a, A> {
    accel: &'a A,
    lights: &'a PackedLights,
    sensor: &'a Sensor,
    origin: Vec3,
    values: &'a mut Values,
}

impl<A: Accel> IncidentLights for Incident<'_, A> {
    #[inline(always)]
    fn chunk(&mut self, index: usize, direction: &[Lanes; 3], reciprocal: &Lanes) {
        let chunk = &self.lights.chunks()[index];
        let towards = |lane: usize| Vec3::from_array([0, 1, 2].map(|axis| direction[axis][lane]));
        let counts = |lane: usize| {
            chunk.used >> lane & 1 == 1
                && chunk.emitter_size(lane).is_none()
                && reciprocal[lane] > 0.0
                && self.sensor.faces(towards(lane))
        };
        let lit = (0..LANES).filter(|&lane| counts(lane)).fold(0, |mask, lane| mask | 1 << lane);
        let seen = seen(self.accel, chunk, self.origin, lit);
        for lane in (0..LANES).filter(|&lane| seen[lane] > 0.0) {
            let intensity = Vec3::from_array([0, 1, 2].map(|channel| chunk.intensity[channel][lane]));
            self.sensor.add(self.values, towards(lane), intensity * (reciprocal[lane] * seen[lane]));
        }
        for lane in (0..LANES).filter(|&lane| chunk.used >> lane & 1 == 1) {
            let Some(size) = chunk.emitter_size(lane) else { continue };
            let middle = Vec3::from_array(chunk.to_light(lane, self.origin.to_array()));
            let intensity = Vec3::from_array([0, 1, 2].map(|channel| chunk.intensity[channel][lane]));
            if middle.length_squared() > NEARBY * NEARBY * size {
                if reciprocal[lane] <= 0.0 || !self.sensor.faces(towards(lane)) {
                    continue;
                }
                let first = rays_that_pass(self.accel, chunk, lane, self.origin, 0..FIRST_RAYS, |_| {});
                if first == FIRST_RAYS {
                    self.sensor.add(self.values, towards(lane), intensity * reciprocal[lane]);
                }
                if first == 0 || first == FIRST_RAYS {
                    continue;
                }
            }
            self.add_emitter(chunk, lane, intensity);
        }
    }
}

impl<A: Accel> Incident<'_, A> {
    /// Adds what points of a cluster of emissive triangles send, each of them by itself.
    #[inline(always)]
    fn add_emitter(&mut self, chunk: &LightChunk, lane: usize, intensity: Vec3) {
        let mut sum = Values::default();
        rays_that_pass(self.accel, chunk, lane, self.origin, 0..ALL_RAYS, |way| {
            let light = intensity * chunk.emitted_along(lane, way);
            self.sensor.add(&mut sum, Vec3::from_array(way).normalize_or_zero(), light);
        });
        self.values.iter_mut().zip(sum).for_each(|(value, sum)| *value += sum / ALL_RAYS as f32);
    }
}

/// The parts of some lights of a chunk that are seen from a position, 0 for all others.
#[inline(always)]
fn seen<A: Accel>(accel: &A, chunk: &LightChunk, origin: Vec3, lit: LaneMask) -> Lanes {
    let mut seen = [0.0; LANES];
    let mut points: LaneMask = 0;
    for lane in (0..LANES).filter(|lane| lit >> lane & 1 == 1) {
        if chunk.lamp(lane).is_some() {
            let first = rays_that_pass(accel, chunk, lane, origin, 0..FIRST_RAYS, |_| {});
            seen[lane] = if first == 0 || first == FIRST_RAYS {
                first as f32 / FIRST_RAYS as f32
            } else {
                let rest = rays_that_pass(accel, chunk, lane, origin, FIRST_RAYS..ALL_RAYS, |_| {});
                (first + rest) as f32 / ALL_RAYS as f32
            };
        } else {
            points |= 1 << lane;
        }
    }
    let mut packet = from(origin);
    for lane in 0..LANES {
        set_way(&mut packet, lane, chunk.to_light(lane, origin.to_array()));
    }
    let blocked =
        if points == 0 { 0 } else { accel.occluded_packet(points, &mut packet, Coherence::Incoherent) };
    for lane in (0..LANES).filter(|lane| (points & !blocked) >> lane & 1 == 1) {
        seen[lane] = 1.0;
    }
    seen
}

/// The number of rays, of a range of those to different points of a lamp, that nothing stands in the way of; passes their ways on.
#[inline(always)]
fn rays_that_pass<A: Accel>(
    accel: &A,
    chunk: &LightChunk,
    light: usize,
    origin: Vec3,
    rays: std::ops::Range<u32>,
    mut each: impl FnMut([f32; 3]),
) -> u32 {
    let mut passing = 0;
    for first in rays.clone().step_by(LANES) {
        let count = (rays.end - first).min(LANES as u32);
        let mut packet = from(origin);
        for lane in 0..LANES {
            set_way(&mut packet, lane, chunk.way(light, origin.to_array(), origin, first + lane as u32));
        }
        let active = ((1u64 << count) - 1) as LaneMask;
        let blocked = accel.occluded_packet(active, &mut packet, Coherence::Incoherent);
        passing += (active & !blocked).count_ones();
        for lane in (0..LANES).filter(|lane| (active & !blocked) >> lane & 1 == 1) {
            each([packet.dir_x[lane], packet.dir_y[lane], packet.dir_z[lane]]);
        }
    }
    passing
}

/// Rays from a position that end where the ways that they are given do.
#[inline(always)]
fn from(origin: Vec3) -> RayPacket<LANES> {
    let mut packet = RayPacket::empty();
    packet.org_x = [origin.x; LANES];
    packet.org_y = [origin.y; LANES];
    packet.org_z = [origin.z; LANES];
    packet.tnear = [0.0; LANES];
    packet.tfar = [1.0; LANES];
    packet
}

#[inline(always)]
fn set_way(packet: &mut RayPacket<LANES>, lane: usize, [x, y, z]: [f32; 3]) {
    packet.dir_x[lane] = x;
    packet.dir_y[lane] = y;
    packet.dir_z[lane] = z;
}
