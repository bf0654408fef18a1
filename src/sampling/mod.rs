//! Random numbers, hashes, and sequences that spread evenly.

mod hash;
mod random;
mod sequence;
mod sphere;

pub use hash::{hash_to_unit_cube, mix};
pub use random::SplitMix64;
pub use sequence::unit_cube_point;
pub use sphere::SphereStrata;
