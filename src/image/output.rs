//! Files that appear whole or not at all.
//!
//! A destination is checked when it is named, before hours of rendering, and written at the end under a temporary
//! name in the same directory, which then replaces the destination in one step.

use std::fs::{self, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use super::exr::SampleType;
use super::{Image, ImageError, Window, exr, png};

/// A file that can be written, as far as a check beforehand shows.
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
        // Only an attempt shows whether the directory takes files: permissions, read-only and full file systems.
        output.create_temporary().map_err(|error| refuse(reason(&error)))?;
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
        self.replace(bytes, false)
    }

    /// The same, and waits until the bytes are on the disk, so that not even a loss of power loses both what was there and what was written.
    ///
    /// # Errors
    ///
    /// As for [`OutputFile::write`].
    pub fn write_durably(&self, bytes: &[u8]) -> Result<(), ImageError> {
        self.replace(bytes, true)
    }

    fn replace(&self, bytes: &[u8], durably: bool) -> Result<(), ImageError> {
        let write = || {
            let mut temporary = self.create_temporary()?;
            temporary.write_all(bytes)?;
            if durably {
                temporary.as_file().sync_all()?;
            }
            temporary.persist(&self.resolved)?;
            Ok(())
        };
        write().map_err(|error: std::io::Error| ImageError::Write {
            path: self.named.clone(),
            cause: reason(&error),
        })
    }

    /// An empty file in the same directory. It vanishes when dropped, unless it replaces the destination.
    fn create_temporary(&self) -> std::io::Result<NamedTempFile> {
        let name = self.resolved.file_name().unwrap_or_default().to_string_lossy();
        // File systems limit names to 255 bytes; some of the name is enough to recognise it.
        let prefix = format!(".{}.", name.chars().take(32).collect::<String>());
        let mut builder = tempfile::Builder::new();
        builder.prefix(&prefix).suffix(".tmp");
        // Temporary files are the user's alone; this one gets the permissions of any new file, less the umask.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        builder.tempfile_in(&self.directory)
    }
}

/// The system's reason, without the temporary file's name.
fn reason(error: &std::io::Error) -> String {
    let cause = error.get_ref().and_then(|error| error.source());
    cause.map_or_else(|| error.to_string(), ToString::to_string)
}

/// The formats that images are written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImageFormat {
    /// OpenEXR: linear light, half or float.
    Exr,
    /// PNG: tone-mapped, 8-bit sRGB.
    Png,
}

/// How an image is written.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ImageOptions {
    /// Precision of EXR files.
    pub sample_type: SampleType,
    /// Exposure of PNG files in stops.
    pub exposure: f32,
    /// The part of the image that is written; EXR files say where in the image it lies. `None` for all.
    pub window: Option<Window>,
    /// Names and values stored in the file: version, backend, settings.
    pub metadata: Vec<(String, String)>,
}

/// An image file that can be written.
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
                    cause: "the name of an image ends in .exr or .png".to_owned(),
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

    /// The format that the image will have.
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
        let crop = match options.window.map(|window| (window, image.crop(window))) {
            None => None,
            Some((window, Some(crop))) => Some((window, crop)),
            Some((_, None)) => return Err(refuse("the part lies beyond the image".to_owned())),
        };
        let shown = crop.as_ref().map_or(image, |(_, crop)| crop);
        let bytes = match self.format {
            ImageFormat::Exr => {
                let display = (image.width(), image.height());
                let window = options.window.unwrap_or(Window::whole(display));
                exr::encode_part(shown, display, window, options.sample_type, &options.metadata)
                    .map_err(|error| refuse(error.to_string()))?
            }
            ImageFormat::Png => png::encode(shown, options.exposure, &options.metadata)
                .map_err(|error| refuse(error.to_string()))?,
        };
        self.file.write(&bytes)
    }
}
