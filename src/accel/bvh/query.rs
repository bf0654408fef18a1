//! The queries: dispatch to an instruction set once per call, then both levels of trees.

use crate::accel::{Accel, Coherence, Hit, INVALID_ID, LaneMask, Ray, RayHitPacket, RayPacket};

use super::blas::Nearest;
use super::lanes::{Lanes, Portable};
use super::node::WIDTH;
use super::packet::{PacketRays, RawRays};
use super::ray::SingleRay;
use super::traverse::{any_hit, nearest_hit};
use super::traverse_packet::{Visit, any_hit_packet, nearest_hit_packet};
use super::{BvhAccel, SimdLevel};

/// Entries of a traversal stack.
pub const STACK: usize = 160;

/// Proof that the processor has what the chosen level needs.
#[derive(Clone, Copy)]
pub enum Dispatch {
    Portable,
    #[cfg(target_arch = "x86_64")]
    Avx2(pulp::x86::V3),
    #[cfg(target_arch = "x86_64")]
    Avx512(pulp::x86::V4),
}

impl Dispatch {
    /// The proof, if the processor has the level.
    pub fn new(level: SimdLevel) -> Option<Self> {
        match level {
            SimdLevel::Portable => Some(Self::Portable),
            #[cfg(target_arch = "x86_64")]
            SimdLevel::Avx2 => pulp::x86::V3::try_new().map(Self::Avx2),
            #[cfg(target_arch = "x86_64")]
            SimdLevel::Avx512 => pulp::x86::V4::try_new().map(Self::Avx512),
            #[cfg(not(target_arch = "x86_64"))]
            SimdLevel::Avx2 | SimdLevel::Avx512 => None,
        }
    }
}

/// Runs an expression with `$simd` bound to the chosen level, compiled for that level.
macro_rules! dispatch {
    ($dispatch:expr, |$simd:ident| $body:expr) => {
        match $dispatch {
            Dispatch::Portable => {
                let $simd = Portable;
                $body
            }
            #[cfg(target_arch = "x86_64")]
            Dispatch::Avx2($simd) => $simd.vectorize(
                #[inline(always)]
                || $body,
            ),
            #[cfg(target_arch = "x86_64")]
            Dispatch::Avx512($simd) => $simd.vectorize(
                #[inline(always)]
                || $body,
            ),
        }
    };
}

impl BvhAccel {
    #[inline(always)]
    fn intersect_with<S: Lanes<WIDTH>>(&self, simd: S, ray: &Ray) -> Option<Hit> {
        let single = SingleRay::new(ray)?;
        let nearest = self.fixed.intersect::<S, STACK>(simd, &single);
        let mut best = None;
        self.offer_fixed(&nearest, &mut best);
        if self.instances.placed.is_empty() {
            return best;
        }
        let t_far = best.map_or(ray.t_far, |hit| hit.t);
        nearest_hit(
            &self.instances.tree,
            simd,
            &single,
            0,
            &mut [0; STACK],
            t_far,
            #[inline(always)]
            |leaf| {
                for &number in &self.instances.leaves[leaf] {
                    self.intersect_placed(simd, number, ray, &mut best);
                }
                best.map_or(ray.t_far, |hit| hit.t)
            },
        );
        best
    }

    #[inline(always)]
    fn intersect_placed<S: Lanes<WIDTH>>(&self, simd: S, number: u32, ray: &Ray, best: &mut Option<Hit>) {
        let Some(placed) = self.instances.placed.get(number as usize) else { return };
        let t_far = best.map_or(ray.t_far, |hit| hit.t);
        let Some(ray) = SingleRay::new(&Ray { t_far, ..placed.to_object.ray(ray) }) else { return };
        let nearest = self.instances.trees[placed.tree].intersect::<S, STACK>(simd, &ray);
        offer_placed(&nearest, placed.instance, best);
    }

    fn offer_fixed(&self, nearest: &Nearest, best: &mut Option<Hit>) {
        if nearest.id != u32::MAX {
            let (instance, triangle) = self.fixed.resolve(nearest.id);
            offer(best, nearest, instance, triangle);
        }
    }

    #[inline(always)]
    fn occluded_with<S: Lanes<WIDTH>>(&self, simd: S, ray: &Ray) -> bool {
        let Some(single) = SingleRay::new(ray) else { return false };
        if self.fixed.occluded::<S, STACK>(simd, &single) {
            return true;
        }
        if self.instances.placed.is_empty() {
            return false;
        }
        any_hit(
            &self.instances.tree,
            simd,
            &single,
            0,
            &mut [0; STACK],
            #[inline(always)]
            |leaf| {
                self.instances.leaves[leaf].iter().any(|&number| {
                    let Some(placed) = self.instances.placed.get(number as usize) else { return false };
                    let Some(ray) = SingleRay::new(&placed.to_object.ray(ray)) else { return false };
                    self.instances.trees[placed.tree].occluded::<S, STACK>(simd, &ray)
                })
            },
        )
    }

    #[inline(always)]
    fn occluded_lanes<K: Lanes<W>, S: Lanes<WIDTH>, const W: usize>(
        &self,
        simd: (K, S),
        rays: &PacketRays<W>,
    ) -> LaneMask {
        let mut blocked = self.fixed.occluded_packet::<K, S, W, STACK>(simd, rays, rays.active);
        if self.instances.placed.is_empty() {
            return blocked;
        }
        let mut remaining = rays.active & !blocked;
        while remaining != 0 {
            let group = rays.group_of(remaining.trailing_zeros() as usize, remaining);
            remaining &= !group.lanes;
            let visit_leaf = |leaf: usize, lanes: LaneMask| {
                let mut found = 0;
                for &number in &self.instances.leaves[leaf] {
                    let Some(placed) = self.instances.placed.get(number as usize) else { break };
                    let local = transformed(rays, placed, lanes & !found);
                    found |= self.instances.trees[placed.tree].occluded_packet::<K, S, W, STACK>(
                        simd,
                        &local,
                        local.active,
                    );
                }
                found
            };
            let mut stack = [0; STACK];
            blocked |= any_hit_packet::<K, S, W, STACK>(
                &self.instances.tree,
                simd,
                rays,
                &group,
                #[inline(always)]
                |visit| match visit {
                    Visit::Leaf(leaf, lanes) => visit_leaf(leaf, lanes),
                    Visit::Alone(start, lane) => {
                        let ray = rays.single(&group, lane);
                        let hit = any_hit(&self.instances.tree, simd.1, &ray, start, &mut stack, |leaf| {
                            visit_leaf(leaf, 1 << lane) != 0
                        });
                        u32::from(hit) << lane
                    }
                },
            );
        }
        blocked
    }

    #[inline(always)]
    fn intersect_lanes<K: Lanes<W>, S: Lanes<WIDTH>, const W: usize>(
        &self,
        simd: (K, S),
        rays: &mut PacketRays<W>,
    ) -> [Option<Hit>; W] {
        let mut found = [None; W];
        let mut nearest = rays.t_far.map(Nearest::none);
        self.fixed.intersect_packet::<K, S, W, STACK>(simd, rays, rays.active, &mut nearest);
        for (nearest, best) in nearest.iter().zip(&mut found) {
            self.offer_fixed(nearest, best);
        }
        if self.instances.placed.is_empty() {
            return found;
        }
        let mut remaining = rays.active;
        let mut stack = [0; STACK];
        while remaining != 0 {
            let group = rays.group_of(remaining.trailing_zeros() as usize, remaining);
            remaining &= !group.lanes;
            let hits = &mut found;
            let mut visit_leaf = |leaf: usize, lanes: LaneMask, rays: &mut PacketRays<W>| {
                for &number in &self.instances.leaves[leaf] {
                    let Some(placed) = self.instances.placed.get(number as usize) else { break };
                    let mut local = transformed(rays, placed, lanes);
                    let mut nearest = local.t_far.map(Nearest::none);
                    let active = local.active;
                    self.instances.trees[placed.tree].intersect_packet::<K, S, W, STACK>(
                        simd,
                        &mut local,
                        active,
                        &mut nearest,
                    );
                    for (lane, nearest) in nearest.iter().enumerate() {
                        offer_placed(nearest, placed.instance, &mut hits[lane]);
                        if let Some(hit) = hits[lane] {
                            rays.t_far[lane] = hit.t;
                        }
                    }
                }
            };
            nearest_hit_packet::<K, S, W, STACK>(
                &self.instances.tree,
                simd,
                rays,
                &group,
                #[inline(always)]
                |visit, rays| match visit {
                    Visit::Leaf(leaf, lanes) => visit_leaf(leaf, lanes, rays),
                    Visit::Alone(start, lane) => {
                        let ray = rays.single(&group, lane);
                        let t_far = ray.t_far;
                        nearest_hit(&self.instances.tree, simd.1, &ray, start, &mut stack, t_far, |leaf| {
                            visit_leaf(leaf, 1 << lane, rays);
                            rays.t_far[lane % W]
                        });
                    }
                },
            );
        }
        found
    }
}

/// The rays `lanes` in the object space of an instance.
#[inline(always)]
fn transformed<const W: usize>(
    rays: &PacketRays<W>,
    placed: &super::scene_tree::Placed,
    lanes: LaneMask,
) -> PacketRays<W> {
    let (mut origin, mut direction) = ([[0.0; W]; 3], [[0.0; W]; 3]);
    for lane in 0..W {
        let point = placed.to_object.point(rays.origin.map(|axis| axis[lane]));
        let along = placed.to_object.direction(rays.direction.map(|axis| axis[lane]));
        for axis in 0..3 {
            origin[axis][lane] = point[axis];
            direction[axis][lane] = along[axis];
        }
    }
    PacketRays::new(&RawRays { origin, direction, t_near: rays.t_near, t_far: rays.t_far, active: lanes })
}

fn offer_placed(nearest: &Nearest, instance: u32, best: &mut Option<Hit>) {
    if nearest.id != u32::MAX {
        offer(best, nearest, instance, nearest.id);
    }
}

/// Takes a hit that is nearer, or as near with a lower instance and triangle.
fn offer(best: &mut Option<Hit>, nearest: &Nearest, instance: u32, triangle: u32) {
    let t = nearest.hit.t;
    let better = best.is_none_or(|best| {
        t < best.t || (t == best.t && (instance, triangle) < (best.instance, best.triangle))
    });
    if better {
        *best = Some(Hit { t, u: nearest.hit.u, v: nearest.hit.v, instance, triangle });
    }
}

#[inline(always)]
fn take<const N: usize, const W: usize>(first: usize, values: &[f32; N]) -> [f32; W] {
    std::array::from_fn(
        #[inline(always)]
        |lane| if first + lane < N { values[first + lane] } else { 0.0 },
    )
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
        dispatch!(self.dispatch, |simd| self.occluded_lanes((simd, simd), &PacketRays::new(raw)))
    }

    fn intersect_narrow(&self, raw: &RawRays<WIDTH>) -> [Option<Hit>; WIDTH] {
        dispatch!(self.dispatch, |simd| self.intersect_lanes((simd, simd), &mut PacketRays::new(raw)))
    }

    #[cfg(target_arch = "x86_64")]
    fn occluded_wide(&self, simd: pulp::x86::V4, raw: &RawRays<16>) -> LaneMask {
        simd.vectorize(
            #[inline(always)]
            || self.occluded_lanes((simd, simd), &PacketRays::new(raw)),
        )
    }

    #[cfg(target_arch = "x86_64")]
    fn intersect_wide(&self, simd: pulp::x86::V4, raw: &RawRays<16>) -> [Option<Hit>; 16] {
        simd.vectorize(
            #[inline(always)]
            || self.intersect_lanes((simd, simd), &mut PacketRays::new(raw)),
        )
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
        dispatch!(self.dispatch, |simd| self.intersect_with(simd, ray))
    }

    fn occluded(&self, ray: &Ray) -> bool {
        dispatch!(self.dispatch, |simd| self.occluded_with(simd, ray))
    }

    fn intersect_packet<const N: usize>(&self, active: LaneMask, packet: &mut RayHitPacket<N>, _: Coherence) {
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
