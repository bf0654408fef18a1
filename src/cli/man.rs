//! `lightmesh man`: manual pages, one per command.

use std::fs;
use std::io::{self, Write};
use std::path::PathBuf;

use clap::{Args, Command};
use clap_mangen::Man;
use clap_mangen::roff::{Roff, bold, roman};

use super::error::{CommandError, Outcome};
use super::examples::{Example, examples_of};
use super::shared::QuietArgs;
use crate::image::OutputFile;

/// What `man` takes.
///
/// Without a folder it prints the program's own page. A folder gets one page per command: lightmesh.1, lightmesh-render.1 and so on, as they belong into
/// a folder man1 of the manual's path.
#[derive(Args, Clone, Debug)]
pub struct ManArgs {
    /// Folder to write all pages into, created if need be
    #[arg(value_name = "DIR")]
    folder: Option<PathBuf>,
    #[command(flatten)]
    quiet: QuietArgs,
}

/// Writes the pages about `command` and its subcommands.
///
/// # Errors
/// [`CommandError::Print`], [`CommandError::Folder`] and [`CommandError::Image`], which names the file.
pub fn run(args: &ManArgs, command: Command, out: &mut dyn Write) -> Result<Outcome, CommandError> {
    // `help COMMAND` needs no page of its own.
    let mut command = command.disable_help_subcommand(true);
    command.build();
    let Some(folder) = &args.folder else {
        out.write_all(&page(&command, &[])?)?;
        return Ok(Outcome::Passed);
    };
    fs::create_dir_all(folder).map_err(|source| CommandError::Folder { folder: folder.clone(), source })?;
    let reporter = args.quiet.reporter();
    for (name, page) in pages(&command)? {
        let path = folder.join(name);
        OutputFile::new(&path)?.write(&page)?;
        reporter.detail(&format!("wrote {}", path.display()));
    }
    Ok(Outcome::Passed)
}

/// All pages with the names of their files, the program's own first.
fn pages(command: &Command) -> Result<Vec<(String, Vec<u8>)>, io::Error> {
    let mut pages = Vec::new();
    let mut left = vec![(command, Vec::new())];
    while let Some((command, path)) = left.pop() {
        let name = command.get_display_name().unwrap_or(command.get_name());
        pages.push((format!("{name}.1"), page(command, &path)?));
        left.extend(command.get_subcommands().map(|sub| (sub, [&path[..], &[sub.get_name()]].concat())));
    }
    Ok(pages)
}

/// The page of the command that is found at `path` below the program.
fn page(command: &Command, path: &[&str]) -> Result<Vec<u8>, io::Error> {
    let version = concat!("lightmesh ", env!("CARGO_PKG_VERSION"));
    let man = Man::new(command.clone()).source(version).manual("lightmesh");
    let mut page = Vec::new();
    man.render_title(&mut page)?;
    man.render_name_section(&mut page)?;
    man.render_synopsis_section(&mut page)?;
    man.render_description_section(&mut page)?;
    man.render_options_section(&mut page)?;
    if command.get_subcommands().next().is_some() {
        man.render_subcommands_section(&mut page)?;
    }
    examples(path).to_writer(&mut page)?;
    exit_status().to_writer(&mut page)?;
    man.render_version_section(&mut page)?;
    Ok(page)
}

/// Examples as manual pages have them: a command line in bold, and what it does.
fn examples(path: &[&str]) -> Roff {
    let mut roff = Roff::new();
    roff.control("SH", ["EXAMPLES"]);
    for Example { line, what } in examples_of(path) {
        roff.control("TP", []).text([bold(*line)]).text([roman(*what)]);
    }
    roff
}

fn exit_status() -> Roff {
    let mut roff = Roff::new();
    roff.control("SH", ["EXIT STATUS"]);
    roff.text([roman("0 for success, 1 for failure, 2 for wrong usage.")]);
    roff
}
