//! Reading image files.

use std::path::Path;

use super::{DecodeError, Image, ImageError, exr, png};

/// Reads an EXR or PNG file; the format follows from the first bytes.
///
/// # Errors
///
/// If the file cannot be read, is damaged, or holds no RGB or grey image.
pub fn read(path: &Path) -> Result<Image, ImageError> {
    let bytes =
        std::fs::read(path).map_err(|source| ImageError::Read { path: path.to_path_buf(), source })?;
    decode(&bytes).map_err(|source| ImageError::Contents { path: path.to_path_buf(), source })
}

/// Reads the bytes of an EXR or PNG file.
///
/// # Errors
///
/// As [`read`].
pub fn decode(bytes: &[u8]) -> Result<Image, DecodeError> {
    if bytes.starts_with(&exr::SIGNATURE) {
        exr::decode(bytes)
    } else if bytes.starts_with(&png::SIGNATURE) {
        png::decode(bytes)
    } else {
        Err(DecodeError::UnknownFormat)
    }
}

/// Names and values that are stored in an EXR or PNG file, of EXR the first part's. Nothing if the file can't be read or is none of these.
pub fn metadata(path: &Path) -> Vec<(String, String)> {
    let Ok(bytes) = std::fs::read(path) else { return Vec::new() };
    if bytes.starts_with(&exr::SIGNATURE) {
        exr::metadata(&bytes)
    } else if bytes.starts_with(&png::SIGNATURE) {
        png::metadata(&bytes)
    } else {
        Vec::new()
    }
}
