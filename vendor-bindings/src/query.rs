//! Ray queries against a committed scene. None of them can fail or allocate.
//!
//! Rays that are not [valid](crate::packet::is_valid_ray) with [`Scene::largest_coordinate`] hit nothing. They are kept from Embree,
//! whose Debian builds have assertions on and abort on them. So they do on `tnear` < 0, which counts as 0 here.

use std::ptr;

use crate::bindings::{embree3 as v3, embree4 as v4};
use crate::library::Api;
use crate::packet::{INVALID_ID, RayHitPacket, RayPacket};
use crate::ray::{Hit, Ray};
use crate::scene::Scene;

/// Direction components below this part of the largest one become 0, which turns a ray by less than rounding does.
///
/// Embree's boxes take what is below 10⁻¹⁸ for 0, its packets' frusta don't, and lose hits over the difference. With
/// [`MIN_DIRECTION`](crate::packet::MIN_DIRECTION) none is left; nor in the space of an instance, whose map [has no tiny entries
/// either](crate::instance).
const TINY: f32 = 1e-8;

#[inline(always)]
fn without_tiny([x, y, z]: [f32; 3]) -> [f32; 3] {
    let limit = TINY * x.abs().max(y.abs()).max(z.abs());
    [x, y, z].map(|d| if d.abs() < limit { 0.0 } else { d })
}

/// Per-lane flags as Embree wants them: −1 or 0, aligned for the widest packets.
#[repr(align(64))]
struct Valid([i32; 16]);

/// Flags of four lanes by their bits, so that a mask expands in four loads.
const FOUR_LANES: [[i32; 4]; 16] = {
    let mut table = [[0; 4]; 16];
    let mut bits = 0;
    while bits < 16 {
        let mut lane = 0;
        while lane < 4 {
            table[bits][lane] = -((bits as i32 >> lane) & 1);
            lane += 1;
        }
        bits += 1;
    }
    table
};

impl Valid {
    /// The active lanes whose rays Embree takes; their `tnear` is made to be at least 0, and directions without
    /// tiny components.
    #[inline(always)]
    fn new<const N: usize>(active: u32, rays: &mut RayPacket<N>, largest: f32) -> Self {
        let mut valid = Self([0; 16]);
        let usable = rays.valid_lanes(largest);
        for (quad, (lanes, usable)) in valid.0.chunks_exact_mut(4).zip(usable.chunks_exact(4)).enumerate() {
            let wanted = FOUR_LANES[(active >> (4 * quad)) as usize & 15];
            for ((lane, usable), wanted) in lanes.iter_mut().zip(usable).zip(wanted) {
                *lane = usable & wanted;
            }
        }
        for (tnear, valid) in rays.tnear.iter_mut().zip(&valid.0) {
            // No branch, so that it vectorises. No valid lane's is NaN.
            *tnear = if (*valid != 0) & (*tnear < 0.0) { 0.0 } else { *tnear };
        }
        for ((x, y), z) in rays.dir_x.iter_mut().zip(&mut rays.dir_y).zip(&mut rays.dir_z) {
            [*x, *y, *z] = without_tiny([*x, *y, *z]);
        }
        valid
    }
}

/// Valid lanes whose `tfar` is −∞: what an occlusion query makes of a blocked ray, and what no valid
/// ray comes with.
#[inline(always)]
fn blocked<const N: usize>(valid: &Valid, tfar: &[f32; N]) -> u32 {
    let mut mask = 0;
    for (lane, (valid, t)) in valid.0.iter().zip(tfar).enumerate() {
        mask |= (u32::from(*t == f32::NEG_INFINITY) & *valid as u32 & 1) << lane;
    }
    mask
}

#[inline(always)]
fn context3(coherent: bool) -> v3::RTCIntersectContext {
    let flags = if coherent {
        v3::RTC_INTERSECT_CONTEXT_FLAG_COHERENT
    } else {
        v3::RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT
    };
    v3::RTCIntersectContext { flags, filter: None, instID: [INVALID_ID] }
}

#[inline(always)]
fn flags4(coherent: bool) -> v4::RTCRayQueryFlags {
    if coherent { v4::RTC_RAY_QUERY_FLAG_COHERENT } else { v4::RTC_RAY_QUERY_FLAG_INCOHERENT }
}

#[inline(always)]
fn intersect4(coherent: bool) -> v4::RTCIntersectArguments {
    v4::RTCIntersectArguments {
        flags: flags4(coherent),
        feature_mask: v4::RTC_FEATURE_FLAG_ALL,
        context: ptr::null_mut(),
        filter: None,
        intersect: None,
    }
}

#[inline(always)]
fn occluded4(coherent: bool) -> v4::RTCOccludedArguments {
    v4::RTCOccludedArguments {
        flags: flags4(coherent),
        feature_mask: v4::RTC_FEATURE_FLAG_ALL,
        context: ptr::null_mut(),
        filter: None,
        occluded: None,
    }
}

#[inline(always)]
fn raw_ray(ray: &Ray) -> v4::RTCRay {
    let ([org_x, org_y, org_z], [dir_x, dir_y, dir_z]) = (ray.origin, without_tiny(ray.direction));
    v4::RTCRay {
        org_x,
        org_y,
        org_z,
        tnear: ray.tnear.max(0.0),
        dir_x,
        dir_y,
        dir_z,
        time: 0.0,
        tfar: ray.tfar,
        mask: u32::MAX,
        id: 0,
        flags: 0,
    }
}

impl Scene {
    /// Closest hit of one ray.
    #[inline]
    pub fn intersect1(&self, ray: &Ray) -> Option<Hit> {
        if !ray.is_valid(self.largest_coordinate()) {
            return None;
        }
        let mut r = v4::RTCRayHit {
            ray: raw_ray(ray),
            hit: v4::RTCHit {
                Ng_x: 0.0,
                Ng_y: 0.0,
                Ng_z: 0.0,
                u: 0.0,
                v: 0.0,
                primID: INVALID_ID,
                geomID: INVALID_ID,
                instID: [INVALID_ID],
                instPrimID: [INVALID_ID],
            },
        };
        // SAFETY: the scene is committed; the struct is version 4's, of which version 3's is a prefix
        // (see `layout`); the context is initialised.
        unsafe {
            match self.api() {
                Api::V3(embree) => {
                    let mut context = context3(false);
                    (embree.rtcIntersect1)(self.handle(), &mut context, (&raw mut r).cast());
                }
                Api::V4(embree) => (embree.rtcIntersect1)(self.handle(), &mut r, ptr::null_mut()),
            }
        }
        (r.hit.geomID != INVALID_ID).then(|| Hit {
            t: r.ray.tfar,
            u: r.hit.u,
            v: r.hit.v,
            prim_id: r.hit.primID,
            geom_id: r.hit.geomID,
            inst_id: r.hit.instID[0],
        })
    }

    /// Whether anything lies on one ray.
    #[inline]
    pub fn occluded1(&self, ray: &Ray) -> bool {
        if !ray.is_valid(self.largest_coordinate()) {
            return false;
        }
        let mut r = raw_ray(ray);
        // SAFETY: as in `intersect1`.
        unsafe {
            match self.api() {
                Api::V3(embree) => {
                    let mut context = context3(false);
                    (embree.rtcOccluded1)(self.handle(), &mut context, (&raw mut r).cast());
                }
                Api::V4(embree) => (embree.rtcOccluded1)(self.handle(), &mut r, ptr::null_mut()),
            }
        }
        r.tfar == f32::NEG_INFINITY
    }

    /// Closest hits of the lanes whose bit is set in `active`; `N` is 4, 8 or 16.
    ///
    /// Lanes that hit get `ray.tfar` and `hit` filled; all others stay as they are, so `geom_id` and
    /// `inst_id` should come as [`INVALID_ID`]. `coherent` is a hint for rays with neighbouring origins
    /// and directions, and changes no answer.
    #[inline(always)]
    pub fn intersect_packet<const N: usize>(
        &self,
        active: u32,
        packet: &mut RayHitPacket<N>,
        coherent: bool,
    ) {
        const { assert!(N == 4 || N == 8 || N == 16, "packets have 4, 8 or 16 rays") };
        if N == 16 && !self.is_native(16) && self.is_native(8) {
            self.intersect_halves(active, packet, coherent);
        } else {
            self.intersect_whole(active, packet, coherent);
        }
    }

    /// [`Scene::intersect_packet`] of a packet as it is.
    #[inline(always)]
    fn intersect_whole<const N: usize>(&self, active: u32, packet: &mut RayHitPacket<N>, coherent: bool) {
        let lanes = Valid::new(active, &mut packet.ray, self.largest_coordinate());
        if !self.is_native(N) {
            self.intersect_lanes(&lanes, packet);
            return;
        }
        let (valid, scene, packet) = (lanes.0.as_ptr(), self.handle(), ptr::from_mut(packet));
        // SAFETY: the scene is committed; flags and packet are aligned and of the layout of N lanes
        // (see `layout`); the packet is borrowed mutably.
        unsafe {
            match self.api() {
                Api::V3(embree) => {
                    let mut context = context3(coherent);
                    match N {
                        4 => (embree.rtcIntersect4)(valid, scene, &mut context, packet.cast()),
                        8 => (embree.rtcIntersect8)(valid, scene, &mut context, packet.cast()),
                        _ => (embree.rtcIntersect16)(valid, scene, &mut context, packet.cast()),
                    }
                }
                Api::V4(embree) => {
                    let mut arguments = intersect4(coherent);
                    match N {
                        4 => (embree.rtcIntersect4)(valid, scene, packet.cast(), &mut arguments),
                        8 => (embree.rtcIntersect8)(valid, scene, packet.cast(), &mut arguments),
                        _ => (embree.rtcIntersect16)(valid, scene, packet.cast(), &mut arguments),
                    }
                }
            }
        }
    }

    /// The lanes of `active` that are blocked; `N` is 4, 8 or 16. Blocked lanes have their `tfar` set
    /// to −∞, all others stay as they are.
    #[inline(always)]
    pub fn occluded_packet<const N: usize>(
        &self,
        active: u32,
        packet: &mut RayPacket<N>,
        coherent: bool,
    ) -> u32 {
        const { assert!(N == 4 || N == 8 || N == 16, "packets have 4, 8 or 16 rays") };
        if N == 16
            && self.is_native(8)
            && (!self.is_native(16) || coherent && matches!(self.api(), Api::V3(_)))
        {
            // Processors with AVX2 and no AVX-512 have packets of 8. Where there are such of 16, Debian's 3.13.5 never
            // returns from some coherent occlusion queries: its AVX-512 code stores 16 bits of a lane mask and
            // reads back 64. Two coherent packets of 8 are faster than an incoherent one of 16.
            self.occluded_halves(active, packet, coherent)
        } else {
            self.occluded_whole(active, packet, coherent)
        }
    }

    /// [`Scene::occluded_packet`] of a packet as it is.
    #[inline(always)]
    fn occluded_whole<const N: usize>(&self, active: u32, packet: &mut RayPacket<N>, coherent: bool) -> u32 {
        let lanes = Valid::new(active, packet, self.largest_coordinate());
        if !self.is_native(N) {
            return self.occluded_lanes(&lanes, packet);
        }
        let (valid, scene, rays) = (lanes.0.as_ptr(), self.handle(), ptr::from_mut(packet));
        // SAFETY: as in `intersect_packet`.
        unsafe {
            match self.api() {
                Api::V3(embree) => {
                    let mut context = context3(coherent);
                    match N {
                        4 => (embree.rtcOccluded4)(valid, scene, &mut context, rays.cast()),
                        8 => (embree.rtcOccluded8)(valid, scene, &mut context, rays.cast()),
                        _ => (embree.rtcOccluded16)(valid, scene, &mut context, rays.cast()),
                    }
                }
                Api::V4(embree) => {
                    let mut arguments = occluded4(coherent);
                    match N {
                        4 => (embree.rtcOccluded4)(valid, scene, rays.cast(), &mut arguments),
                        8 => (embree.rtcOccluded8)(valid, scene, rays.cast(), &mut arguments),
                        _ => (embree.rtcOccluded16)(valid, scene, rays.cast(), &mut arguments),
                    }
                }
            }
        }
        blocked(&lanes, &packet.tfar)
    }

    /// A packet of 16 as two of 8.
    #[inline(always)]
    fn occluded_halves<const N: usize>(&self, active: u32, packet: &mut RayPacket<N>, coherent: bool) -> u32 {
        let mut mask = 0;
        for first in [0, 8] {
            let lanes = active >> first & 0xff;
            if lanes == 0 {
                continue;
            }
            let mut half = half_of(packet, first);
            mask |= self.occluded_whole(lanes, &mut half, coherent) << first;
            packet.tfar[first..first + 8].copy_from_slice(&half.tfar);
        }
        mask
    }

    /// The same of a closest-hit query.
    #[inline(always)]
    fn intersect_halves<const N: usize>(&self, active: u32, packet: &mut RayHitPacket<N>, coherent: bool) {
        for first in [0, 8] {
            let lanes = active >> first & 0xff;
            if lanes == 0 {
                continue;
            }
            let eight = first..first + 8;
            let mut half =
                RayHitPacket { ray: half_of(&packet.ray, first), hit: RayHitPacket::<8>::empty().hit };
            self.intersect_whole(lanes, &mut half, coherent);
            packet.ray.tfar[eight.clone()].copy_from_slice(&half.ray.tfar);
            let (from, to) = (&half.hit, &mut packet.hit);
            for lane in (0..8).filter(|lane| from.geom_id[*lane] != INVALID_ID) {
                to.ng_x[first + lane] = from.ng_x[lane];
                to.ng_y[first + lane] = from.ng_y[lane];
                to.ng_z[first + lane] = from.ng_z[lane];
                to.u[first + lane] = from.u[lane];
                to.v[first + lane] = from.v[lane];
                to.prim_id[first + lane] = from.prim_id[lane];
                to.geom_id[first + lane] = from.geom_id[lane];
                to.inst_id[first + lane] = from.inst_id[lane];
            }
        }
    }

    /// [`Scene::intersect_packet`] where the processor has no packets at all. Version 3 would pass over the
    /// lane mask there, and trace inactive lanes as well.
    #[cold]
    fn intersect_lanes<const N: usize>(&self, lanes: &Valid, packet: &mut RayHitPacket<N>) {
        for lane in (0..N).filter(|lane| lanes.0[*lane] != 0) {
            if let Some(hit) = self.intersect1(&ray_of_lane(&packet.ray, lane)) {
                packet.ray.tfar[lane] = hit.t;
                packet.hit.u[lane] = hit.u;
                packet.hit.v[lane] = hit.v;
                packet.hit.prim_id[lane] = hit.prim_id;
                packet.hit.geom_id[lane] = hit.geom_id;
                packet.hit.inst_id[lane] = hit.inst_id;
            }
        }
    }

    /// [`Scene::occluded_packet`] in the same case.
    #[cold]
    fn occluded_lanes<const N: usize>(&self, lanes: &Valid, packet: &mut RayPacket<N>) -> u32 {
        let mut mask = 0;
        for lane in (0..N).filter(|lane| lanes.0[*lane] != 0) {
            if self.occluded1(&ray_of_lane(packet, lane)) {
                packet.tfar[lane] = f32::NEG_INFINITY;
                mask |= 1 << lane;
            }
        }
        mask
    }
}

/// Eight lanes of a packet, from `first` on.
#[inline(always)]
fn half_of<const N: usize>(packet: &RayPacket<N>, first: usize) -> RayPacket<8> {
    let eight = |lanes: &[f32; N]| std::array::from_fn(|lane| lanes[first + lane]);
    let RayPacket { org_x, org_y, org_z, tnear, dir_x, dir_y, dir_z, tfar, .. } = packet;
    let [org_x, org_y, org_z, tnear] = [org_x, org_y, org_z, tnear].map(eight);
    let [dir_x, dir_y, dir_z, tfar] = [dir_x, dir_y, dir_z, tfar].map(eight);
    RayPacket { org_x, org_y, org_z, tnear, dir_x, dir_y, dir_z, tfar, ..RayPacket::empty() }
}

fn ray_of_lane<const N: usize>(packet: &RayPacket<N>, lane: usize) -> Ray {
    Ray {
        origin: [packet.org_x[lane], packet.org_y[lane], packet.org_z[lane]],
        direction: [packet.dir_x[lane], packet.dir_y[lane], packet.dir_z[lane]],
        tnear: packet.tnear[lane],
        tfar: packet.tfar[lane],
    }
}
