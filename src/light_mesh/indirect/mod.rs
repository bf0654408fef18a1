//! The indirect light mesh (ILM): what mesh points receive from surfaces, eqs. (4) and (5).
//!
//! From every mesh point N rays go out, spread evenly over the sphere. What a hit surface sends back is Emiss + k_d·I, plus
//! k_d·Ĩ_d from this mesh's previous iteration where there are several bounces. Hits near to each other share both;
//! points that they need are evaluated the same lazy way, until nothing is missing.

mod evaluate;
mod gather;
mod interpolation;
mod mesh;
mod octahedral;
mod patches;
mod saved;
mod solve;
mod view;

pub use evaluate::IndirectEvaluation;
pub use interpolation::{DirectTransport, IndirectInterpolation};
pub use mesh::IndirectMesh;
pub use view::IndirectView;
