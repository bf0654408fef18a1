//! The `lightmesh` program.

use std::process::ExitCode;

fn main() -> ExitCode {
    lightmesh::cli::main()
}
