//! The scene: what is rendered. Immutable once loaded.

mod alpha_mask;
pub mod animation;
mod camera;
mod camera_rays;
mod fingerprint;
pub mod generate;
mod lamps;
mod light;
pub mod load;
mod masked_mesh;
mod material;
mod mesh;
mod ray;
mod scene;
mod surface;
mod texture;
mod validate;

pub use alpha_mask::AlphaMask;
pub use animation::{Animation, Frame};
pub use camera::{Camera, CameraError, PixelFootprint};
pub use camera_rays::CameraRays;
pub use fingerprint::{Fingerprint, SceneFingerprint};
pub use light::{Falloff, Light, LightKind};
pub(crate) use masked_mesh::{AlphaMasks, MaskedMesh};
pub use material::Material;
pub use mesh::{Instance, Positions, TriangleMaterials, TriangleMesh};
pub use ray::{Hit, Ray};
pub use scene::Scene;
pub use surface::{Interaction, SurfacePoint};
pub use texture::{Texture, TextureMap, Wrap};
pub use validate::{BadValue, MeshDataError, SceneError};
