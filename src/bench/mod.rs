//! Measurements of speed, made by `lightmesh bench`.
//!
//! Everything that is compared runs in one process, in turn, and medians are reported with all raw times, so that
//! ratios mean something on a machine that does other things as well.

mod adaptive;
mod backends;
mod bars;
mod configuration;
mod curve;
mod headline;
mod html;
mod indirect;
mod lamps;
mod machine;
mod markup;
mod opened;
mod rays;
mod report;
mod scaling;
mod scenes;
mod setup;
mod shading;
mod threads;
mod timing;

use std::path::PathBuf;
use std::time::Duration;

pub use html::to_html;
pub use report::Report;

use self::timing::Budget;
use crate::accel::{BackendChoice, BackendError};
use crate::image::ImageError;
use crate::render::{RenderError, SessionError};
use crate::scene::generate::GenerateError;
use crate::scene::load::LoadError;
use crate::settings::named_enum;

named_enum! {
    /// What can be measured.
    #[derive(Default)]
    pub enum Benchmark {
        /// The paper's comparison: a forest by light mesh and by conventional tracing
        #[default]
        Headline = "headline",
        /// Time over resolution, lights, triangles, spacing and threads
        Scaling = "scaling",
        /// Rays per second of all backends, by kind of ray and packet width
        Backends = "backends",
        /// Evaluation of mesh points against a loop that only traces the same rays
        Rays = "rays",
        /// Given scenes by light mesh and by conventional tracing, and which of them `auto` takes
        Scenes = "scenes",
        /// Light from surfaces in given scenes: time, rays and error over the number of directions
        Indirect = "indirect",
        /// Light meshes whose points trace only what coarser ones disagree on, and those chosen by their error: error over rays and seconds
        Adaptive = "adaptive",
    }
}

/// How to measure.
#[derive(Clone, Debug)]
pub struct BenchOptions {
    /// Cut all sizes down: shows that everything runs, and nothing about speed.
    pub quick: bool,
    /// Repetitions of each comparison, at least 1.
    pub repetitions: usize,
    /// No further repetition of a comparison starts after this time.
    pub limit: Option<Duration>,
    /// Library that traces the rays, where the benchmark doesn't compare them.
    pub backend: BackendChoice,
    /// The program to measure whole processes with; without it these measurements are left out.
    pub program: Option<PathBuf>,
    /// With [`Benchmark::Scenes`], [`Benchmark::Indirect`] and [`Benchmark::Adaptive`]: scene files, models, and folders of them.
    /// [`Benchmark::Adaptive`] makes its own where there are none.
    pub scenes: Vec<PathBuf>,
    /// With the same: size of the images instead of each scene's own.
    pub resolution: Option<(u32, u32)>,
    /// With the first two: samples per pixel instead of one with [`Benchmark::Scenes`], and of each scene's own with [`Benchmark::Indirect`].
    pub samples_per_pixel: Option<u32>,
}

impl BenchOptions {
    /// Repetitions within the time limit.
    pub fn budget(&self) -> Budget {
        Budget { repetitions: self.repetitions, limit: self.limit }
    }
}

/// Why a benchmark can't be run.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// There is no place for temporary files.
    #[error("cannot create a temporary folder")]
    Folder(#[source] std::io::Error),
    /// The scene can't be written.
    #[error(transparent)]
    Generate(#[from] GenerateError),
    /// The scene can't be read.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// The scene has no camera.
    #[error("the scene has no camera")]
    NoCamera,
    /// The scene has no lights, also after they were chosen for a model that brings none.
    #[error("the scene has no lights")]
    NoLights,
    /// There is nothing to render in a folder.
    #[error("there are no scenes in it")]
    NoScenes,
    /// A folder can't be read.
    #[error("the folder cannot be read: {0}")]
    ReadFolder(#[source] std::io::Error),
    /// No backend.
    #[error(transparent)]
    Backend(#[from] BackendError),
    /// The scene contradicts itself.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// A frame can't be rendered.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// An image can't be held.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// Threads can't be started.
    #[error("cannot start the threads")]
    Threads(#[from] rayon::ThreadPoolBuildError),
    /// A process can't be measured.
    #[error("{}: {reason}", program.display())]
    Process {
        /// The program.
        program: PathBuf,
        /// What went wrong.
        reason: String,
    },
}

/// Runs a benchmark; `log` receives what is being done.
///
/// # Errors
/// See [`BenchError`].
pub fn run(benchmark: Benchmark, options: &BenchOptions, log: &dyn Fn(&str)) -> Result<Report, BenchError> {
    match benchmark {
        Benchmark::Headline => headline::run(options, log),
        Benchmark::Scaling => scaling::run(options, log),
        Benchmark::Backends => backends::run(options, log),
        Benchmark::Rays => rays::run(options, log),
        Benchmark::Scenes => scenes::run(options, log),
        Benchmark::Indirect => indirect::run(options, log),
        Benchmark::Adaptive => adaptive::run(options, log),
    }
}
