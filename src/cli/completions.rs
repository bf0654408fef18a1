//! `lightmesh completions`: what a shell needs to complete the program's command lines.

use std::io::Write;

use clap::{Args, Command};
use clap_complete::{Shell, generate};

use super::error::{CommandError, Outcome};

/// What `completions` takes.
///
/// Prints a script for the shell. Bash, zsh and fish look for it in ~/.local/share/bash-completion/completions/lightmesh, in a file _lightmesh in a
/// folder of $fpath, and in ~/.config/fish/completions/lightmesh.fish.
#[derive(Args, Clone, Debug)]
pub struct CompletionsArgs {
    /// The shell
    shell: Shell,
}

/// Prints the script for `command`.
///
/// # Errors
/// [`CommandError::Print`].
pub fn run(
    args: &CompletionsArgs,
    mut command: Command,
    out: &mut dyn Write,
) -> Result<Outcome, CommandError> {
    // The generator panics where it can't write: it writes to memory.
    let mut script = Vec::new();
    let name = command.get_name().to_owned();
    generate(args.shell, &mut command, name, &mut script);
    out.write_all(&script)?;
    Ok(Outcome::Passed)
}
