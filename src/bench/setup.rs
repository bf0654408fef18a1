//! The scene that is measured, and single frames of it.

use std::path::Path;

use glam::Vec3;
use tempfile::TempDir;

use super::machine::Machine;
use super::report::Report;
use super::timing::timed;
use super::{BenchError, BenchOptions};
use crate::accel::Backend;
use crate::image::Image;
use crate::image::metrics::{MetricsOptions, compare};
use crate::render::{RenderError, RenderStats, render};
use crate::scene::generate::GenerateError;
use crate::scene::generate::forest::Forest;
use crate::scene::generate::interior::Interior;
use crate::scene::load::load_scene_file;
use crate::scene::{Camera, Scene};
use crate::settings::Settings;

/// Triangles of the paper's forest.
pub const PAPER_TRIANGLES: u32 = 23_542;
/// Its lights.
pub const PAPER_LIGHTS: u32 = 100;

/// A scene with its camera.
pub struct Setup {
    /// The scene.
    pub scene: Scene,
    /// Its camera.
    pub camera: Camera,
    /// Its settings.
    pub settings: Settings,
    /// Seconds to read it.
    pub load_seconds: f64,
}

/// A frame and its time.
pub struct Frame {
    /// The image.
    pub image: Image,
    /// Counters and seconds per stage.
    pub stats: RenderStats,
    /// Wall-clock seconds of the whole frame, from nothing but scene and acceleration structure.
    pub seconds: f64,
}

/// A new folder that is removed when it goes out of use.
pub fn temporary_folder() -> Result<TempDir, BenchError> {
    tempfile::Builder::new().prefix("lightmesh-bench-").tempdir().map_err(BenchError::Folder)
}

/// The forest of `lightmesh generate forest`, written and read like any scene.
///
/// The sky is black: it would add to the image's mean, by which errors are divided, but never to the errors.
pub fn forest(triangles: u32, lights: u32) -> Result<Setup, BenchError> {
    let mut setup = generated("forest.toml", |folder| Forest { triangles, lights, seed: 1 }.write(folder))?;
    setup.scene.background = Vec3::ZERO;
    Ok(setup)
}

/// The hall of `lightmesh generate interior`.
pub fn interior(bays: u32, lamps: u32) -> Result<Setup, BenchError> {
    generated("interior.toml", |folder| Interior { bays, lamps }.write(folder))
}

/// A scene that `write` puts into a folder under a name.
fn generated(
    name: &str,
    write: impl FnOnce(&Path) -> Result<(), GenerateError>,
) -> Result<Setup, BenchError> {
    let folder = temporary_folder()?;
    write(folder.path())?;
    let (load_seconds, loaded) = timed(|| load_scene_file(&folder.path().join(name)));
    let loaded = loaded?;
    let camera = loaded.cameras.into_iter().next().ok_or(BenchError::NoCamera)?;
    Ok(Setup { scene: loaded.scene, camera, settings: loaded.settings, load_seconds })
}

impl Setup {
    /// Renders a frame; light meshes start with no point known.
    pub fn frame(&self, backend: &Backend, settings: &Settings) -> Result<Frame, RenderError> {
        let (seconds, rendered) = timed(|| render(backend, &self.scene, &self.camera, settings));
        let (image, stats) = rendered?;
        Ok(Frame { image, stats, seconds })
    }
}

/// Root of the mean squared difference of two images over the mean of the second.
pub fn relative_rmse(image: &Image, reference: &Image) -> f64 {
    // Images of one size can be compared; a black reference has no relative error.
    let metrics = compare(image, reference, MetricsOptions::default()).ok();
    metrics.and_then(|metrics| metrics.relative_rmse).unwrap_or(f64::NAN)
}

/// An empty report.
pub fn new_report(benchmark: &'static str, backend: String, options: &BenchOptions) -> Report {
    Report {
        benchmark,
        version: env!("CARGO_PKG_VERSION"),
        machine: Machine::here(),
        backend,
        threads: rayon::current_num_threads(),
        quick: options.quick,
        measurements: Vec::new(),
        goals: Vec::new(),
        tables: Vec::new(),
        plots: Vec::new(),
        bars: Vec::new(),
        curves: Vec::new(),
        adaptive: Vec::new(),
        results: None,
    }
}
