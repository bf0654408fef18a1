//! Random numbers, hashes, and sequences that spread evenly.

mod convex_hull;
mod hash;
mod inverse_cdf;
mod pixel_pattern;
mod random;
mod sequence;
mod sphere;

pub(crate) use convex_hull::convex_hull;
pub(crate) use hash::{BuildKeyHasher, hash_to_unit_cube, mix};
pub(crate) use inverse_cdf::InverseCdf;
pub(crate) use pixel_pattern::{MOST_DOUBLED, pixel_pattern};
pub use random::SplitMix64;
pub(crate) use sequence::unit_cube_point;
pub(crate) use sphere::{SphereStrata, rotation_at};
