//! Light meshes as files (docs/light-mesh-files.md): sections of bytes with names and checksums, which are mapped read-only.

mod error;
mod sections;

pub use error::{Differences, MeshFileError};
pub use sections::{MappedSection, MeshFile, SectionsWriter};
