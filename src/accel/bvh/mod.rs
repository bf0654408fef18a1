//! Pure-Rust ray queries: a wide BVH with SIMD nodes and leaves.
//!
//! Hits are the same to the last bit on every instruction set level, for single rays and packets, and
//! for any number of threads that built the tree: the triangle test has one order of operations, boxes are
//! padded so that they never cull a hit, and equal distances go to the lowest (instance, triangle).

mod blas;
mod blas_packet;
mod build;
mod collapse;
mod error;
mod instance;
mod lanes;
mod level;
mod node;
mod packet;
mod query;
mod ray;
mod scene_tree;
mod structure;
mod top_level;
mod traverse;
mod traverse_packet;
mod triangle;
mod validate;

pub(super) use instance::WorldToObject;

pub use error::BvhError;
pub use level::SimdLevel;
pub use structure::BvhAccel;
