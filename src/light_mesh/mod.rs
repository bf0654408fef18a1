//! Light meshes: lazily evaluated values at mesh points in free space, interpolated at surfaces.

mod attenuation;
mod direct;
pub mod directional;
mod emitters;
mod estimator;
mod ids;
mod indirect;
mod lanes;
mod lattice;
mod leaks;
mod lights;
mod neighbours;
mod normal_table;
mod patches;
mod points;
mod scattered;
mod sphere;
mod store;
mod tiled;
mod vicinity;

pub use direct::{Basis, DirectValues};
pub use estimator::{DirectMesh, Scratch};
pub use indirect::{IndirectMesh, IndirectRays};
pub use lanes::{LANES, Lanes, VisibilityBits, expand_bits};
pub use lattice::Lattice;
pub use leaks::is_inside;
pub use lights::{LightChunk, LightTable};
pub use neighbours::{Ball, Neighbours};
pub use points::{MeshError, MeshPoints, PointCounters};
pub use sphere::SphereStrata;
pub use store::{NeededPoints, PointMask};
