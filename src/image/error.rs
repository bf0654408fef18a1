//! What can go wrong with images.

use std::path::PathBuf;

/// An image that cannot be built, read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImageError {
    /// Width, height and number of pixels contradict each other, or are out of range.
    #[error("an image of {width} by {height} pixels cannot hold {pixels} pixels")]
    Size {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
        /// Pixels given.
        pixels: usize,
    },
    /// A file could not be read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        source: std::io::Error,
    },
    /// A file was read, but its contents are no image that this library understands.
    #[error("{}: {source}", path.display())]
    Contents {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: DecodeError,
    },
    /// An image could not be turned into a file's bytes.
    #[error("cannot encode {}: {cause}", path.display())]
    Encode {
        /// The file that was to be written.
        path: PathBuf,
        /// What the encoder says.
        cause: String,
    },
    /// A file cannot be written.
    #[error("cannot write {}: {cause}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why not.
        cause: String,
    },
}

/// Why the bytes of an image file were refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum DecodeError {
    /// Neither format's signature is there.
    #[error("not an image: it has neither the signature of EXR nor of PNG")]
    UnknownFormat,
    /// The file contradicts itself or ends too early.
    #[error("damaged {format} file: {cause}")]
    Damaged {
        /// "EXR" or "PNG".
        format: &'static str,
        /// What the decoder stumbled over.
        cause: String,
    },
    /// A valid file with something this library does not read.
    #[error("unsupported {format} file: {cause}")]
    Unsupported {
        /// "EXR" or "PNG".
        format: &'static str,
        /// What it contains.
        cause: String,
    },
}
