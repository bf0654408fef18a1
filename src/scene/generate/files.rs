//! Several files of one folder, written whole or not at all.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use super::error::GenerateError;

/// Writes the content of one file.
pub type Content<'a> = &'a dyn Fn(&mut dyn Write) -> io::Result<()>;

/// Creates `folder` if need be and the files in it. Each is written under a temporary name; all get their
/// own names when the last one is complete, and none stays behind after an error.
///
/// # Errors
/// [`GenerateError::Write`]
pub fn write_files(folder: &Path, files: &[(&str, Content)]) -> Result<(), GenerateError> {
    fs::create_dir_all(folder).map_err(|source| GenerateError::Write { path: folder.to_owned(), source })?;
    for (name, _) in files {
        let path = folder.join(name);
        if path.is_dir() {
            return Err(GenerateError::Write { path, source: io::ErrorKind::IsADirectory.into() });
        }
    }
    let mut partial = Vec::new();
    for (name, content) in files {
        let file = Partial { path: folder.join(format!(".{name}.{}.partial", std::process::id())) };
        let path = file.path.clone();
        partial.push((file, folder.join(name)));
        let write = || {
            let mut writer = BufWriter::with_capacity(1 << 20, File::create(&path)?);
            content(&mut writer)?;
            writer.into_inner().map_err(io::IntoInnerError::into_error)?.sync_all()
        };
        write().map_err(|source| GenerateError::Write { path: folder.join(name), source })?;
    }
    for (file, path) in &partial {
        fs::rename(&file.path, path).map_err(|source| GenerateError::Write { path: path.clone(), source })?;
    }
    Ok(())
}

/// A file that is removed unless it was renamed.
struct Partial {
    path: PathBuf,
}

impl Drop for Partial {
    fn drop(&mut self) {
        // After the rename there is nothing left to remove, and nothing to report.
        let _ = fs::remove_file(&self.path);
    }
}
