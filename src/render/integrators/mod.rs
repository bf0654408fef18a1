//! What computes the illumination of surface points (method §10).

mod averaged;
mod conventional;
mod hybrid;
mod light_mesh;
mod reference;
mod smooth_square;

pub use conventional::ConventionalIntegrator;
pub use light_mesh::LightMeshIntegrator;
pub use reference::ReferenceIntegrator;
