//! The queries, dispatched to an instruction set once per ray or packet.

#[cfg(target_arch = "x86_64")]
use pulp::{NullaryFnOnce, x86::V4};

use crate::accel::packet::set_hit_of_lane;
use crate::accel::{Accel, Coherence, LaneMask, RayHitPacket, RayPacket};
use crate::scene::{Hit, Ray};

use super::lanes::Lanes;
use super::level::Task;
#[cfg(target_arch = "x86_64")]
use super::level::{Dispatch, OnLevel};
use super::node::WIDTH;
use super::packet::{PacketRays, RawRays};
use super::structure::BvhAccel;

struct SingleAny<'a>(&'a BvhAccel, &'a Ray);

impl Task for SingleAny<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<S: Lanes<WIDTH>>(self, simd: S) -> bool {
        self.0.occluded_with(simd, self.1)
    }
}

struct SingleClosest<'a>(&'a BvhAccel, &'a Ray);

impl Task for SingleClosest<'_> {
    type Output = Option<Hit>;

    #[inline(always)]
    fn run<S: Lanes<WIDTH>>(self, simd: S) -> Option<Hit> {
        self.0.intersect_with(simd, self.1)
    }
}

struct PacketAny<'a, const W: usize>(&'a BvhAccel, &'a RawRays<W>);

impl Task for PacketAny<'_, WIDTH> {
    type Output = LaneMask;

    #[inline(always)]
    fn run<S: Lanes<WIDTH>>(self, simd: S) -> LaneMask {
        self.0.occluded_lanes((simd, simd), &PacketRays::new(self.1))
    }
}

struct PacketClosest<'a, const W: usize>(&'a BvhAccel, &'a RawRays<W>);

impl Task for PacketClosest<'_, WIDTH> {
    type Output = [Option<Hit>; WIDTH];

    #[inline(always)]
    fn run<S: Lanes<WIDTH>>(self, simd: S) -> [Option<Hit>; WIDTH] {
        self.0.intersect_lanes((simd, simd), &mut PacketRays::new(self.1))
    }
}

/// A packet of sixteen, which only AVX-512 takes as one.
#[cfg(target_arch = "x86_64")]
impl NullaryFnOnce for OnLevel<V4, PacketAny<'_, 16>> {
    type Output = LaneMask;

    #[inline(always)]
    fn call(self) -> LaneMask {
        let PacketAny(accel, raw) = self.task;
        accel.occluded_lanes((self.simd, self.simd), &PacketRays::new(raw))
    }
}

#[cfg(target_arch = "x86_64")]
impl NullaryFnOnce for OnLevel<V4, PacketClosest<'_, 16>> {
    type Output = [Option<Hit>; 16];

    #[inline(always)]
    fn call(self) -> [Option<Hit>; 16] {
        let PacketClosest(accel, raw) = self.task;
        accel.intersect_lanes((self.simd, self.simd), &mut PacketRays::new(raw))
    }
}

#[inline(always)]
fn take<const N: usize, const W: usize>(first: usize, values: &[f32; N]) -> [f32; W] {
    let mut lanes = [0.0; W];
    for (lane, &value) in lanes.iter_mut().zip(&values[first..]) {
        *lane = value;
    }
    lanes
}

/// The lanes with a ray, as a mask.
#[inline(always)]
fn valid_lanes<const N: usize>(packet: &RayPacket<N>, largest: f32) -> LaneMask {
    let valid = packet.valid_lanes(largest);
    valid.iter().enumerate().fold(0, |mask, (lane, &valid)| mask | (valid as u32 & 1) << lane)
}

/// Lanes `first..first + W` of a packet; lanes beyond its end are inactive.
#[inline(always)]
fn lanes_of<const N: usize, const W: usize>(
    packet: &RayPacket<N>,
    first: usize,
    active: LaneMask,
) -> RawRays<W> {
    let present = if N - first >= W { u32::MAX } else { (1 << (N - first)) - 1 };
    RawRays {
        origin: [take(first, &packet.org_x), take(first, &packet.org_y), take(first, &packet.org_z)],
        direction: [take(first, &packet.dir_x), take(first, &packet.dir_y), take(first, &packet.dir_z)],
        t_near: take(first, &packet.tnear),
        t_far: take(first, &packet.tfar),
        active: (active >> first) & present,
    }
}

// Not generic over the packet's size, so that they are compiled once, in this crate.
impl BvhAccel {
    fn occluded_narrow(&self, raw: &RawRays<WIDTH>) -> LaneMask {
        self.dispatch.run(PacketAny(self, raw))
    }

    fn intersect_narrow(&self, raw: &RawRays<WIDTH>) -> [Option<Hit>; WIDTH] {
        self.dispatch.run(PacketClosest(self, raw))
    }

    #[cfg(target_arch = "x86_64")]
    fn occluded_wide(&self, simd: V4, raw: &RawRays<16>) -> LaneMask {
        simd.vectorize(OnLevel { simd, task: PacketAny(self, raw) })
    }

    #[cfg(target_arch = "x86_64")]
    fn intersect_wide(&self, simd: V4, raw: &RawRays<16>) -> [Option<Hit>; 16] {
        simd.vectorize(OnLevel { simd, task: PacketClosest(self, raw) })
    }
}

/// Writes the hits of lanes `first..` of a packet.
fn write_hits<const N: usize>(hits: &[Option<Hit>], first: usize, packet: &mut RayHitPacket<N>) {
    for (lane, hit) in hits.iter().enumerate() {
        if let Some(hit) = hit {
            set_hit_of_lane(packet, first + lane, hit);
        }
    }
}

impl Accel for BvhAccel {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        self.dispatch.run(SingleClosest(self, ray))
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.dispatch.run(SingleAny(self, ray))
    }

    fn intersect_packet<const N: usize>(&self, active: LaneMask, packet: &mut RayHitPacket<N>, _: Coherence) {
        let active = active & valid_lanes(&packet.ray, self.largest);
        #[cfg(target_arch = "x86_64")]
        if let (Dispatch::Avx512(simd), 16) = (self.dispatch, N) {
            let hits = self.intersect_wide(simd, &lanes_of(&packet.ray, 0, active));
            return write_hits(&hits, 0, packet);
        }
        for first in (0..N).step_by(WIDTH) {
            let hits = self.intersect_narrow(&lanes_of(&packet.ray, first, active));
            write_hits(&hits, first, packet);
        }
    }

    fn occluded_packet<const N: usize>(
        &self,
        active: LaneMask,
        packet: &mut RayPacket<N>,
        _: Coherence,
    ) -> LaneMask {
        let active = active & valid_lanes(packet, self.largest);
        #[cfg(target_arch = "x86_64")]
        if let (Dispatch::Avx512(simd), 16) = (self.dispatch, N) {
            return self.occluded_wide(simd, &lanes_of(packet, 0, active));
        }
        let parts = (0..N).step_by(WIDTH);
        parts.map(|first| self.occluded_narrow(&lanes_of(packet, first, active)) << first).sum()
    }

    fn memory_bytes(&self) -> usize {
        self.bytes()
    }
}
