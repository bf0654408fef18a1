//! `lightmesh bench` keeps the form that scripts read. Nothing here looks at a time.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

fn bench(folder: &Path, arguments: &[&str]) -> (Output, Value, String) {
    let (json, html) = (folder.join("out.json"), folder.join("out.html"));
    let output = Command::new(env!("CARGO_BIN_EXE_lightmesh"))
        .arg("bench")
        .args(arguments)
        .args(["--quick", "--repetitions", "2", "--quiet", "--json"])
        .arg(&json)
        .arg("--html")
        .arg(&html)
        .output()
        .expect("the program runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let report = serde_json::from_slice(&fs::read(&json).expect("JSON is written")).expect("JSON is valid");
    (output, report, fs::read_to_string(&html).expect("HTML is written"))
}

/// What every benchmark promises: raw times, goals with value and verdict, the machine, and an HTML file on its own.
fn check_form(name: &str, (output, report, html): &(Output, Value, String)) {
    assert_eq!(report["benchmark"], name);
    for key in ["version", "backend"] {
        assert!(report[key].is_string(), "{key}");
    }
    assert!(report["machine"]["processor"].is_string());
    assert!(report["threads"].as_u64() >= Some(1));
    assert_eq!(report["quick"], true);
    let measurements = report["measurements"].as_array().expect("a list");
    assert!(!measurements.is_empty());
    for one in measurements {
        let seconds = one["seconds"].as_array().expect("raw times");
        assert!(one["name"].is_string() && !seconds.is_empty());
        assert!(
            one["median"].as_f64() >= one["min"].as_f64() && one["median"].as_f64() <= one["max"].as_f64()
        );
    }
    let text = String::from_utf8_lossy(&output.stdout);
    for goal in report["goals"].as_array().expect("a list") {
        let name = goal["name"].as_str().expect("a name");
        assert!(goal["goal"].is_number() && goal["pass"].is_boolean(), "{goal}");
        assert!(goal["value"].is_number() || goal["value"].is_null(), "{goal}");
        let verdict = if goal["pass"] == true { "PASS" } else { "SHORT" };
        let line = text.lines().find(|line| line.contains(&format!("{name}:"))).expect("a line per goal");
        assert!(line.starts_with(verdict), "{line}");
    }
    assert!(html.starts_with("<!DOCTYPE html>") && html.trim_end().ends_with("</html>"));
    assert!(!html.contains("href=") && !html.contains("src="), "the report needs no other file");
}

fn goals(report: &Value) -> Vec<&str> {
    report["goals"].as_array().into_iter().flatten().filter_map(|goal| goal["name"].as_str()).collect()
}

#[test]
fn headline_is_the_default_and_compares_both_integrators() {
    let folder = tempfile::tempdir().expect("a folder");
    let result = bench(folder.path(), &[]);
    check_form("headline", &result);
    let names = goals(&result.1);
    for part in ["times faster", "error of the mesh", "over its camera rays"] {
        assert!(names.iter().any(|name| name.contains(part)), "{part}: {names:?}");
    }
    let measured = result.1["measurements"].as_array().into_iter().flatten();
    let measured: Vec<&str> = measured.filter_map(|one| one["name"].as_str()).collect();
    for part in ["conventional: frame", "conventional: shade", "light mesh"] {
        assert!(measured.iter().any(|name| name.contains(part)), "{part}");
    }
    assert!(result.2.contains("<svg"), "error over time is plotted");
}

#[test]
fn scaling_covers_all_axes() {
    let folder = tempfile::tempdir().expect("a folder");
    let result = bench(folder.path(), &["scaling"]);
    check_form("scaling", &result);
    let text = String::from_utf8_lossy(&result.0.stdout);
    for axis in ["resolution", "spacing", "lights", "triangles", "Threads", "whole process"] {
        assert!(text.contains(axis), "{axis}");
    }
    assert!(goals(&result.1).iter().any(|name| name.contains("bytes per triangle")));
}

#[test]
fn backends_covers_all_kinds_of_rays() {
    let folder = tempfile::tempdir().expect("a folder");
    let result = bench(folder.path(), &["backends"]);
    check_form("backends", &result);
    let text = String::from_utf8_lossy(&result.0.stdout);
    for kind in ["camera", "points to one light", "one point to many lights", "full sphere", "bvh"] {
        assert!(text.contains(kind), "{kind}");
    }
}

#[test]
fn rays_compares_evaluation_with_a_bare_loop() {
    let folder = tempfile::tempdir().expect("a folder");
    let result = bench(folder.path(), &["rays"]);
    check_form("rays", &result);
    assert!(goals(&result.1).iter().all(|name| name.contains("bare loop")));
}

/// A folder in place of the file is found out before anything is measured.
#[test]
fn an_output_that_cannot_be_written_is_an_error() {
    let folder = tempfile::tempdir().expect("a folder");
    let output = Command::new(env!("CARGO_BIN_EXE_lightmesh"))
        .args(["bench", "rays", "--quick", "--json"])
        .arg(folder.path())
        .output()
        .expect("the program runs");
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&output.stderr).starts_with("lightmesh: "));
}
