//! The surface mesh: indirect light at points that lie on surfaces (docs/method.md §5).

mod cell_light;
mod cells;
mod directions;
mod gather;
mod gathered;
mod interpolate;
mod last_place;
mod mesh;
mod points;
mod records;
mod saved;
mod saved_points;
mod solve;
mod sources;
mod survey;

pub use mesh::{SurfaceEvaluation, SurfaceMesh, SurfaceView};
pub(crate) use saved::SavedSurfaceMesh;
