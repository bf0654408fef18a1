//! What tests need from outside of the repository.

use std::fs;
use std::io::{Write, stderr};
use std::path::{Path, PathBuf};
use std::process::Command;

use lightmesh::scene::load::ModelFormat;

/// Says that a check is left out, because of what is missing. Where `REQUIRE_DATA` is set that is a failure.
pub fn missing(what: &str) {
    assert!(std::env::var_os("REQUIRE_DATA").is_none(), "REQUIRE_DATA is set, but {what}");
    // Not println!, which the test harness swallows.
    let _ = writeln!(stderr(), "skipped: {what}");
}

/// A file or folder of the data beside the project; `None`, and said so, where there is none.
pub fn shared(path: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared").join(path);
    if path.exists() {
        return Some(path);
    }
    missing(&format!("there is no {}", path.display()));
    None
}

/// Runs a program of the system and returns what it prints; `None`, and said so, where it is not installed.
///
/// # Panics
/// If the program fails.
pub fn run(program: &str, package: &str, arguments: &[&Path]) -> Option<String> {
    let Ok(output) = Command::new(program).args(arguments).output() else {
        missing(&format!("{program} (package {package}) is not installed"));
        return None;
    };
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{program} {arguments:?}: {errors}");
    Some(String::from_utf8_lossy(&output.stdout).into_owned())
}

/// The models in a folder and the folders in it, sorted by name.
pub fn models_in(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).into_iter().flatten().flatten() {
            let path = entry.path();
            if path.is_dir() {
                folders.push(path);
            } else if ModelFormat::of(&path).is_some() {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}
