//! Build facts for the program's own reports, and the check of the vendored Embree bindings against
//! the headers that are installed.
//!
//! The check compiles C static assertions, made from the sizes, offsets and constants that the
//! bindings state, with each version's `rtcore.h` that is found. Without headers there is nothing to
//! check against, and nothing is needed: Embree is loaded at run time.

use std::{
    env, fs,
    path::{Path, PathBuf},
    process::{Command, exit},
};

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-env=LIGHTMESH_REVISION={}", revision().unwrap_or_default());
    println!("cargo::rustc-env=LIGHTMESH_TARGET={}", variable("TARGET"));
    println!("cargo::rustc-env=LIGHTMESH_TARGET_FEATURES={}", variable("CARGO_CFG_TARGET_FEATURE"));

    if env::var_os("CARGO_FEATURE_EMBREE").is_some() {
        for major in [3, 4] {
            if let Err(message) = check_bindings(major) {
                eprintln!("{message}");
                exit(1);
            }
        }
    }
}

fn variable(name: &str) -> String {
    env::var(name).unwrap_or_default()
}

/// The commit that a release is built from; nothing in other builds, which would be compiled anew after
/// every commit, and outside of a checkout.
fn revision() -> Option<String> {
    println!("cargo::rerun-if-env-changed=PROFILE");
    if variable("PROFILE") != "release" {
        return None;
    }
    let git = |arguments: &[&str]| {
        let output = Command::new("git").args(arguments).output().ok().filter(|o| o.status.success())?;
        Some(String::from_utf8(output.stdout).ok()?.trim().to_owned())
    };
    // Not the revision of some checkout that merely contains an unpacked copy of this one.
    let top = fs::canonicalize(git(&["rev-parse", "--show-toplevel"])?).ok()?;
    if top != fs::canonicalize(variable("CARGO_MANIFEST_DIR")).ok()? {
        return None;
    }
    // Git appends to this file whenever the commit that is checked out changes.
    let log = git(&["rev-parse", "--git-path", "logs/HEAD"])?;
    if Path::new(&log).exists() {
        println!("cargo::rerun-if-changed={log}");
    }
    git(&["rev-parse", "--short=12", "HEAD"])
}

/// Folders where C compilers look for headers, as far as that can be known without asking one.
fn include_folders() -> Vec<PathBuf> {
    let mut folders = Vec::new();
    for name in ["CPATH", "C_INCLUDE_PATH"] {
        println!("cargo::rerun-if-env-changed={name}");
        folders.extend(env::split_paths(&variable(name)).filter(|folder| folder.is_absolute()));
    }
    folders.extend(["/usr/local/include", "/usr/include"].map(PathBuf::from));
    folders
}

/// Compares the bindings of one version with the headers of that version, where there are any.
fn check_bindings(major: u32) -> Result<(), String> {
    let bindings = format!("vendor-bindings/src/bindings/embree{major}.rs");
    println!("cargo::rerun-if-changed={bindings}");
    // Headers of this machine say nothing about another one.
    if variable("HOST") != variable("TARGET") {
        return Ok(());
    }
    let header = include_folders()
        .into_iter()
        .map(|folder| folder.join(format!("embree{major}/rtcore.h")))
        .find(|header| header.exists());
    let Some(header) = header else { return Ok(()) };
    // Only what exists may be watched: cargo takes a missing file for one that always changes.
    let names =
        ["rtcore", "rtcore_common", "rtcore_config", "rtcore_device", "rtcore_geometry", "rtcore_ray"];
    for name in names.into_iter().chain(["rtcore_buffer", "rtcore_scene"]) {
        let part = header.with_file_name(format!("{name}.h"));
        if part.exists() {
            println!("cargo::rerun-if-changed={}", part.display());
        }
    }

    let text = fs::read_to_string(&bindings).map_err(|error| format!("cannot read {bindings}: {error}"))?;
    let assertions = assertions(&text);
    if assertions.len() < 200 {
        return Err(format!("{bindings} states only {} facts: is it complete?", assertions.len()));
    }
    let mut source = format!("#include <stddef.h>\n#include \"{}\"\n", header.display());
    for assertion in &assertions {
        source += &format!("_Static_assert({assertion}, \"the bindings say otherwise: {assertion}\");\n");
    }
    let file = Path::new(&variable("OUT_DIR")).join(format!("embree{major}_check.c"));
    fs::write(&file, source).map_err(|error| format!("cannot write {}: {error}", file.display()))?;

    let mut build = cc::Build::new();
    build.file(&file).std("c11").warnings(false).cargo_metadata(false);
    if build.try_get_compiler().is_err() {
        return Ok(());
    }
    build.try_compile_intermediates().map(drop).map_err(|error| {
        format!(
            "The vendored bindings of Embree {major} do not agree with the installed headers, {}.\n\
             The messages above name what differs. Run\n\n    vendor-bindings/regenerate.sh {}\n\n\
             and adapt vendor-bindings to the change, or remove the headers: they are not needed to \
             build lightmesh.\n({error})",
            header.display(),
            header.with_file_name("").display()
        )
    })
}

/// What generated bindings state about sizes, alignments, offsets and constants, as C expressions.
fn assertions(bindings: &str) -> Vec<String> {
    let mut assertions = Vec::new();
    // ["Size of X"][::std::mem::size_of::<X>() - 48usize]; and the like, over one line or several.
    for (label, kind) in [("\"Size of ", "sizeof"), ("\"Alignment of ", "_Alignof")] {
        for (name, value) in facts(bindings, label) {
            assertions.push(format!("{kind}(struct {name}) == {value}"));
        }
    }
    for (name, value) in facts(bindings, "\"Offset of field: ") {
        let (name, field) = name.split_once("::").unwrap_or((name, ""));
        assertions.push(format!("offsetof(struct {name}, {field}) == {value}"));
    }
    for line in bindings.lines() {
        let constant = line
            .strip_prefix("pub const RTC")
            .and_then(|rest| rest.strip_suffix(';'))
            .and_then(|rest| rest.split_once(" = "))
            .and_then(|(left, value)| Some((left.split_once(':')?.0, value)));
        if let Some((name, value)) = constant {
            assertions.push(format!("(unsigned)RTC{name} == {value}u"));
        }
    }
    assertions
}

/// The names behind `label`, each with the number that stands before the next `usize`.
fn facts<'a>(bindings: &'a str, label: &str) -> Vec<(&'a str, &'a str)> {
    bindings
        .split(label)
        .skip(1)
        .filter_map(|rest| {
            let (name, rest) = rest.split_once('"')?;
            let (before, _) = rest.split_once("usize]")?;
            Some((name, before.rsplit(' ').next()?))
        })
        .collect()
}
