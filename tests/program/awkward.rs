//! Whatever model file the program is given, it ends in a picture or in one line that names the file and the cause:
//! never in a panic, a signal, a hang or a pixel that is no number.
//!
//! Walks the folder of test scenes beside the project, where there is one, and the folder named by the environment
//! variable `LIGHTMESH_AWKWARD_DIR`.

use std::fs::{self, File};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use lightmesh::image;

use crate::common::data::{models_in, shared};

/// Many times what the slowest of the files takes on two quiet cores, so that a busy machine passes, and a hang does not.
const LIMIT: Duration = Duration::from_secs(60);
/// Files beyond this are for benchmarks, not for every test run.
const LARGEST: u64 = 4 << 20;

/// Who traces, and what of light: among a million overlapping instances the built-in BVH takes many times as long as Embree to gather it.
const WAYS: [&[&str]; 2] = [&["--backend", "bvh", "--indirect", "off"], &["--backend", "auto"]];

/// Renders one file in a process of its own; `Err` says which promise was broken.
fn outcome(model: &Path, way: &[&str], folder: &Path) -> Result<(), String> {
    let picture = folder.join("picture.exr");
    let log = folder.join("log");
    let _ = fs::remove_file(&picture);
    let stderr = File::create(&log).map_err(|error| error.to_string())?;
    let mut child = Command::new(env!("CARGO_BIN_EXE_lightmesh"))
        .args(["render", "--quiet", "--resolution", "16x12", "--float"])
        .args(way)
        .arg("-o")
        .arg(&picture)
        .arg(model)
        .stdout(Stdio::null())
        .stderr(stderr)
        .spawn()
        .map_err(|error| error.to_string())?;
    let start = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().map_err(|error| error.to_string())? {
            break status;
        }
        if start.elapsed() > LIMIT {
            let _ = child.kill();
            let _ = child.wait();
            return Err(format!("still runs after {LIMIT:?}"));
        }
        std::thread::sleep(Duration::from_millis(5));
    };
    let said = fs::read_to_string(&log).map_err(|error| error.to_string())?;
    match status.code() {
        Some(0) => {
            let rendered = image::read(&picture).map_err(|error| error.to_string())?;
            match rendered.non_finite_pixels() {
                0 => Ok(()),
                count => Err(format!("{count} pixels are not finite")),
            }
        }
        Some(1) => {
            let name = model.file_name().unwrap_or_default().to_string_lossy();
            // A material file may be what is wrong.
            let stem = model.parent().unwrap_or(Path::new("")).to_string_lossy();
            let one_line = said.trim_end().lines().count() == 1;
            if one_line && (said.contains(&*name) || said.contains(&*stem)) {
                Ok(())
            } else {
                Err(format!("not one line that names the file: {said}"))
            }
        }
        _ => Err(format!("ended with {status}: {said}")),
    }
}

#[test]
fn every_file_ends_in_a_picture_or_in_one_line_that_names_it() {
    let mut models = Vec::new();
    models.extend(shared("scenes").iter().flat_map(|folder| models_in(folder)));
    match std::env::var_os("LIGHTMESH_AWKWARD_DIR") {
        Some(folder) => models.extend(models_in(Path::new(&folder))),
        None => println!("skipped: LIGHTMESH_AWKWARD_DIR names no further folder"),
    }
    models.retain(|model| fs::metadata(model).is_ok_and(|metadata| metadata.len() <= LARGEST));
    let folder = tempfile::tempdir().unwrap();
    let broken: Vec<String> = models
        .iter()
        .flat_map(|model| WAYS.map(|way| (model, way)))
        .filter_map(|(model, way)| {
            Some(format!("{} {way:?}: {}", model.display(), outcome(model, way, folder.path()).err()?))
        })
        .collect();
    println!("{} files", models.len());
    assert!(broken.is_empty(), "{} renders of {} files:\n{}", broken.len(), models.len(), broken.join("\n"));
}
