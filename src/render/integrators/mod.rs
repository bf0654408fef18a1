//! What computes the illumination of surface points (method §10).

mod conventional;
mod hybrid;
mod light_mesh;
mod reference;

pub use conventional::ConventionalIntegrator;
pub use light_mesh::LightMeshIntegrator;
pub use reference::ReferenceIntegrator;
