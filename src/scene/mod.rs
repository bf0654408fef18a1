//! The scene: what is rendered. Immutable once loaded.

mod alpha_mask;
mod bounds;
mod camera;
mod camera_rays;
pub mod generate;
mod light;
pub mod load;
mod material;
mod mesh;
pub mod random;
mod ray;
mod surface;
mod texture;

use std::sync::Arc;

use glam::Vec3;

pub use alpha_mask::{AlphaMask, AlphaMasks, MaskedMesh};
pub use bounds::Bounds;
pub use camera::Camera;
pub use camera_rays::CameraRays;
pub use light::{Falloff, LightShape, PointLight};
pub use material::Material;
pub use mesh::{Instance, Positions, TriangleMaterials, TriangleMesh};
pub use ray::{Hit, Ray};
pub use surface::{Interaction, SurfacePoint};
pub use texture::{Texture, TextureMap, Wrap};

/// Everything that is rendered, in world space of any unit of length.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// Unique geometry.
    pub meshes: Vec<Arc<TriangleMesh>>,
    /// Placements of the meshes; every mesh is placed at least once.
    pub instances: Vec<Instance>,
    /// Materials; index 0 always exists.
    pub materials: Vec<Material>,
    /// Point lights.
    pub lights: Vec<PointLight>,
    /// How light falls off with distance, φ1 of eq. (1).
    pub falloff: Falloff,
    /// Radiance of rays that leave the scene, linear RGB.
    pub background: Vec3,
}
