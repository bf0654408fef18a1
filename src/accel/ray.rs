//! Rays and hits, single and in packets; the one convention that all backends share.

use glam::{Affine3A, Vec3};

pub use embree_sys::packet::{HitPacket, INVALID_ID, MAX_COORDINATE, MIN_DIRECTION, RayHitPacket, RayPacket};
use embree_sys::placement;

use crate::scene::Scene;

/// A ray `origin + t * direction` for `t_near <= t <= t_far`.
///
/// The direction need not be normalised; t is in units of its length. Occlusion rays between two
/// points therefore have the difference as direction and `t_far = 1`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Start point, scene units.
    pub origin: Vec3,
    /// Direction, of any length; but where no component reaches [`MIN_DIRECTION`], it is none, and nothing is hit.
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

    /// Whether the ray can hit anything: it has a direction and an interval that is not empty, and no number
    /// that isn't one. `largest` is that of [`largest_coordinate`].
    #[inline(always)]
    pub fn is_valid(&self, largest: f32) -> bool {
        let within = |v: Vec3| v.abs().cmple(Vec3::splat(largest)).all();
        let direction = within(self.direction) && self.direction.abs().max_element() >= MIN_DIRECTION;
        within(self.origin) && direction && self.t_near <= self.t_far && self.t_far >= 0.0
    }
}

/// Largest magnitude of the coordinates of rays that can hit anything in a scene: [`MAX_COORDINATE`], or less
/// where instances scale rays up, but never below 10⁹.
pub fn largest_coordinate(scene: &Scene) -> f32 {
    let placed = scene.instances.iter().filter_map(|instance| instance.to_world.as_ref());
    placed.filter_map(largest_coordinate_of).fold(MAX_COORDINATE, f32::min)
}

/// The same for one placement; `None` for one that can't be undone, whose triangles are never hit: it is
/// not finite, or flattens space to less than 10⁻⁵, or leaves less than 10⁹ for rays.
pub fn largest_coordinate_of(to_world: &Affine3A) -> Option<f32> {
    placement::largest_coordinate(&columns(to_world))
}

/// The axes of a placement, then its origin.
pub(super) fn columns(map: &Affine3A) -> [[f32; 3]; 4] {
    [map.matrix3.x_axis, map.matrix3.y_axis, map.matrix3.z_axis, map.translation].map(|v| v.to_array())
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
