//! Reading scenes: the TOML scene file, and one module per model format.
//!
//! Whatever the format, a model file becomes a [`Model`]; the scene file places models and adds what
//! they lack.

mod bare;
mod compact;
mod error;
pub mod gltf;
pub mod mtl;
pub mod obj;
mod parts;
mod pictures;
pub mod ply;
mod points;
pub mod scene_file;
mod source;
mod transform;
mod triangulate;

use std::ops::Range;
use std::path::Path;

use rayon::prelude::*;

pub use bare::{OpenedScene, open_scene};
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

/// The coordinates of a model must not exceed this, which backends and the sums over a scene can take.
const MAX_COORDINATE: f32 = 1e15;

/// Formats of model files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ModelFormat {
    /// Wavefront OBJ.
    Obj,
    /// glTF 2.0, in text or binary.
    Gltf,
    /// Polygon files of Stanford.
    Ply,
}

impl ModelFormat {
    /// The format by a name's extension, before `.gz` or `.zst` if the file is compressed; `None` for others.
    pub fn of(path: &Path) -> Option<Self> {
        let mut name = path.file_name()?.to_str()?.to_ascii_lowercase();
        for packed in [".gz", ".zst"] {
            name.truncate(name.strip_suffix(packed).unwrap_or(&name).len());
        }
        match name.rsplit_once('.')?.1 {
            "obj" => Some(Self::Obj),
            "gltf" | "glb" => Some(Self::Gltf),
            "ply" => Some(Self::Ply),
            _ => None,
        }
    }
}

/// Reads a model file; the format follows from the name's extension.
///
/// # Errors
/// [`LoadError::UnknownFormat`], and everything that the format's reader reports.
pub fn load_model(path: &Path) -> Result<Model, LoadError> {
    let model = match ModelFormat::of(path) {
        Some(ModelFormat::Obj) => obj::load_obj(path)?,
        Some(ModelFormat::Gltf) => gltf::load_gltf(path)?,
        Some(ModelFormat::Ply) => ply::load_ply(path)?,
        None => return Err(LoadError::UnknownFormat { file: path.to_owned() }),
    };
    let beyond = |position: &[f32; 3]| position.iter().any(|x| x.abs() > MAX_COORDINATE);
    if let Some(mesh) = model.meshes.iter().find(|mesh| mesh.positions.as_slice().par_iter().any(beyond)) {
        let (place, problem) = (mesh.name.clone(), format!("coordinates beyond ±{MAX_COORDINATE:e}"));
        return Err(LoadError::Invalid { file: path.to_owned(), place, problem });
    }
    Ok(model)
}
