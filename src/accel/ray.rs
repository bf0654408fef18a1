//! Rays and hits, single and in packets; the one convention that all backends share.

use glam::Vec3;

pub use embree_sys::packet::{HitPacket, INVALID_ID, RayHitPacket, RayPacket};

/// A ray `origin + t * direction` for `t_near <= t <= t_far`.
///
/// The direction need not be normalised; t is in units of its length. Occlusion rays between two
/// points therefore have the difference as direction and `t_far = 1`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Start point, scene units.
    pub origin: Vec3,
    /// Direction, any length but 0.
    pub direction: Vec3,
    /// Start of the valid interval.
    pub t_near: f32,
    /// End of the valid interval.
    pub t_far: f32,
}

impl Ray {
    /// Ray from `origin` along `direction`, from t = 0 to infinity.
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Self { origin, direction, t_near: 0.0, t_far: f32::INFINITY }
    }

    /// Ray that covers the open segment between two points: t runs from 0 to 1.
    pub fn between(from: Vec3, to: Vec3) -> Self {
        Self { origin: from, direction: to - from, t_near: 0.0, t_far: 1.0 }
    }
}

/// Nearest hit of a ray, the same for every backend.
///
/// The point is `(1 − u − v)·v0 + u·v1 + v·v2` of the named triangle. It carries no normal: normals
/// come from the scene's vertices, so that they don't differ between backends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Ray parameter of the hit.
    pub t: f32,
    /// Barycentric coordinate of the second vertex.
    pub u: f32,
    /// Barycentric coordinate of the third vertex.
    pub v: f32,
    /// Index into [`Scene::instances`](crate::scene::Scene::instances).
    pub instance: u32,
    /// Triangle within the instance's mesh.
    pub triangle: u32,
}

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
