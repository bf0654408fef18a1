//! Measurements of speed, made by `lightmesh bench`.
//!
//! Everything that is compared runs in one process, in turn, and medians are reported with all raw times, so that
//! ratios mean something on a machine that does other things as well.

mod backends;
mod configuration;
mod curve;
mod headline;
mod html;
mod machine;
mod rays;
mod report;
mod scaling;
mod setup;
mod shading;
mod threads;
mod timing;

use std::fmt;
use std::path::PathBuf;
use std::time::Duration;

pub use html::to_html;
pub use report::Report;

use self::timing::Budget;
use crate::accel::{BackendChoice, BackendError};
use crate::image::ImageError;
use crate::light_mesh::MeshError;
use crate::scene::generate::GenerateError;
use crate::scene::load::LoadError;

/// What can be measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Benchmark {
    /// The paper's comparison: a forest by light mesh and by conventional tracing.
    #[default]
    Headline,
    /// Time over resolution, lights, triangles, spacing and threads.
    Scaling,
    /// Rays per second of all backends, by kind of ray and packet width.
    Backends,
    /// Evaluation of mesh points against a loop that only traces the same rays.
    Rays,
}

impl Benchmark {
    /// The name of each benchmark, the benchmark, and what it measures.
    pub const NAMES: [(&'static str, Self, &'static str); 4] = [
        (
            "headline",
            Self::Headline,
            "The paper's comparison: a forest by light mesh and by conventional tracing",
        ),
        ("scaling", Self::Scaling, "Time over resolution, lights, triangles, spacing and threads"),
        ("backends", Self::Backends, "Rays per second of all backends, by kind of ray and packet width"),
        ("rays", Self::Rays, "Evaluation of mesh points against a loop that only traces the same rays"),
    ];
}

impl fmt::Display for Benchmark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let named = Self::NAMES.iter().find(|(_, benchmark, _)| benchmark == self);
        f.write_str(named.map_or("", |(name, ..)| name))
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
    /// No backend.
    #[error(transparent)]
    Backend(#[from] BackendError),
    /// A light mesh can't be set up.
    #[error(transparent)]
    Mesh(#[from] MeshError),
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
    }
}
