//! Ray queries: one trait, three backends.
//!
//! Backends are chosen at run time, once per render; everything inside is generic over [`Accel`], so
//! that the hot loops dispatch statically.

mod backend;
mod brute_force;
pub mod bvh;
#[cfg(feature = "embree")]
mod embree;
mod memory;
mod ray;

pub use backend::{Backend, BackendChoice, BackendError, Chosen, UnknownBackend};
pub use brute_force::BruteForceAccel;
pub use bvh::{BvhAccel, BvhError};
#[cfg(feature = "embree")]
pub use embree::{EmbreeAccel, EmbreeError};
pub use memory::{Footprint, MemoryEstimate, MemoryLimitError, check_memory, parse_size};
pub use ray::*;

/// Ray queries against one scene.
///
/// All queries count a triangle as hit from both sides. Triangles with a coordinate that is not finite or beyond
/// ±[`MAX_COORDINATE`] are never hit, nor are instances whose [placement can't be undone](largest_coordinate_of);
/// rays that are [not valid](Ray::is_valid) hit nothing. Triangles with a cut-out
/// ([`TriangleMesh::cutout`](crate::scene::TriangleMesh::cutout)) are hit only where it is opaque. A
/// hit exactly at either end of the valid interval may or may not be reported.
pub trait Accel: Send + Sync {
    /// Nearest hit of one ray.
    fn intersect(&self, ray: &Ray) -> Option<Hit>;

    /// Whether anything lies on one ray.
    fn occluded(&self, ray: &Ray) -> bool;

    /// Nearest hits of the packet's active lanes: `hit` and `ray.tfar` of lanes that hit are filled.
    /// Lanes must come with `geom_id` and `inst_id` set to [`INVALID_ID`]; `N` is 4, 8 or 16.
    fn intersect_packet<const N: usize>(
        &self,
        active: LaneMask,
        packet: &mut RayHitPacket<N>,
        coherence: Coherence,
    );

    /// The active lanes that are blocked. The packet's `tfar` is unspecified afterwards; `N` is 4, 8
    /// or 16.
    fn occluded_packet<const N: usize>(
        &self,
        active: LaneMask,
        packet: &mut RayPacket<N>,
        coherence: Coherence,
    ) -> LaneMask;

    /// Bytes held by the acceleration structure, without the scene's own vertices and indices.
    fn memory_bytes(&self) -> usize;
}
