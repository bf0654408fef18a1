//! Why nothing is rendered.

use crate::accel::BackendError;
use crate::image::ImageError;
use crate::light_mesh::points::MeshError;
use crate::scene::{CameraError, SceneError};
use crate::settings::SettingsError;

/// Why a scene can't be rendered.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// The scene contradicts itself.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// There is no acceleration structure.
    #[error(transparent)]
    Backend(#[from] BackendError),
    /// A frame moves what the scene doesn't have.
    #[error("frame {frame} moves {what} {index}, which does not exist")]
    NothingToMove {
        /// Number of the frame.
        frame: i64,
        /// An instance or a light.
        what: &'static str,
        /// Its index in the scene.
        index: usize,
    },
}

/// Why there is no image.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// A camera that sees nothing.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// A setting out of its range.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// The light meshes can't be set up.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The image can't be held.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// The light meshes would take more memory than the settings allow them.
    #[error("light meshes would take {} MiB or more; the memory limit leaves them {} MiB", needed.div_ceil(1 << 20), limit >> 20)]
    Memory {
        /// Bytes that they would take.
        needed: u64,
        /// Bytes that they may take.
        limit: u64,
    },
    /// A [`StopToken`](super::StopToken) stopped the render.
    #[error("the render was stopped")]
    Stopped,
}
