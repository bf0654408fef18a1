//! The `lightmesh` program.

#![warn(clippy::unwrap_used, clippy::expect_used)]

use std::process::ExitCode;

fn main() -> ExitCode {
    lightmesh::cli::main()
}
