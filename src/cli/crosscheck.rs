//! `lightmesh crosscheck`: all backends against each other.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use clap::Args;
use glam::Vec3;

use super::progress::Reporter;
use crate::accel::{Backend, BackendChoice, BackendError, MemoryLimitError, check_memory, parse_size};
use crate::crosscheck::{Options, RayTextError, Subject, crosscheck, from_text, replay, watertightness};
use crate::image::{ImageError, OutputFile};
use crate::render::Progress;
use crate::scene::Ray;
use crate::scene::load::{LoadError, open_scene};

/// What `crosscheck` takes.
#[derive(Args, Debug)]
pub struct CrosscheckArgs {
    /// Scene file (TOML) or model (.glb, .gltf, .obj, .ply; also .gz and .zst)
    pub scene: PathBuf,
    /// Rays to ask every backend about, shared out between the kinds
    #[arg(long, value_name = "N", default_value_t = 1_000_000, value_parser = clap::value_parser!(u64).range(1..))]
    pub rays: u64,
    /// What the rays follow from
    #[arg(long, value_name = "S", default_value_t = 1)]
    pub seed: u64,
    /// Write the table and the unexplained rays as JSON
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Ask about this ray, or the rays of a file, one a line, and tell every answer
    #[arg(long, value_name = "FILE|RAY", allow_hyphen_values = true, conflicts_with_all = ["json", "rays", "seed"])]
    pub replay: Option<String>,
    /// The scene is closed around this point: count the rays from there that escape through vertices, edges and
    /// elsewhere, in place of the comparison; fails where more than one in 10⁷ does
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = point, conflicts_with = "replay")]
    pub inside: Option<Vec3>,
    /// Refuse a scene that would take more memory in all backends together, by an estimate: 500M, 8G
    #[arg(long, value_name = "SIZE", value_parser = parse_size)]
    pub memory_limit: Option<u64>,
    /// Threads; 0 for one per processor
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u16).range(..=1024))]
    pub threads: u16,
    /// Say nothing but errors and the result
    #[arg(short, long)]
    pub quiet: bool,
}

/// What came out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// All disagreements are explained.
    Passed,
    /// Some are not.
    Failed,
}

/// Why nothing was checked.
#[derive(Debug, thiserror::Error)]
pub enum CrosscheckError {
    /// The scene can't be read.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// A backend that is there failed.
    #[error(transparent)]
    Backend(#[from] BackendError),
    /// The scene is larger than allowed.
    #[error("{}: {error}", scene.display())]
    MemoryLimit {
        /// The scene file.
        scene: PathBuf,
        /// The estimate.
        error: MemoryLimitError,
    },
    /// The file with rays can't be read.
    #[error("cannot read {}: {error}", file.display())]
    Rays {
        /// The file.
        file: PathBuf,
        /// Why.
        error: io::Error,
    },
    /// A ray of the file or the command line is none.
    #[error("{place}: {error}")]
    Ray {
        /// Where it stands.
        place: String,
        /// What is wrong.
        error: RayTextError,
    },
    /// The JSON can't be written.
    #[error(transparent)]
    Output(#[from] ImageError),
    /// Threads can't be started.
    #[error("cannot start the threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
    /// The result can't be told.
    #[error("cannot print: {0}")]
    Print(#[source] io::Error),
}

/// Checks, and prints the table.
///
/// # Errors
/// See [`CrosscheckError`].
pub fn run(args: &CrosscheckArgs, out: &mut dyn Write) -> Result<Verdict, CrosscheckError> {
    let rays = args.replay.as_deref().map(rays_of).transpose()?;
    let json = args.json.as_deref().map(OutputFile::new).transpose()?;
    let reporter = Reporter::new(args.quiet);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(usize::from(args.threads)).build()?;
    let loaded = pool.install(|| open_scene(&args.scene))?.loaded;
    let scene = &loaded.scene;

    check_memory(scene, &[BackendChoice::Bvh, BackendChoice::Auto], args.memory_limit)
        .map_err(|error| CrosscheckError::MemoryLimit { scene: args.scene.clone(), error })?;
    let (backends, notice) = pool.install(|| Backend::build_all(scene))?;
    if let Some(notice) = notice {
        reporter.line(&format!("note: {notice}"));
    }
    let names: Vec<_> = backends.iter().map(ToString::to_string).collect();
    let subjects: Vec<_> =
        names.iter().zip(&backends).map(|(name, backend)| Subject { name, accel: backend }).collect();

    if let Some(rays) = rays {
        let replay = pool.install(|| replay(scene, &subjects, &rays));
        write!(out, "{replay}").map_err(CrosscheckError::Print)?;
        return Ok(verdict(replay.is_clean()));
    }
    if let Some(inside) = args.inside {
        let result = pool.install(|| watertightness(scene, &subjects, inside, args.rays, args.seed));
        if let Some(file) = json {
            file.write(format!("{}\n", serde_json::json!(result)).as_bytes())?;
        }
        write!(out, "{result}").map_err(CrosscheckError::Print)?;
        return Ok(verdict(result.is_tight()));
    }
    let options = Options { rays: args.rays, seed: args.seed };
    let bar = reporter.bar("tracing");
    let done = std::sync::atomic::AtomicU64::new(0);
    let report = pool.install(|| {
        crosscheck(scene, &loaded.cameras, &subjects, &options, &|rays| {
            let before = done.fetch_add(rays, std::sync::atomic::Ordering::Relaxed);
            bar.pixels(before + rays, args.rays);
        })
    });
    bar.finish();
    if let Some(file) = json {
        file.write(format!("{}\n", report.to_json()).as_bytes())?;
    }
    write!(out, "{report}").map_err(CrosscheckError::Print)?;
    Ok(verdict(report.is_clean()))
}

fn point(text: &str) -> Result<Vec3, String> {
    let numbers: Option<Vec<f32>> =
        text.split(',').map(|number| number.trim().parse().ok().filter(|x: &f32| x.is_finite())).collect();
    match numbers.as_deref() {
        Some(&[x, y, z]) => Ok(Vec3::new(x, y, z)),
        _ => Err("three numbers, such as 0,1.5,-2".to_owned()),
    }
}

fn verdict(clean: bool) -> Verdict {
    if clean { Verdict::Passed } else { Verdict::Failed }
}

/// The rays of a file, or the one ray that is given itself.
fn rays_of(text: &str) -> Result<Vec<Ray>, CrosscheckError> {
    let path = Path::new(text);
    if text.contains(',') && !path.exists() {
        let place = "--replay".to_owned();
        return from_text(text).map(|ray| vec![ray]).map_err(|error| CrosscheckError::Ray { place, error });
    }
    let content =
        fs::read_to_string(path).map_err(|error| CrosscheckError::Rays { file: path.to_owned(), error })?;
    let lines = (1..).zip(content.lines().map(str::trim)).filter(|(_, line)| !line.is_empty());
    lines
        .map(|(number, line)| {
            let place = format!("{text}, line {number}");
            from_text(line).map_err(|error| CrosscheckError::Ray { place, error })
        })
        .collect()
}
