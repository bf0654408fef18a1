//! Files that appear whole or not at all.
//!
//! A destination is checked when it is named, before hours of rendering, and written at the end under a temporary
//! name in the same directory, which then replaces the destination in one step.

use std::fs::{self, File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use super::exr::SampleType;
use super::{Image, ImageError, exr, png};

/// Distinguishes temporary files of one process.
static SERIAL: AtomicU32 = AtomicU32::new(0);

/// A file that can be written, as far as a check beforehand can tell.
#[derive(Clone, Debug)]
pub struct OutputFile {
    /// As the user named it, for messages.
    named: PathBuf,
    /// With symbolic links followed: a link stays, what it points to is replaced.
    resolved: PathBuf,
    directory: PathBuf,
}

impl OutputFile {
    /// Checks that `path` can be written: its directory exists and takes new files, and what is there under that
    /// name, if anything, is a file that may be overwritten.
    ///
    /// # Errors
    ///
    /// If it cannot, naming the path and the cause.
    pub fn new(path: &Path) -> Result<Self, ImageError> {
        let refuse = |cause: String| ImageError::Write { path: path.to_path_buf(), cause };
        if path.file_name().is_none() {
            return Err(refuse("it names no file".to_owned()));
        }
        let resolved = fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
        let directory = match resolved.parent() {
            Some(parent) if parent != Path::new("") => parent.to_path_buf(),
            _ => PathBuf::from("."),
        };
        match fs::metadata(&directory) {
            Ok(there) if there.is_dir() => {}
            Ok(_) => return Err(refuse(format!("{} is not a directory", directory.display()))),
            Err(error) => return Err(refuse(format!("directory {}: {error}", directory.display()))),
        }
        match fs::metadata(&resolved) {
            Ok(there) if there.is_dir() => return Err(refuse("it is a directory".to_owned())),
            Ok(there) if !there.is_file() => return Err(refuse("it is not a regular file".to_owned())),
            // Replacing needs only the directory's permission; a file that was made read-only shall stay.
            Ok(_) => drop(
                OpenOptions::new().append(true).open(&resolved).map_err(|error| refuse(error.to_string()))?,
            ),
            Err(_) => {}
        }
        let output = Self { named: path.to_path_buf(), resolved, directory };
        // Only an attempt tells whether the directory takes files: permissions, read-only and full file systems.
        output.create_temporary().map_err(|error| refuse(error.to_string()))?;
        Ok(output)
    }

    /// The file's path as it was given.
    pub fn path(&self) -> &Path {
        &self.named
    }

    /// Replaces the file's contents by `bytes`.
    ///
    /// # Errors
    ///
    /// If that fails; then the file is as it was before, and no temporary file is left.
    pub fn write(&self, bytes: &[u8]) -> Result<(), ImageError> {
        let write = || {
            let mut temporary = self.create_temporary()?;
            temporary.file.write_all(bytes)?;
            temporary.rename_to(&self.resolved)
        };
        write().map_err(|error: std::io::Error| ImageError::Write {
            path: self.named.clone(),
            cause: error.to_string(),
        })
    }

    fn create_temporary(&self) -> std::io::Result<Temporary> {
        let name = self.resolved.file_name().unwrap_or_default().to_string_lossy();
        // File systems limit names to 255 bytes; some of the name is enough to recognise it.
        let name: String = name.chars().take(32).collect();
        let serial = SERIAL.fetch_add(1, Ordering::Relaxed);
        let path = self.directory.join(format!(".{name}.{}-{serial}.tmp", std::process::id()));
        let file = OpenOptions::new().write(true).create_new(true).open(&path)?;
        Ok(Temporary { path, file, keep: false })
    }
}

/// A file that vanishes when dropped, unless it was renamed.
struct Temporary {
    path: PathBuf,
    file: File,
    keep: bool,
}

impl Temporary {
    fn rename_to(mut self, destination: &Path) -> std::io::Result<()> {
        fs::rename(&self.path, destination)?;
        self.keep = true;
        Ok(())
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        if !self.keep {
            // Nothing can be done about a failure here, and the error that led here is already being reported.
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// The formats that pictures are written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImageFormat {
    /// OpenEXR: linear light, half or float.
    Exr,
    /// PNG: tone-mapped, 8-bit sRGB.
    Png,
}

/// How a picture is written.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ImageOptions {
    /// Precision of EXR files.
    pub sample_type: SampleType,
    /// Exposure of PNG files in stops.
    pub exposure: f32,
    /// Names and values stored in the file: version, backend, settings, seconds.
    pub metadata: Vec<(String, String)>,
}

/// A picture file that can be written.
#[derive(Clone, Debug)]
pub struct OutputTarget {
    file: OutputFile,
    format: ImageFormat,
}

impl OutputTarget {
    /// Checks `path` as [`OutputFile::new`] does and takes the format from its extension, .exr or .png.
    ///
    /// # Errors
    ///
    /// If the extension is another one, or the file cannot be written.
    pub fn new(path: &Path) -> Result<Self, ImageError> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        let format = match extension.as_deref() {
            Some("exr") => ImageFormat::Exr,
            Some("png") => ImageFormat::Png,
            _ => {
                return Err(ImageError::Write {
                    path: path.to_path_buf(),
                    cause: "the name of a picture ends in .exr or .png".to_owned(),
                });
            }
        };
        Ok(Self { file: OutputFile::new(path)?, format })
    }

    /// The file's path as it was given.
    pub fn path(&self) -> &Path {
        self.file.path()
    }

    /// The file without the format.
    pub fn file(&self) -> &OutputFile {
        &self.file
    }

    /// The format that the picture will have.
    pub fn format(&self) -> ImageFormat {
        self.format
    }

    /// Writes `image`.
    ///
    /// # Errors
    ///
    /// If that fails; then the file is as it was before.
    pub fn write(&self, image: &Image, options: &ImageOptions) -> Result<(), ImageError> {
        let refuse = |cause: String| ImageError::Encode { path: self.path().to_path_buf(), cause };
        let bytes = match self.format {
            ImageFormat::Exr => exr::encode(image, options.sample_type, &options.metadata)
                .map_err(|error| refuse(error.to_string()))?,
            ImageFormat::Png => png::encode(image, options.exposure, &options.metadata)
                .map_err(|error| refuse(error.to_string()))?,
        };
        self.file.write(&bytes)
    }
}
