//! The program's command line: one file per subcommand.

mod bake;
mod bench;
mod cameras;
mod choice;
pub mod compare;
mod completions;
mod crosscheck;
mod display;
mod error;
mod events;
mod examples;
mod export;
mod frames;
pub mod gallery;
mod generate;
mod image_info;
mod info;
mod init;
mod interrupt;
mod job;
mod layers;
mod light_mesh;
mod man;
mod merge;
mod mesh_info;
mod overrides;
mod parse;
mod partial;
mod probe;
mod progress;
mod ready;
mod region;
mod render;
mod render_args;
mod resume;
mod shared;
mod sinks;
mod stats_file;
mod version;
mod written;

use std::io::{self, ErrorKind, Write};
use std::process::ExitCode;

use clap::error::ErrorKind as UsageError;
use clap::{CommandFactory as _, FromArgMatches as _, Parser, Subcommand};

pub use error::{CommandError, Outcome, describe};

use self::shared::QuietArgs;

/// Renders large triangle scenes with many lights by light meshes.
#[derive(Debug, Parser)]
#[command(name = "lightmesh", version, about, propagate_version = true)]
struct Cli {
    #[command(flatten)]
    quiet: QuietArgs,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Render a scene file to an image.
    Render(Box<render_args::RenderArgs>),
    /// Evaluate a scene's light mesh and keep it in a file, for any number of renders.
    Bake(Box<bake::BakeArgs>),
    /// Put parts of an image together that `render --tile` or `--crop` wrote.
    Merge(merge::MergeArgs),
    /// Measure light at points, along a line, on a plane or in a grid.
    Probe(Box<probe::ProbeArgs>),
    /// Write mesh points and their light, for ParaView and others.
    Export(export::ExportArgs),
    /// Report what a scene file, model, EXR image or light mesh holds.
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
    /// Measure how far an image is from a reference.
    Compare(compare::CompareArgs),
    /// Print what a shell needs to complete command lines.
    Completions(completions::CompletionsArgs),
    /// Write manual pages.
    Man(man::ManArgs),
}

/// The declaration of the whole command line, with examples.
fn command() -> clap::Command {
    examples::with_examples(Cli::command())
}

impl Cli {
    /// Parses the program's command line.
    fn of_program() -> Result<Self, clap::Error> {
        let mut command = command();
        let matches = command.try_get_matches_from_mut(std::env::args_os())?;
        Self::from_arg_matches(&matches).map_err(|error| error.format(&mut command))?.checked()
    }

    /// Refuses what the declarations of the flags can't express.
    fn checked(self) -> Result<Self, clap::Error> {
        let checked = match &self.command {
            Command::Bench(args) => args.check(),
            Command::Probe(args) => args.check(),
            Command::Export(args) => args.check(),
            _ => Ok(()),
        };
        checked.map_err(|text| command().error(UsageError::ArgumentConflict, text))?;
        Ok(self)
    }
}

impl Command {
    fn run(&self, out: &mut dyn Write) -> Result<Outcome, CommandError> {
        match self {
            Self::Render(args) => render::run(args),
            Self::Bake(args) => bake::run(args),
            Self::Merge(args) => merge::run(args),
            Self::Probe(args) => probe::run(args),
            Self::Export(args) => export::run(args),
            Self::Info(args) => info::run(args, out),
            Self::Init(args) => init::run(args),
            Self::Generate(args) => generate::run(args),
            Self::Bench(args) => bench::run(args, out),
            Self::Crosscheck(args) => crosscheck::run(args, out),
            Self::Gallery(args) => gallery::run(args),
            Self::Compare(args) => compare::run(args, out),
            Self::Completions(args) => completions::run(args, command(), out),
            Self::Man(args) => man::run(args, command(), out),
        }
    }
}

/// Exit code of wrong usage; clap's own.
const USAGE: u8 = 2;

/// Runs the program: parses the command line, runs the subcommand, reports an error once.
///
/// Exit codes: 0 for success, 1 for failure, 2 for wrong usage, 3 for a light mesh of another scene, 130 or 143 for Ctrl-C or SIGTERM.
pub fn main() -> ExitCode {
    let cli = match Cli::of_program() {
        Ok(cli) => cli,
        Err(error)
            if error.kind() == UsageError::DisplayVersion && version::wants_details(std::env::args_os()) =>
        {
            let _ = write!(io::stdout(), "{}", version::details());
            return ExitCode::SUCCESS;
        }
        Err(error) => {
            // A closed pipe behind --help is not an error.
            let _ = error.print();
            return ExitCode::from(if error.use_stderr() { USAGE } else { 0 });
        }
    };
    // Not locked: other threads report progress there, if they are asked to.
    let mut out = Output(io::stdout());
    let result = cli.command.run(&mut out).and_then(|outcome| {
        out.flush()?;
        Ok(outcome)
    });
    match result {
        Ok(outcome) => outcome.into(),
        Err(error) => {
            cli.quiet.reporter().error(&describe(&error));
            error.exit_code()
        }
    }
}

/// Standard output. A reader that closes it has seen enough: what is written from then on is dropped, which is no
/// error and changes no outcome.
struct Output<W>(W);

impl<W: Write> Write for Output<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        unless_closed(self.0.write(bytes), bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        unless_closed(self.0.flush(), ())
    }
}

/// The result, or `dropped` if the reader has gone.
fn unless_closed<T>(result: io::Result<T>, dropped: T) -> io::Result<T> {
    match result {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(dropped),
        result => result,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Clap's own checks: no flag is declared twice, defaults can be parsed.
    #[test]
    fn the_command_line_is_consistent() {
        command().debug_assert();
    }

    /// A writer that fails in one way.
    struct Failing(ErrorKind);

    impl Write for Failing {
        fn write(&mut self, _: &[u8]) -> io::Result<usize> {
            Err(self.0.into())
        }

        fn flush(&mut self) -> io::Result<()> {
            Err(self.0.into())
        }
    }

    /// A result that was computed is not lost because the reader has gone; a full disk is an error all the same.
    #[test]
    fn only_a_closed_pipe_is_forgiven() {
        let mut closed = Output(Failing(ErrorKind::BrokenPipe));
        assert!(closed.write_all(b"result").is_ok() && closed.flush().is_ok());
        let mut full = Output(Failing(ErrorKind::StorageFull));
        assert!(full.write_all(b"result").is_err() && full.flush().is_err());
    }
}
