//! Finding the library, and what is said when that fails.

mod common;

use std::{ffi::OsStr, process::Command};

use common::library;
use embree_sys::{Device, Error, Library};

/// The loaded version is one that the bindings fit, and its name says which it is.
#[test]
fn a_known_version_is_loaded() {
    let Some(library) = library() else { return };
    let version = library.version();
    assert!((version.major == 3 && version.minor >= 13) || version.major == 4, "{version}");
    assert!(!library.name().is_empty());
}

/// Messages name what was asked for and give the loader's own reason.
#[test]
fn a_library_that_cannot_be_loaded_is_named() {
    let name = "/nowhere/libembree4.so";
    let Err(error) = Library::open(OsStr::new(name)) else { panic!("there is no such file") };
    assert!(matches!(&error, Error::CannotLoad { name: n, .. } if n == name), "{error:?}");
    assert!(error.to_string().contains(name), "{error}");
    assert!(error.to_string().contains("No such file"), "{error}");
}

/// A library that is not Embree is refused by the function that it lacks.
#[test]
fn a_library_that_is_not_embree_is_refused() {
    let Err(error) = Library::open(OsStr::new("libc.so.6")) else { panic!("the C library is not Embree") };
    assert!(matches!(error, Error::NotEmbree { .. }), "{error:?}");
    assert!(error.to_string().contains("rtcNewDevice"), "{error}");
}

/// What the child process of the next test does: report how loading went.
#[test]
#[ignore = "run by embree_lib_is_obeyed, in a process of its own"]
fn child_reports_loading() {
    match Library::load() {
        Ok(library) => println!("loaded {}", library.name()),
        Err(error) => println!("failed {error}"),
    }
}

/// `EMBREE_LIB` overrides the search: a bogus name fails although a good library may be there, a good
/// one is used, and an empty value counts as unset.
#[test]
fn embree_lib_is_obeyed() {
    let load = |value: &str| {
        let output = Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "child_reports_loading", "--include-ignored", "--nocapture"])
            .env("EMBREE_LIB", value)
            .output()
            .unwrap();
        String::from_utf8(output.stdout).unwrap()
    };
    assert!(
        load("/nowhere/libembree.so").contains("failed cannot load the Embree library /nowhere/libembree.so")
    );
    let Some(library) = library() else { return };
    assert!(load(library.name()).contains(&format!("loaded {}", library.name())));
    assert!(load("").contains("loaded "));
}

/// A configuration is a C string, which cannot hold a zero byte.
#[test]
fn a_configuration_with_a_zero_byte_is_refused() {
    let Some(library) = library() else { return };
    assert!(matches!(Device::new(&library, "threads=1\0"), Err(Error::Configuration)));
}
