//! `lightmesh bench`.

use std::io::Write;
use std::path::PathBuf;
use std::time::Duration;

use clap::Args;

use super::choice::named;
use super::error::{CommandError, Outcome};
use super::parse;
use super::shared::{BackendArgs, QuietArgs, ThreadArgs};
use crate::bench::{self, BenchOptions, Benchmark};
use crate::image::OutputFile;

/// What `bench` takes.
#[derive(Args, Clone, Debug)]
pub struct BenchArgs {
    /// What to measure
    #[arg(default_value_t, value_parser = named::<Benchmark>())]
    benchmark: Benchmark,
    /// With `scenes`, `indirect` and `adaptive`: scene files, models, and folders, which stand for all scenes in them [default: scenes; with `adaptive` a
    /// forest and a hall of its own]
    #[arg(value_name = "SCENE")]
    scenes: Vec<PathBuf>,
    /// With the same: size of the images instead of each scene's own
    #[arg(long, value_name = "WxH", value_parser = parse::resolution)]
    resolution: Option<(u32, u32)>,
    /// With `scenes` and `indirect`: camera rays per pixel; without it one with `scenes`, where light is compared, and each scene's own with `indirect`
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65536))]
    spp: Option<u32>,
    /// Write raw times and goals as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Write a report with plots as one HTML file
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
    /// Cut all sizes down to see that everything runs; the numbers say nothing about speed
    #[arg(long)]
    quick: bool,
    /// Repetitions of each comparison; medians are compared
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u16).range(1..))]
    repetitions: u16,
    /// Start no further repetition of a comparison after this time
    #[arg(long, value_name = "SECONDS", default_value_t = 120, value_parser = clap::value_parser!(u32).range(1..))]
    seconds: u32,
    #[command(flatten)]
    threads: ThreadArgs,
    #[command(flatten)]
    backend: BackendArgs,
    #[command(flatten)]
    quiet: QuietArgs,
}

/// The folder of scenes that are measured if none are named, seen from the repository's root.
const SCENES: &str = "scenes";

impl BenchArgs {
    /// Refuses scenes for a benchmark that makes its own, and samples for one that takes one per pixel.
    pub fn check(&self) -> Result<(), String> {
        let takes_scenes = match self.benchmark {
            Benchmark::Scenes | Benchmark::Indirect => return Ok(()),
            Benchmark::Adaptive => true,
            _ => self.scenes.is_empty() && self.resolution.is_none(),
        };
        if takes_scenes && self.spp.is_none() {
            return Ok(());
        }
        Err(format!(
            "`bench {}` makes its own scenes or samples; only `bench scenes`, `bench indirect` and `bench adaptive` take scenes and \
             --resolution, and the first two of them --spp",
            self.benchmark
        ))
    }

    fn scenes(&self) -> Vec<PathBuf> {
        let makes_its_own = self.benchmark == Benchmark::Adaptive;
        if self.scenes.is_empty() && !makes_its_own {
            vec![PathBuf::from(SCENES)]
        } else {
            self.scenes.clone()
        }
    }
}

/// Runs a benchmark and prints its tables and goals. A goal that is missed is a result and no failure.
///
/// # Errors
/// See [`CommandError`]; then no file has changed, except for [`CommandError::NotMeasured`], which comes after everything
/// that was measured is printed and written.
pub fn run(args: &BenchArgs, out: &mut dyn Write) -> Result<Outcome, CommandError> {
    let json = args.json.as_deref().map(OutputFile::new).transpose()?;
    let html = args.html.as_deref().map(OutputFile::new).transpose()?;
    let reporter = args.quiet.reporter();
    let options = BenchOptions {
        quick: args.quick,
        repetitions: usize::from(args.repetitions),
        limit: Some(Duration::from_secs(u64::from(args.seconds))),
        backend: args.backend.backend,
        // A system that doesn't report its path leaves measurements of whole processes out.
        program: std::env::current_exe().ok(),
        scenes: args.scenes(),
        resolution: args.resolution,
        samples_per_pixel: args.spp,
    };
    reporter.detail(&format!("options: {options:?}"));
    let pool = args.threads.pool()?;
    // The threads of the pool measure; this one listens, so that the listener need not be shared.
    let (sender, messages) = std::sync::mpsc::channel::<String>();
    let report = std::thread::scope(|scope| {
        let measured = scope.spawn(|| {
            // Nobody receives what comes after the end of the measurement.
            pool.install(move || {
                bench::run(args.benchmark, &options, &|text| drop(sender.send(text.to_owned())))
            })
        });
        messages.iter().for_each(|text| reporter.line(&format!("measuring: {text}")));
        measured.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    })?;
    if let Some(file) = json {
        file.write(format!("{}\n", serde_json::json!(report)).as_bytes())?;
    }
    if let Some(file) = html {
        file.write(bench::to_html(&report).as_bytes())?;
    }
    write!(out, "{report}")?;
    let failures = report.results.into_iter().flat_map(|results| results.failures);
    let failures: Vec<String> = failures.map(|failure| failure.error).collect();
    if !failures.is_empty() {
        out.flush()?;
        return Err(CommandError::NotMeasured(failures));
    }
    Ok(Outcome::Passed)
}
