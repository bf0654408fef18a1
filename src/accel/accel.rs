//! The trait that every backend implements.

use super::packet::PacketLanes;
use super::packet::{Coherence, LaneMask, RayHitPacket, RayPacket, lanes_of_mask, set_hit_of_lane};
use crate::scene::{Hit, Ray};

/// Ray queries against one scene.
///
/// All queries count a triangle as hit from both sides. Triangles with a coordinate that is not finite or beyond
/// ±[`MAX_COORDINATE`](super::MAX_COORDINATE) are never hit, nor are instances whose
/// [placement can't be undone](super::largest_coordinate_of); rays that are [not valid](super::is_valid_ray) hit nothing.
/// Triangles whose material has an [alpha mask](crate::scene::AlphaMask) are hit only where that is opaque. A hit exactly at either end of the valid
/// interval may or may not be reported.
///
/// An acceleration structure holds geometry and alpha masks, and nothing else of the scene: cameras, lights and the
/// other properties of materials may change without a new one.
pub trait Accel: Send + Sync {
    /// Closest hit of one ray.
    fn intersect(&self, ray: &Ray) -> Option<Hit>;

    /// Whether anything lies on one ray.
    fn occluded(&self, ray: &Ray) -> bool;

    /// Closest hits of the packet's active lanes: `hit` and `ray.tfar` of lanes that hit are filled.
    /// Lanes must come with `geom_id` and `inst_id` set to [`INVALID_ID`](super::INVALID_ID); `N` is 4, 8 or 16. Unless a
    /// backend has packets of its own, the lanes are traced one by one.
    fn intersect_packet<const N: usize>(
        &self,
        active: LaneMask,
        packet: &mut RayHitPacket<N>,
        _coherence: Coherence,
    ) {
        for lane in lanes_of_mask::<N>(active) {
            if let Some(hit) = self.intersect(&packet.lane(lane)) {
                set_hit_of_lane(packet, lane, &hit);
            }
        }
    }

    /// The active lanes that are blocked. The packet's `tfar` is unspecified afterwards; `N` is 4, 8
    /// or 16. Unless a backend has packets of its own, the lanes are traced one by one.
    fn occluded_packet<const N: usize>(
        &self,
        active: LaneMask,
        packet: &mut RayPacket<N>,
        _coherence: Coherence,
    ) -> LaneMask {
        let blocked = lanes_of_mask::<N>(active).filter(|&lane| self.occluded(&packet.lane(lane)));
        blocked.fold(0, |mask, lane| mask | 1 << lane)
    }

    /// Bytes held by the acceleration structure, without the scene's own vertices and indices.
    fn memory_bytes(&self) -> usize;
}
