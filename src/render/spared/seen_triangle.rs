//! Where rays meet a triangle that they are known to meet.

use glam::Vec3;

use crate::accel::{INVALID_ID, RayHitPacket, hit_of_lane};
use crate::scene::{CameraRays, Scene};
use crate::simd::LANES;

/// A triangle, or nothing, that all samples of some pixels see.
#[derive(Clone, Copy)]
pub struct SeenTriangle {
    /// Instance, mesh's number in the packet, and triangle, as packets have them.
    ids: [u32; 3],
    /// With D a ray's direction, u = D · `of_u` / D · `normal`, v likewise, t = `along` / D · `normal` (Möller, Trumbore, 1997).
    of_u: Vec3,
    of_v: Vec3,
    normal: Vec3,
    along: f32,
}

impl SeenTriangle {
    /// What the first lane of a packet of camera rays hit.
    #[inline(always)]
    pub fn of_packet(scene: &Scene, camera: &CameraRays, packet: &RayHitPacket<LANES>) -> Self {
        let ids = [packet.hit.geom_id[0], packet.hit.inst_id[0], packet.hit.prim_id[0]];
        let Some(hit) = hit_of_lane(packet, 0) else {
            return Self { ids, of_u: Vec3::ZERO, of_v: Vec3::ZERO, normal: Vec3::ZERO, along: 0.0 };
        };
        let [a, b, c] = scene.corners(&hit);
        let (along_u, along_v, from_corner) = (b - a, c - a, camera.origin() - a);
        let of_v = from_corner.cross(along_u);
        let (of_u, normal) = (along_v.cross(from_corner), along_v.cross(along_u));
        Self { ids, of_u, of_v, normal, along: along_v.dot(of_v) }
    }

    /// Puts into a packet of camera rays what tracing it would.
    #[inline(always)]
    pub fn meet(&self, packet: &mut RayHitPacket<LANES>) {
        let RayHitPacket { ray, hit } = packet;
        let [geometry, instance, triangle] = self.ids;
        (hit.geom_id, hit.inst_id, hit.prim_id) = ([geometry; LANES], [instance; LANES], [triangle; LANES]);
        if geometry == INVALID_ID {
            return;
        }
        let Self { of_u, of_v, normal, .. } = self;
        for lane in 0..LANES {
            let [x, y, z] = [ray.dir_x[lane], ray.dir_y[lane], ray.dir_z[lane]];
            let over = 1.0 / (x * normal.x + y * normal.y + z * normal.z);
            hit.u[lane] = (x * of_u.x + y * of_u.y + z * of_u.z) * over;
            hit.v[lane] = (x * of_v.x + y * of_v.y + z * of_v.z) * over;
            ray.tfar[lane] = self.along * over;
        }
    }
}
