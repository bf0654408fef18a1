//! Images: linear RGB in memory, EXR and PNG on disk, and how far two of them are apart.

mod error;
pub mod error_image;
pub mod exr;
mod image;
mod input;
pub mod metrics;
pub mod output;
pub mod png;
pub mod tone;
mod window;

pub use error::{DecodeError, ImageError};
pub use image::{Image, MAX_PIXELS};
pub use input::{decode, metadata, read};
pub use output::{ImageFormat, ImageOptions, OutputFile, OutputTarget};
pub use window::Window;

pub(crate) use image::is_finite;
