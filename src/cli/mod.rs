//! Subcommands of the program.

pub mod generate;
