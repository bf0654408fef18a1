//! Packets of rays and hits, lane by lane.

pub use embree_sys::packet::{INVALID_ID, RayHitPacket, RayPacket};

use glam::Vec3;

use crate::scene::{Hit, Ray};

/// Set of active lanes of a packet: bit l stands for lane l.
pub type LaneMask = u32;

/// How the rays of a packet lie to each other; a hint that never changes an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coherence {
    /// Neighbouring origins and directions: traverse the packet as one.
    Coherent,
    /// Directions diverge.
    Incoherent,
}

/// Access to single lanes of ray packets.
pub trait PacketLanes {
    /// Puts a ray into lane `lane`.
    fn set_lane(&mut self, lane: usize, ray: &Ray);

    /// The ray of lane `lane`.
    fn lane(&self, lane: usize) -> Ray;
}

impl<const N: usize> PacketLanes for RayPacket<N> {
    #[inline(always)]
    fn set_lane(&mut self, lane: usize, ray: &Ray) {
        self.org_x[lane] = ray.origin.x;
        self.org_y[lane] = ray.origin.y;
        self.org_z[lane] = ray.origin.z;
        self.tnear[lane] = ray.t_near;
        self.dir_x[lane] = ray.direction.x;
        self.dir_y[lane] = ray.direction.y;
        self.dir_z[lane] = ray.direction.z;
        self.tfar[lane] = ray.t_far;
    }

    #[inline(always)]
    fn lane(&self, lane: usize) -> Ray {
        Ray {
            origin: Vec3::new(self.org_x[lane], self.org_y[lane], self.org_z[lane]),
            direction: Vec3::new(self.dir_x[lane], self.dir_y[lane], self.dir_z[lane]),
            t_near: self.tnear[lane],
            t_far: self.tfar[lane],
        }
    }
}

impl<const N: usize> PacketLanes for RayHitPacket<N> {
    #[inline(always)]
    fn set_lane(&mut self, lane: usize, ray: &Ray) {
        self.ray.set_lane(lane, ray);
        self.hit.geom_id[lane] = INVALID_ID;
        self.hit.inst_id[lane] = INVALID_ID;
    }

    #[inline(always)]
    fn lane(&self, lane: usize) -> Ray {
        self.ray.lane(lane)
    }
}

/// The lanes below `N` of a mask, in order.
pub(super) fn lanes_of_mask<const N: usize>(mask: LaneMask) -> impl Iterator<Item = usize> {
    (0..N).filter(move |lane| mask >> lane & 1 != 0)
}

/// Reads lane `lane` after a closest-hit query; `None` for a miss.
///
/// The instance index is the packet's `inst_id`, or its `geom_id` where that is [`INVALID_ID`]: Embree fills `inst_id` for
/// instanced geometry only.
#[inline(always)]
pub fn hit_of_lane<const N: usize>(packet: &RayHitPacket<N>, lane: usize) -> Option<Hit> {
    let geometry = packet.hit.geom_id[lane];
    if geometry == INVALID_ID {
        return None;
    }
    let instance = packet.hit.inst_id[lane];
    Some(Hit {
        t: packet.ray.tfar[lane],
        u: packet.hit.u[lane],
        v: packet.hit.v[lane],
        instance: if instance == INVALID_ID { geometry } else { instance },
        triangle: packet.hit.prim_id[lane],
    })
}

/// The lanes of a packet that hit what a lane hit: the same triangle, or nothing.
#[inline(always)]
pub fn on_triangle_of<const N: usize>(packet: &RayHitPacket<N>, lane: usize) -> LaneMask {
    let hits = &packet.hit;
    let (geometry, instance) = (hits.geom_id[lane], hits.inst_id[lane]);
    let nothing = geometry == INVALID_ID;
    let triangle = hits.prim_id[lane];
    let mut same = 0;
    for other in 0..N {
        let is_same = (hits.geom_id[other] == geometry)
            & (nothing | ((hits.inst_id[other] == instance) & (hits.prim_id[other] == triangle)));
        same |= LaneMask::from(is_same) << other;
    }
    same
}

/// Writes the closest hit of lane `lane`, for [`hit_of_lane`] to read.
#[inline(always)]
pub(super) fn set_hit_of_lane<const N: usize>(packet: &mut RayHitPacket<N>, lane: usize, hit: &Hit) {
    packet.ray.tfar[lane] = hit.t;
    packet.hit.u[lane] = hit.u;
    packet.hit.v[lane] = hit.v;
    packet.hit.prim_id[lane] = hit.triangle;
    packet.hit.geom_id[lane] = hit.instance;
    packet.hit.inst_id[lane] = INVALID_ID;
}
