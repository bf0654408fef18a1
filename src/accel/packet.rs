//! Packets of rays and hits, lane by lane.

pub use embree_sys::packet::{INVALID_ID, RayHitPacket, RayPacket};

use crate::scene::{Hit, Ray};

/// Set of active lanes of a packet: bit l stands for lane l.
pub type LaneMask = u32;

/// What the caller knows about a packet's rays; a hint that never changes an answer.
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
}

impl<const N: usize> PacketLanes for RayHitPacket<N> {
    #[inline(always)]
    fn set_lane(&mut self, lane: usize, ray: &Ray) {
        self.ray.set_lane(lane, ray);
        self.hit.geom_id[lane] = INVALID_ID;
        self.hit.inst_id[lane] = INVALID_ID;
    }
}

/// Reads lane `lane` after a nearest-hit query; `None` for a miss.
///
/// Geometry that is not instanced carries the instance index as `geom_id`; for instanced geometry
/// `inst_id` does.
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
