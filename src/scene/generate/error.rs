//! Why a scene could not be generated.

use std::io;
use std::path::PathBuf;

/// Why a scene could not be generated.
#[derive(Debug, thiserror::Error)]
pub enum GenerateError {
    /// A file or folder cannot be written.
    #[error("{}: cannot be written: {source}", path.display())]
    Write {
        /// The file or folder.
        path: PathBuf,
        /// The operating system's reason.
        source: io::Error,
    },
    /// A parameter is out of its range.
    #[error("{name} must lie in [{min}, {max}], found {found}")]
    OutOfRange {
        /// Name of the parameter.
        name: &'static str,
        /// Lower bound.
        min: u32,
        /// Upper bound.
        max: u32,
        /// The value.
        found: u32,
    },
}
