//! What rays hit: both backends, placements, and the judge that tells them apart.

#[path = "../common/mod.rs"]
mod common;

mod bvh;
mod coordinates;
mod crosscheck;
#[cfg(feature = "embree")]
mod embree;
mod instances;
mod odd_inputs;
