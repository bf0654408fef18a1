//! `lightmesh crosscheck`: all backends against each other.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use clap::Args;
use glam::Vec3;

use super::error::{CommandError, Outcome};
use super::parse;
use super::shared::{MemoryArgs, QuietArgs, SceneArgs, ThreadArgs};
use crate::accel::{Backend, BackendChoice};
use crate::crosscheck::{Options, Subject, crosscheck, from_text, replay, watertightness};
use crate::image::OutputFile;
use crate::scene::Ray;

/// What `crosscheck` takes.
#[derive(Args, Debug)]
pub struct CrosscheckArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Rays to query every backend with, shared out between the kinds
    #[arg(long, value_name = "N", default_value_t = 1_000_000, value_parser = clap::value_parser!(u64).range(1..))]
    rays: u64,
    /// What the rays follow from
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
    /// Write the table and the unexplained rays as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Trace this ray, or the rays of a file, one a line, and print every answer
    #[arg(long, value_name = "FILE|RAY", allow_hyphen_values = true, conflicts_with_all = ["json", "rays", "seed"])]
    replay: Option<String>,
    /// The scene is closed around this point: count the rays from there that escape through vertices, edges and
    /// elsewhere, in place of the comparison; fails where more than one in 10⁷ does
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = parse::point, conflicts_with = "replay")]
    inside: Option<Vec3>,
    #[command(flatten)]
    memory: MemoryArgs,
    #[command(flatten)]
    threads: ThreadArgs,
    #[command(flatten)]
    quiet: QuietArgs,
}

/// Checks, and prints the table.
///
/// # Errors
/// See [`CommandError`].
pub fn run(args: &CrosscheckArgs, out: &mut dyn Write) -> Result<Outcome, CommandError> {
    let rays = args.replay.as_deref().map(rays_of).transpose()?;
    let json = args.json.as_deref().map(OutputFile::new).transpose()?;
    let reporter = args.quiet.reporter();
    let pool = args.threads.pool()?;
    let loaded = pool.install(|| args.scene.open(&reporter))?.loaded;
    let scene = &loaded.scene;

    args.memory.check(&args.scene, scene, &[BackendChoice::Bvh, BackendChoice::Auto])?;
    let (backends, notice) = pool.install(|| Backend::build_all(scene))?;
    if let Some(notice) = notice {
        reporter.line(&format!("note: {notice}"));
    }
    let names: Vec<_> = backends.iter().map(ToString::to_string).collect();
    let subjects: Vec<_> =
        names.iter().zip(&backends).map(|(name, backend)| Subject { name, accel: backend }).collect();

    if let Some(rays) = rays {
        let replay = pool.install(|| replay(scene, &subjects, &rays));
        write!(out, "{replay}")?;
        return Ok(Outcome::of(replay.is_clean()));
    }
    if let Some(inside) = args.inside {
        let result = pool.install(|| watertightness(scene, &subjects, inside, args.rays, args.seed));
        if let Some(file) = json {
            file.write(format!("{}\n", serde_json::json!(result)).as_bytes())?;
        }
        write!(out, "{result}")?;
        return Ok(Outcome::of(result.is_tight()));
    }
    let options = Options { rays: args.rays, seed: args.seed };
    let bar = reporter.bar("tracing");
    let done = std::sync::atomic::AtomicU64::new(0);
    let report = pool.install(|| {
        crosscheck(scene, &loaded.cameras, &subjects, &options, &|rays| {
            let before = done.fetch_add(rays, std::sync::atomic::Ordering::Relaxed);
            bar.set(before + rays, args.rays);
        })
    });
    bar.finish();
    if let Some(file) = json {
        file.write(format!("{}\n", report.to_json()).as_bytes())?;
    }
    write!(out, "{report}")?;
    Ok(Outcome::of(report.is_clean()))
}

/// The rays of a file, or the one ray that is given itself.
fn rays_of(text: &str) -> Result<Vec<Ray>, CommandError> {
    let path = Path::new(text);
    if text.contains(',') && !path.exists() {
        let place = "--replay".to_owned();
        return from_text(text).map(|ray| vec![ray]).map_err(|source| CommandError::Ray { place, source });
    }
    let content =
        fs::read_to_string(path).map_err(|source| CommandError::Read { file: path.to_owned(), source })?;
    let lines = (1..).zip(content.lines().map(str::trim)).filter(|(_, line)| !line.is_empty());
    lines
        .map(|(number, line)| {
            let place = format!("{text}, line {number}");
            from_text(line).map_err(|source| CommandError::Ray { place, source })
        })
        .collect()
}
