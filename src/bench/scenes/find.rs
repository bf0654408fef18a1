//! The scenes that are meant by files and folders.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::result::Failure;
use crate::bench::BenchError;
use crate::scene::load::ModelFormat;

/// The files among `paths` as they are, and in place of folders what is in them and can be rendered, in the order of
/// its names. Folders that can't be read or hold no scene are `failures`.
pub fn scene_files(paths: &[PathBuf], failures: &mut Vec<Failure>) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for path in paths {
        if !path.is_dir() {
            files.push(path.clone());
            continue;
        }
        let before = (files.len(), failures.len());
        walk(path, &mut files, failures);
        if before == (files.len(), failures.len()) {
            failures.push(Failure::new(path, &BenchError::NoScenes));
        }
    }
    files
}

/// Adds what can be rendered in a folder and its folders. Links to folders are not followed: they may lead back.
fn walk(folder: &Path, files: &mut Vec<PathBuf>, failures: &mut Vec<Failure>) {
    let entries = fs::read_dir(folder).and_then(|entries| {
        let entry = |entry: io::Result<fs::DirEntry>| {
            let entry = entry?;
            Ok((entry.path(), entry.file_type()?.is_dir()))
        };
        entries.map(entry).collect::<io::Result<Vec<_>>>()
    });
    let mut entries = match entries {
        Ok(entries) => entries,
        Err(error) => return failures.push(Failure::new(folder, &BenchError::ReadFolder(error))),
    };
    entries.sort();
    for (path, is_folder) in entries {
        if is_folder {
            walk(&path, files, failures);
        } else if is_scene(&path) {
            files.push(path);
        }
    }
}

/// Whether a file is a model or a scene file, by its name.
fn is_scene(path: &Path) -> bool {
    let is_toml = || path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"));
    ModelFormat::of(path).is_some() || is_toml() && !is_other_toml(path)
}

/// Whether a TOML file is about something else: it is valid and has no `geometry`, without which there is no scene.
fn is_other_toml(path: &Path) -> bool {
    let text = fs::read_to_string(path).unwrap_or_default();
    !text.is_empty() && text.parse::<toml::Table>().is_ok_and(|table| !table.contains_key("geometry"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Models and scene files of all folders, in order; lists, materials and empty folders are none, but files that are
    /// named by the user are taken as they are.
    #[test]
    fn folders_stand_for_what_can_be_rendered_in_them() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        for (name, text) in [
            ("b.obj", ""),
            ("b.mtl", ""),
            ("a/z.ply.gz", ""),
            ("a/list.toml", "[[picture]]\n"),
            ("a/scene.toml", "[[geometry]]\n"),
            ("a/broken.toml", "[[geometry]\n"),
        ] {
            fs::create_dir_all(at(name).parent().unwrap()).unwrap();
            fs::write(at(name), text).unwrap();
        }
        fs::create_dir(at("empty")).unwrap();
        let mut failures = Vec::new();
        let files = scene_files(
            &[at("b.mtl"), folder.path().to_owned(), at("missing.obj"), at("empty")],
            &mut failures,
        );
        let expected = ["b.mtl", "a/broken.toml", "a/scene.toml", "a/z.ply.gz", "b.obj", "missing.obj"];
        assert_eq!(files, expected.map(at));
        assert_eq!(failures.len(), 1);
        assert!(failures[0].error.starts_with(&failures[0].name) && failures[0].name.ends_with("empty"));
    }
}
