//! Wavefront OBJ.
//!
//! The text is parsed in parallel by chunks of whole lines and put together in the file's order, so that
//! the result is the same bit for bit however the file is cut. One file becomes one triangle mesh with
//! materials per triangle: a ray-tracing backend is far faster with one large mesh than with the
//! hundreds of small ones that objects and groups would make. Their names stay usable through
//! [`Part`](super::Part)s.

mod assemble;
mod chunk;
mod materials;
mod statements;

use std::io::Read;
use std::path::Path;

pub use statements::ChunkSizes;
use statements::Statements;

use super::{LoadError, Model, source};

/// Reads an OBJ file and the MTL files that it names.
///
/// # Errors
/// [`LoadError::Read`] if it cannot be read, [`LoadError::Line`] for the first line that is not well
/// formed, states a coordinate that is not finite, or refers to a vertex that does not exist, and
/// [`LoadError::Empty`] if no triangle is left.
pub fn load_obj(path: &Path) -> Result<Model, LoadError> {
    read_obj(source::open(path)?, path, ChunkSizes::default())
}

/// Reads OBJ text from anywhere; `path` names it in messages, and MTL files are looked for beside it.
///
/// # Errors
/// As [`load_obj`].
pub fn read_obj(reader: impl Read + Send, path: &Path, sizes: ChunkSizes) -> Result<Model, LoadError> {
    let statements = Statements::read(reader, path, sizes)?;
    let table = materials::MaterialTable::load(&statements.names, path)?;
    assemble::assemble(statements, table, path)
}
