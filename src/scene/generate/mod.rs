//! Scenes made by rule, for benchmarks and images.

mod files;
pub mod forest;
pub mod interior;
mod shapes;
pub mod still_life;

use std::io;
use std::path::PathBuf;

use files::write_files;

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
