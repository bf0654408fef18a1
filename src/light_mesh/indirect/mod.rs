//! The indirect light mesh (ILM): what mesh points receive from surfaces, eqs. (4) and (5).
//!
//! From every mesh point N rays go out, one through each part of a partition of the sphere. What a hit surface sends back
//! is Emiss + k_d·I from the direct light mesh, plus k_d·Ĩ_d from this mesh's previous iteration where there are
//! several bounces. Points that such hits need are evaluated the same lazy way, until nothing is missing.

mod evaluate;
mod gather;
mod interpolation;
mod mesh;
mod octahedral;
mod patches;
mod solve;
mod view;

pub use evaluate::IndirectEvaluation;
pub use interpolation::{DirectTransport, IndirectInterpolation};
pub use mesh::IndirectMesh;
pub use view::IndirectView;
