//! Renders in a folder, as several of these tests make them: by the built-in BVH, which there always is.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

/// Renders a scene in a folder.
pub fn render(folder: &Path, scene: &str, flags: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_lightmesh"))
        .args(["render", scene, "--backend", "bvh"])
        .args(flags)
        .current_dir(folder)
        .output()
        .expect("the program runs")
}

/// The shadow rays in a file of `--stats`.
pub fn shadow_rays(folder: &Path, file: &str) -> u64 {
    let stats: Value = serde_json::from_slice(&fs::read(folder.join(file)).expect("written")).expect("JSON");
    stats["rays"]["shadow"].as_u64().expect("a count")
}
