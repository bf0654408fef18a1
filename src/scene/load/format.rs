//! The formats of model files, by name.

use std::path::Path;

use rayon::prelude::*;

use super::model::MAX_COORDINATE;
use super::{LoadError, Model, gltf, obj, ply};

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
