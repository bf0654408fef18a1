//! The program's command line: one file per subcommand.

mod bake;
mod bench;
mod choice;
pub mod compare;
mod crosscheck;
mod error;
mod frames;
pub mod gallery;
mod generate;
mod info;
mod init;
mod interrupt;
mod job;
mod light_mesh;
mod merge;
mod overrides;
mod parse;
mod partial;
mod progress;
mod ready;
mod region;
mod render;
mod resume;
mod shared;
mod sinks;
mod stats_file;
mod written;

use std::io::{self, ErrorKind, Write};
use std::process::ExitCode;

use clap::error::ErrorKind as UsageError;
use clap::{CommandFactory as _, Parser, Subcommand};

pub use error::{CommandError, Outcome, describe};

/// Renders large triangle scenes with many lights by light meshes.
#[derive(Debug, Parser)]
#[command(name = "lightmesh", version, about, propagate_version = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Render a scene file to an image.
    Render(Box<render::RenderArgs>),
    /// Evaluate a scene's light mesh and keep it in a file, for any number of renders.
    Bake(Box<bake::BakeArgs>),
    /// Put parts of an image together that `render --tile` or `--crop` wrote.
    Merge(merge::MergeArgs),
    /// Report what a scene file or model holds.
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
}

impl Cli {
    /// Refuses what the declarations of the flags can't express.
    fn checked(self) -> Result<Self, clap::Error> {
        if let Command::Bench(args) = &self.command {
            args.check().map_err(|text| Self::command().error(UsageError::ArgumentConflict, text))?;
        }
        Ok(self)
    }
}

impl Command {
    fn run(&self, out: &mut dyn Write) -> Result<Outcome, CommandError> {
        match self {
            Self::Render(args) => render::run(args),
            Self::Bake(args) => bake::run(args),
            Self::Merge(args) => merge::run(args),
            Self::Info(args) => info::run(args, out),
            Self::Init(args) => init::run(args),
            Self::Generate(args) => generate::run(args),
            Self::Bench(args) => bench::run(args, out),
            Self::Crosscheck(args) => crosscheck::run(args, out),
            Self::Gallery(args) => gallery::run(args),
            Self::Compare(args) => compare::run(args, out),
        }
    }
}

/// Exit code of wrong usage; clap's own.
const USAGE: u8 = 2;

/// Runs the program: parses the command line, runs the subcommand, reports an error once.
///
/// Exit codes: 0 for success, 1 for failure, 2 for wrong usage, 3 for a light mesh of another scene, 130 or 143 for Ctrl-C or SIGTERM.
pub fn main() -> ExitCode {
    let cli = match Cli::try_parse().and_then(Cli::checked) {
        Ok(cli) => cli,
        Err(error) => {
            // A closed pipe behind --help is not an error.
            let _ = error.print();
            return ExitCode::from(if error.use_stderr() { USAGE } else { 0 });
        }
    };
    let mut out = Output(io::stdout().lock());
    let result = cli.command.run(&mut out).and_then(|outcome| {
        out.flush()?;
        Ok(outcome)
    });
    match result {
        Ok(outcome) => outcome.into(),
        Err(error) => {
            let _ = writeln!(io::stderr(), "lightmesh: {}", describe(&error));
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
        Cli::command().debug_assert();
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
