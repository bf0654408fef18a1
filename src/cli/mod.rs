//! The program's command line: one file per subcommand.

pub mod bench;
pub mod compare;
pub mod crosscheck;
pub mod gallery;
mod gallery_page;
pub mod generate;
pub mod info;
pub mod init;
mod progress;
pub mod render;
mod stats_file;

use std::io::{self, ErrorKind, Write};
use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// Renders large triangle scenes with many lights by light meshes.
#[derive(Debug, Parser)]
#[command(name = "lightmesh", version, about, propagate_version = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Render a scene file to a picture.
    Render(Box<render::RenderArgs>),
    /// Tell what a scene file or model holds.
    Info(info::InfoArgs),
    /// Write a scene file for a model, with the camera, lights and settings that were chosen.
    Init(init::InitArgs),
    /// Write a procedural scene.
    Generate(generate::GenerateArgs),
    /// Measure speed.
    Bench(bench::BenchArgs),
    /// Trace rays with every backend and judge what they disagree about.
    Crosscheck(crosscheck::CrosscheckArgs),
    /// Render the scenes of a list and write a page about them.
    Gallery(gallery::GalleryArgs),
    /// Measure how far a picture is from a reference.
    Compare(compare::CompareArgs),
}

/// Exit code of wrong usage; clap's own.
const USAGE: u8 = 2;

/// Runs the program: parses the command line, runs the subcommand, reports an error once.
///
/// Exit codes: 0 for success, 1 for failure, 2 for wrong usage.
pub fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => {
            // A closed pipe behind --help is not an error.
            let _ = error.print();
            return ExitCode::from(if error.use_stderr() { USAGE } else { 0 });
        }
    };
    let mut out = io::stdout().lock();
    let result = match &cli.command {
        Command::Render(args) => render::run(args).map_err(anything),
        Command::Info(args) => match info::run(args, &mut out) {
            Ok(()) => Ok(()),
            Err(info::InfoError::Output(error)) => Err(anything(error)),
            Err(error) => Err(anything(error)),
        },
        Command::Init(args) => init::run(args).map_err(anything),
        Command::Generate(args) => generate::run(args).map_err(anything),
        Command::Bench(args) => match bench::run(args, &mut out) {
            Err(bench::BenchCommandError::Print(error)) => Err(anything(error)),
            result => result.map_err(anything),
        },
        Command::Crosscheck(args) => match crosscheck::run(args, &mut out) {
            Ok(crosscheck::Verdict::Passed) => Ok(()),
            Ok(crosscheck::Verdict::Failed) => {
                // What could not be told makes no difference to the verdict.
                let _ = out.flush();
                return ExitCode::FAILURE;
            }
            Err(crosscheck::CrosscheckError::Print(error)) => Err(anything(error)),
            Err(error) => Err(anything(error)),
        },
        Command::Gallery(args) => gallery::run(args).map_err(anything),
        Command::Compare(args) => match compare::run(args, &mut out) {
            Ok(compare::Verdict::Passed) => Ok(()),
            Ok(compare::Verdict::Failed) => return ExitCode::FAILURE,
            Err(compare::CompareError::Print(error)) => Err(Box::new(error) as Box<dyn std::error::Error>),
            Err(error) => Err(anything(error)),
        },
    };
    match result.and_then(|()| out.flush().map_err(anything)) {
        Ok(()) => ExitCode::SUCCESS,
        // Whoever reads the output has seen enough.
        Err(error) if is_broken_pipe(&*error) => ExitCode::SUCCESS,
        Err(error) => {
            let _ = writeln!(io::stderr(), "lightmesh: {error}");
            ExitCode::FAILURE
        }
    }
}

fn anything(error: impl std::error::Error + 'static) -> Box<dyn std::error::Error> {
    Box::new(error)
}

fn is_broken_pipe(error: &(dyn std::error::Error + 'static)) -> bool {
    error.downcast_ref::<io::Error>().is_some_and(|error| error.kind() == ErrorKind::BrokenPipe)
}
