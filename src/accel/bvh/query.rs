//! The queries, dispatched to an instruction set once per ray or packet.

use pulp::NullaryFnOnce;
#[cfg(target_arch = "x86_64")]
use pulp::x86::{V3, V4};

use crate::accel::{Accel, Coherence, INVALID_ID, LaneMask, RayHitPacket, RayPacket};

use super::lanes::{Lanes, Portable};
use super::node::WIDTH;
use super::packet::{PacketRays, RawRays};
use super::{BvhAccel, SimdLevel};
use crate::scene::{Hit, Ray};

/// Proof that the processor has what the chosen level needs.
#[derive(Clone, Copy)]
pub enum Dispatch {
    Portable,
    #[cfg(target_arch = "x86_64")]
    Avx2(V3),
    #[cfg(target_arch = "x86_64")]
    Avx512(V4),
}

impl Dispatch {
    /// The proof, if the processor has the level.
    pub fn new(level: SimdLevel) -> Option<Self> {
        match level {
            SimdLevel::Portable => Some(Self::Portable),
            #[cfg(target_arch = "x86_64")]
            SimdLevel::Avx2 => V3::try_new().map(Self::Avx2),
            #[cfg(target_arch = "x86_64")]
            SimdLevel::Avx512 => V4::try_new().map(Self::Avx512),
            #[cfg(not(target_arch = "x86_64"))]
            SimdLevel::Avx2 | SimdLevel::Avx512 => None,
        }
    }
}

impl Dispatch {
    /// Runs a task on the level, compiled for it.
    #[inline(always)]
    fn run<T: Task>(self, task: T) -> T::Output {
        match self {
            Self::Portable => task.run(Portable),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(simd) => simd.vectorize(OnLevel { simd, task }),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(simd) => simd.vectorize(OnLevel { simd, task }),
        }
    }
}

/// A query that can be compiled for any level.
trait Task {
    type Output;
    fn run<S: Lanes<WIDTH>>(self, simd: S) -> Self::Output;
}

/// A task bound to a level.
struct OnLevel<S, T> {
    simd: S,
    task: T,
}

impl<S: Lanes<WIDTH>, T: Task> NullaryFnOnce for OnLevel<S, T> {
    type Output = T::Output;

    #[inline(always)]
    fn call(self) -> T::Output {
        self.task.run(self.simd)
    }
}

struct SingleAny<'a>(&'a BvhAccel, &'a Ray);

impl Task for SingleAny<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<S: Lanes<WIDTH>>(self, simd: S) -> bool {
        self.0.occluded_with(simd, self.1)
    }
}

struct SingleNearest<'a>(&'a BvhAccel, &'a Ray);

impl Task for SingleNearest<'_> {
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

struct PacketNearest<'a, const W: usize>(&'a BvhAccel, &'a RawRays<W>);

impl Task for PacketNearest<'_, WIDTH> {
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
impl NullaryFnOnce for OnLevel<V4, PacketNearest<'_, 16>> {
    type Output = [Option<Hit>; 16];

    #[inline(always)]
    fn call(self) -> [Option<Hit>; 16] {
        let PacketNearest(accel, raw) = self.task;
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
        self.dispatch.run(PacketNearest(self, raw))
    }

    #[cfg(target_arch = "x86_64")]
    fn occluded_wide(&self, simd: V4, raw: &RawRays<16>) -> LaneMask {
        simd.vectorize(OnLevel { simd, task: PacketAny(self, raw) })
    }

    #[cfg(target_arch = "x86_64")]
    fn intersect_wide(&self, simd: V4, raw: &RawRays<16>) -> [Option<Hit>; 16] {
        simd.vectorize(OnLevel { simd, task: PacketNearest(self, raw) })
    }

    fn write_hits<const N: usize>(&self, hits: &[Option<Hit>], first: usize, packet: &mut RayHitPacket<N>) {
        for (lane, hit) in hits.iter().enumerate() {
            let Some(hit) = hit else { continue };
            let lane = first + lane;
            packet.ray.tfar[lane] = hit.t;
            packet.hit.u[lane] = hit.u;
            packet.hit.v[lane] = hit.v;
            packet.hit.prim_id[lane] = hit.triangle;
            // Instances under the top level fill the instance id, others the geometry id.
            let fixed = self.fixed.has_instance(hit.instance);
            packet.hit.geom_id[lane] = if fixed { hit.instance } else { 0 };
            packet.hit.inst_id[lane] = if fixed { INVALID_ID } else { hit.instance };
        }
    }
}

impl Accel for BvhAccel {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        self.dispatch.run(SingleNearest(self, ray))
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.dispatch.run(SingleAny(self, ray))
    }

    fn intersect_packet<const N: usize>(&self, active: LaneMask, packet: &mut RayHitPacket<N>, _: Coherence) {
        let active = active & valid_lanes(&packet.ray, self.largest);
        #[cfg(target_arch = "x86_64")]
        if let (Dispatch::Avx512(simd), 16) = (self.dispatch, N) {
            let hits = self.intersect_wide(simd, &lanes_of(&packet.ray, 0, active));
            return self.write_hits(&hits, 0, packet);
        }
        for first in (0..N).step_by(WIDTH) {
            let hits = self.intersect_narrow(&lanes_of(&packet.ray, first, active));
            self.write_hits(&hits, first, packet);
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
