//! Ray queries: one trait, three backends.
//!
//! Backends are chosen at run time, once per render; everything inside is generic over [`Accel`], so
//! that the hot loops dispatch statically.

mod accel;
mod backend;
mod brute_force;
mod bvh;
#[cfg(feature = "embree")]
mod embree;
mod limits;
mod memory;
mod packet;

pub use accel::Accel;
// Benchmarks alone tell backends apart.
#[cfg(feature = "cli")]
pub(crate) use backend::with_accel;
pub use backend::{Backend, BackendChoice, BackendError, Chosen, embree_libraries};
pub use brute_force::BruteForceAccel;
pub use bvh::{BvhAccel, BvhError, SimdLevel};
#[cfg(feature = "embree")]
pub use embree::{EmbreeAccel, EmbreeError};
pub use limits::{MAX_COORDINATE, MIN_DIRECTION, is_valid_ray, largest_coordinate, largest_coordinate_of};
pub use memory::{Footprint, MemoryEstimate, MemoryLimitError, check_memory, parse_size};
pub use packet::{
    Coherence, INVALID_ID, LaneMask, PacketLanes, RayHitPacket, RayPacket, hit_of_lane, on_triangle_of,
};
