//! Reading scenes: the TOML scene file, and one module per model format.
//!
//! Whatever the format, a model file becomes a [`Model`]; the scene file places models and adds what
//! they lack.

mod bare;
mod compact;
mod error;
mod format;
pub mod gltf;
mod images;
mod model;
mod mtl;
pub mod obj;
mod parts;
pub mod ply;
mod points;
pub mod scene_file;
mod source;
mod text;
mod transform;
mod triangulate;

pub use bare::{OpenedScene, open_scene};
pub use error::{LoadError, Skipped, Warning};
pub use format::{ModelFormat, load_model};
pub use model::{Model, Part};
pub(crate) use points::{finite_number, number_rows};
pub use scene_file::{LoadedScene, load_scene_file};
