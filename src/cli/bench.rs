//! `lightmesh bench`.

use std::io::{self, Write};
use std::path::PathBuf;
use std::time::Duration;

use clap::Args;

use super::progress::Reporter;
use crate::accel::BackendChoice;
use crate::bench::{self, BenchError, BenchOptions, Benchmark};
use crate::image::{ImageError, OutputFile};

/// What `bench` takes.
#[derive(Args, Clone, Debug)]
pub struct BenchArgs {
    /// What to measure
    #[arg(value_enum, default_value_t)]
    pub benchmark: Benchmark,
    /// Write raw times and goals as JSON
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Write a report with plots as one HTML file
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,
    /// Cut all sizes down to see that everything runs; the numbers say nothing about speed
    #[arg(long)]
    pub quick: bool,
    /// Repetitions of each comparison; medians are compared
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u16).range(1..))]
    pub repetitions: u16,
    /// Start no further repetition of a comparison after this time
    #[arg(long, value_name = "SECONDS", default_value_t = 120, value_parser = clap::value_parser!(u32).range(1..))]
    pub seconds: u32,
    /// Threads; 0 for one per processor
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u16).range(..=1024))]
    pub threads: u16,
    /// Library that traces the rays, where backends aren't compared
    #[arg(long, value_enum, default_value_t)]
    pub backend: BackendChoice,
    /// Don't say what is being measured
    #[arg(short, long)]
    pub quiet: bool,
}

/// Why there is no result.
#[derive(Debug, thiserror::Error)]
pub enum BenchCommandError {
    /// The benchmark failed.
    #[error(transparent)]
    Bench(#[from] BenchError),
    /// A file can't be written.
    #[error(transparent)]
    Output(#[from] ImageError),
    /// Threads can't be started.
    #[error("cannot start the threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
    /// The result can't be told.
    #[error("cannot print: {0}")]
    Print(#[source] io::Error),
}

/// Runs a benchmark and prints its tables and goals. A goal that is missed is a result and no failure.
///
/// # Errors
/// See [`BenchCommandError`]; then no file has changed.
pub fn run(args: &BenchArgs, out: &mut dyn Write) -> Result<(), BenchCommandError> {
    let json = args.json.as_deref().map(OutputFile::new).transpose()?;
    let html = args.html.as_deref().map(OutputFile::new).transpose()?;
    let reporter = Reporter::new(args.quiet);
    let options = BenchOptions {
        quick: args.quick,
        repetitions: usize::from(args.repetitions),
        limit: Some(Duration::from_secs(u64::from(args.seconds))),
        backend: args.backend,
        // A system that doesn't tell leaves measurements of whole processes out.
        program: std::env::current_exe().ok(),
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(usize::from(args.threads)).build()?;
    // The threads of the pool measure; this one listens, so that the listener need not be shared.
    let (sender, messages) = std::sync::mpsc::channel::<String>();
    let report = std::thread::scope(|scope| {
        let measured = scope.spawn(|| {
            // A listener that has gone wants to hear nothing.
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
    write!(out, "{report}").map_err(BenchCommandError::Print)
}
