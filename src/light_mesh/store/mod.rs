//! Which mesh points are known, and in which slot of their mesh's arrays their values lie.

mod point_mask;
mod point_store;
mod saved;
mod slots;

pub use point_mask::{NeededPoints, PointMask};
pub use point_store::PointStore;
pub use saved::PointSections;
