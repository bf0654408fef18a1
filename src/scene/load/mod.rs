//! Reading scenes: the TOML scene file, and one module per model format.
//!
//! Whatever the format, a model file becomes a [`Model`]; the scene file places models and adds what
//! they lack.

mod error;
pub mod mtl;
pub mod obj;
mod parts;
mod points;
pub mod scene_file;
mod triangulate;

use std::ops::Range;
use std::path::Path;

pub use error::{LoadError, Skipped, Warning};
pub use parts::{MaterialOverride, Selector};
pub use points::load_points;
pub use scene_file::{LoadedScene, load_scene_file};

use super::{Camera, Instance, Material, PointLight, TriangleMesh};

/// What one model file holds.
#[derive(Clone, Default)]
pub struct Model {
    /// Unique geometry.
    pub meshes: Vec<TriangleMesh>,
    /// Placements of the meshes in the model's own space.
    pub instances: Vec<Instance>,
    /// Materials that the meshes refer to; at least one.
    pub materials: Vec<Material>,
    /// Named runs of triangles, for material overrides.
    pub parts: Vec<Part>,
    /// Lights of the file.
    pub lights: Vec<PointLight>,
    /// Cameras of the file.
    pub cameras: Vec<Camera>,
    /// What was left out, counted.
    pub skipped: Skipped,
    /// What the user should know.
    pub warnings: Vec<Warning>,
}

/// Consecutive triangles of one mesh that the file put under one name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Part {
    /// Index into [`Model::meshes`].
    pub mesh: u32,
    /// Object or node name; empty if none was given.
    pub object: String,
    /// Group name or names, separated by spaces; empty if none was given.
    pub group: String,
    /// The triangles.
    pub triangles: Range<u32>,
}

/// Reads a model file; the format follows from the name's extension.
///
/// # Errors
/// [`LoadError::UnknownFormat`], and everything that the format's reader reports.
pub fn load_model(path: &Path) -> Result<Model, LoadError> {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
    if extension.eq_ignore_ascii_case("obj") {
        obj::load_obj(path)
    } else {
        Err(LoadError::UnknownFormat { file: path.to_owned() })
    }
}
