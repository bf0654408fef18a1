//! Flags that several commands have.

use std::path::{Path, PathBuf};

use clap::Args;

use super::choice::named;
use super::error::CommandError;
use super::events::ProgressForm;
use super::progress::Reporter;
use crate::accel::{BackendChoice, check_memory, parse_size};
use crate::scene::Scene;
use crate::scene::load::{LoadedScene, OpenedScene, open_scene};

/// The scene that a command reads.
#[derive(Args, Clone, Debug, Default)]
pub struct SceneArgs {
    /// Scene file (TOML) or model (.glb, .gltf, .obj, .ply; also .gz and .zst)
    #[arg(value_name = "SCENE")]
    pub path: PathBuf,
}

impl SceneArgs {
    /// Reads the scene.
    pub fn read(&self, reporter: &Reporter) -> Result<OpenedScene, CommandError> {
        let spinner = reporter.spinner("reading");
        let opened = open_scene(&self.path);
        spinner.finish_and_clear();
        Ok(opened?)
    }

    /// Reads the scene and reports what is doubtful about it.
    pub fn open(&self, reporter: &Reporter) -> Result<OpenedScene, CommandError> {
        let opened = self.read(reporter)?;
        report_doubts(&opened.loaded, &self.path, reporter);
        let LoadedScene { scene, cameras, .. } = &opened.loaded;
        reporter.detail(&format!(
            "{}: {} triangles, {} lights, {} cameras",
            self.path.display(),
            scene.triangle_count(),
            scene.lights.len(),
            cameras.len()
        ));
        Ok(opened)
    }
}

/// Reports what is doubtful about a scene, and what was left out of it.
pub fn report_doubts(loaded: &LoadedScene, path: &Path, reporter: &Reporter) {
    for warning in &loaded.warnings {
        reporter.line(&format!("warning: {warning}"));
    }
    if !loaded.skipped.is_empty() {
        reporter.line(&format!("warning: {}: left out {}", path.display(), loaded.skipped));
    }
}

/// What a command reports while it works.
#[derive(Args, Clone, Copy, Debug, Default)]
pub struct QuietArgs {
    /// Write nothing to stderr but errors, and progress where --progress asks for it
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    pub quiet: bool,
    /// Say more: what was chosen, and where time goes; with --version, what this build is and which backends it finds
    #[arg(short, long, global = true)]
    pub verbose: bool,
    /// Form in which progress is reported
    #[arg(long, value_name = "FORM", global = true, default_value_t, value_parser = named::<ProgressForm>())]
    pub progress: ProgressForm,
}

impl QuietArgs {
    /// What the command reports with.
    pub fn reporter(self) -> Reporter {
        Reporter::new(self.quiet, self.verbose, self.progress)
    }
}

/// The threads that a command works on.
#[derive(Args, Clone, Copy, Debug, Default)]
pub struct ThreadArgs {
    /// Threads; 0 for one per processor
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u16).range(..=1024))]
    threads: u16,
}

impl ThreadArgs {
    /// Starts the threads.
    pub fn pool(self) -> Result<rayon::ThreadPool, CommandError> {
        Ok(rayon::ThreadPoolBuilder::new().num_threads(usize::from(self.threads)).build()?)
    }
}

/// What traces the rays of a command.
#[derive(Args, Clone, Copy, Debug, Default)]
pub struct BackendArgs {
    /// Library that traces the rays
    #[arg(long, default_value_t, value_parser = named::<BackendChoice>())]
    pub backend: BackendChoice,
}

/// How much memory a scene and its light meshes may take.
#[derive(Args, Clone, Copy, Debug, Default)]
pub struct MemoryArgs {
    /// Refuse a scene that would take more memory while it is built, by an estimate, and light meshes that would take more than it leaves: 500M, 8G
    #[arg(long, value_name = "SIZE", value_parser = parse_size)]
    memory_limit: Option<u64>,
}

impl MemoryArgs {
    /// Refuses a scene that takes more than the limit; returns what that leaves for light meshes, if there is one.
    pub fn check(
        self,
        file: &SceneArgs,
        scene: &Scene,
        backends: &[BackendChoice],
    ) -> Result<Option<u64>, CommandError> {
        check_memory(scene, backends, self.memory_limit)
            .map_err(|source| CommandError::MemoryLimit { scene: file.path.clone(), source })
    }
}
