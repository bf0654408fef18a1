//! The direct light mesh (DLM): visibility of every light from mesh points, eq. (1), and the direct illumination of surface
//! points that follows from it, eqs. (2) and (3).

mod derived;
mod estimators;
mod field;
mod known;
mod mesh;
mod moved;
mod refine;
mod saved;
// For tests and benches only.
#[doc(hidden)]
pub mod spherical_harmonics;
mod stored_bits;
mod witnesses;

pub use crate::light_mesh::points::LayerGrid;
pub(crate) use estimators::FieldEstimator;
pub use known::KnownPoints;
pub use mesh::{DirectEvaluation, DirectInterpolation, DirectMesh, DirectView};
pub use moved::KeptBits;
pub(crate) use moved::Motion;
pub(crate) use witnesses::Witnesses;

// For tests and benches only.
#[doc(hidden)]
pub use {derived::Basis, field::DirectField};
