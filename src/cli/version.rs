//! `lightmesh --version --verbose`: what this build is, and what it finds on this machine.

use std::ffi::OsStr;
use std::fmt::Write;

use crate::accel::embree_libraries;
use crate::simd::instruction_set;

/// The optional features that a build can have, each with whether this one has it.
const FEATURES: [(&str, bool); 3] =
    [("cli", cfg!(feature = "cli")), ("embree", cfg!(feature = "embree")), ("flip", cfg!(feature = "flip"))];

/// Whether a command line that asks for the version asks for details too.
pub fn wants_details<T: AsRef<OsStr>>(arguments: impl IntoIterator<Item = T>) -> bool {
    arguments.into_iter().any(|argument| {
        let argument = argument.as_ref();
        argument == "--verbose" || argument == "-v" || argument == "-Vv" || argument == "-vV"
    })
}

/// The version and what else tells builds and machines apart, a line each.
pub fn details() -> String {
    let mut text = format!("lightmesh {}\n", env!("CARGO_PKG_VERSION"));
    let mut line = |name: &str, value: &str| {
        // Writing to a String can't fail.
        let _ = writeln!(text, "{name:<13} {value}");
    };
    line("commit", or(env!("LIGHTMESH_REVISION"), "unknown"));
    line("target", env!("LIGHTMESH_TARGET"));
    let features: Vec<&str> = FEATURES.iter().filter(|(_, has)| *has).map(|(name, _)| *name).collect();
    line("features", &features.join(", "));
    line("built for", or(env!("LIGHTMESH_TARGET_FEATURES"), "the target's plain instructions"));
    line("instructions", instruction_set());
    line("threads", &rayon::current_num_threads().to_string());
    match embree_libraries() {
        Ok(libraries) => libraries.iter().for_each(|library| line("embree", library)),
        Err(reason) => line("embree", &format!("none: {reason}")),
    }
    line("bvh", "built in");
    text
}

fn or<'a>(text: &'a str, otherwise: &'a str) -> &'a str {
    if text.is_empty() { otherwise } else { text }
}
