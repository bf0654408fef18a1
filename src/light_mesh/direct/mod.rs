//! The direct light mesh (DLM): visibility of every light from mesh points, eq. (1), and the direct illumination of surface
//! points that follows from it, eqs. (2) and (3).

mod derived;
mod estimators;
mod field;
mod mesh;
pub mod spherical_harmonics;

pub use derived::Basis;
pub use estimators::FieldEstimator;
pub use field::DirectField;
pub use mesh::{DirectEvaluation, DirectInterpolation, DirectMesh, DirectView};
