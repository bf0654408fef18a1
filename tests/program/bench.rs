//! `lightmesh bench` keeps the form that scripts read. Nothing here looks at a time.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

fn bench(folder: &Path, arguments: &[&str]) -> (Output, Value, String) {
    let result = bench_unless_failed(folder, arguments);
    assert!(result.0.status.success(), "{}", String::from_utf8_lossy(&result.0.stderr));
    result
}

/// The same of a benchmark that may end with an error after it wrote what it measured.
fn bench_unless_failed(folder: &Path, arguments: &[&str]) -> (Output, Value, String) {
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

const MODEL: &str = "v -1 -1 0\nv 1 -1 0\nv 0 1 0\nf 1 2 3\n";

const SCENE: &str = "[camera]\nposition = [0, 0, 3]\nlook_at = [0, 0, 0]\n[render]\nintegrator = \"reference\"\n\
                     [[geometry]]\nfile = \"model.obj\"\n";

const LIGHT: &str = "[[light]]\nposition = [0, 1, 2]\nintensity = 1\n";

/// What is promised of each scene that was measured.
fn check_scene(scene: &Value) {
    let number = |key: &str| scene[key].as_f64().unwrap_or_else(|| panic!("{key} is a number: {scene}"));
    let name = scene["name"].as_str().expect("a name");
    assert!(number("lights") >= 1.0 && number("triangles") >= 1.0, "{name}");
    assert!(number("seconds") > 0.0 && number("conventional_seconds") > 0.0 && number("auto_seconds") > 0.0);
    let ratio = number("conventional_seconds") / number("seconds");
    assert!((number("ratio") / ratio - 1.0).abs() < 1e-9, "{name}: {} is not {ratio}", scene["ratio"]);
    // Lights whose shadow edges are traced differ little, those that are averaged by less than the image's mean.
    assert!((0.0..1.0).contains(&number("block_mean_relative_error")), "{name}");
    if cfg!(feature = "flip") {
        assert!((0.0..0.5).contains(&number("flip")), "{name}");
    } else {
        assert!(scene["flip"].is_null(), "{name}");
    }
    let is_way = |key: &str| ["light-mesh", "conventional"].map(Value::from).contains(&scene[key]);
    assert!(is_way("chosen") && is_way("cheaper"), "{name}: never `auto`, nor what the file asks for");
    let faster = if number("ratio") >= 1.0 { "light-mesh" } else { "conventional" };
    assert_eq!(scene["cheaper"], faster, "{name}");
    let excess = if faster == "light-mesh" { ratio } else { 1.0 / ratio };
    let right = scene["chosen"] == scene["cheaper"] || excess <= 1.05 || scene["reason"] == "settings";
    assert_eq!(scene["auto_right"], right, "{name}");
    for way in ["light_mesh", "conventional", "auto"] {
        for stage in ["paths", "mesh", "shade"] {
            assert!(scene["stages"][way][stage].is_number(), "{name}: {way} {stage}");
        }
        assert!(scene["rays"][way]["camera"].as_u64() >= Some(1), "{name}: {way}");
    }
    // Evaluation starts from nothing in every run, and conventional tracing evaluates nothing.
    assert!(scene["mesh_points"]["direct"]["evaluated"].as_u64() >= Some(1), "{name}");
    assert_eq!(scene["stages"]["conventional"]["mesh"], 0.0, "{name}");
}

/// Scene files, bare models and what is in folders, each with what was measured of it.
#[test]
fn scenes_compares_both_ways_and_the_choice_between_them() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("model.obj"), MODEL).expect("writable");
    fs::write(folder.path().join("scene.toml"), SCENE.to_owned() + LIGHT).expect("writable");
    fs::write(folder.path().join("list.toml"), "title = \"about scenes\"\n").expect("writable");
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/leaks/guarded.toml");
    let path = folder.path().to_str().expect("UTF-8");
    let result = bench(folder.path(), &["scenes", file, path, "--resolution", "24x18"]);
    check_form("scenes", &result);
    let scenes = result.1["scenes"].as_array().expect("a list");
    let names: Vec<&str> = scenes.iter().filter_map(|scene| scene["name"].as_str()).collect();
    assert_eq!(names, [file, &format!("{path}/model.obj"), &format!("{path}/scene.toml")]);
    for scene in scenes {
        check_scene(scene);
        assert_eq!(scene["resolution"], serde_json::json!([24, 18]));
        assert_eq!(scene["rounds"], 2);
    }
    assert_eq!(result.1["failures"], serde_json::json!([]));
    let text = String::from_utf8_lossy(&result.0.stdout);
    for part in ["ratio", "FLIP", "auto was right", "Seconds by stage", "Rays by kind"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    assert_eq!(result.2.matches("<svg").count(), 2, "ratios and stages are plotted");
}

/// By number of directions, what light from surfaces costs and how far it is off; a scene that can't be read is named.
#[test]
fn indirect_measures_light_from_surfaces() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("model.obj"), MODEL).expect("writable");
    fs::write(folder.path().join("scene.toml"), SCENE.to_owned() + LIGHT).expect("writable");
    let path = folder.path().to_str().expect("UTF-8");
    let result = bench_unless_failed(folder.path(), &["indirect", path, "missing.glb"]);
    check_form("indirect", &result);
    assert_eq!(result.0.status.code(), Some(1));
    assert!(result.1["failures"][0]["name"].as_str().is_some_and(|file| file.ends_with("missing.glb")));
    let curves = result.1["curves"].as_array().expect("a list");
    let names: Vec<&str> = curves.iter().filter_map(|curve| curve["name"].as_str()).collect();
    assert_eq!(names, [format!("{path}/model.obj"), format!("{path}/scene.toml")]);
    for curve in curves {
        assert!(curve["direct_seconds"].is_number() && curve["reference_directions"].as_u64() >= Some(1));
        let points = curve["points"].as_array().expect("a list");
        let number = |key: &str| -> Vec<u64> {
            points.iter().filter_map(|point| point.pointer(key)).filter_map(Value::as_u64).collect()
        };
        let (directions, rays) = (number("/directions"), number("/rays/indirect"));
        assert_eq!((directions.len(), rays.len()), (4, 4));
        assert!(directions.is_sorted() && rays.is_sorted() && rays[0] > 0, "{directions:?}: {rays:?}");
        for point in points {
            assert!(point["seconds"].is_number() && point["stages"]["mesh"].is_number());
            assert!(point["flip"].is_number() || point["flip"].is_null());
        }
    }
    assert!(
        String::from_utf8_lossy(&result.0.stdout).contains("Light from surfaces by number of directions")
    );
}

/// Meshes that build on coarser ones and meshes chosen by their error, of the scenes it makes and of given ones.
#[test]
fn adaptive_measures_error_over_rays() {
    let folder = tempfile::tempdir().expect("a folder");
    let result = bench(folder.path(), &["adaptive"]);
    check_form("adaptive", &result);
    check_adaptive(&result.1, &["forest", "hall"]);
    assert_eq!(result.2.matches("<svg").count(), 4, "error over rays and over seconds of each");
    let text = String::from_utf8_lossy(&result.0.stdout);
    for part in ["uniform", "2 levels", "conventional", "chosen by their error", "at equal error"] {
        assert!(text.contains(part), "{part}: {text}");
    }

    fs::write(folder.path().join("model.obj"), MODEL).expect("writable");
    fs::write(folder.path().join("scene.toml"), SCENE.to_owned() + LIGHT).expect("writable");
    let path = folder.path().join("scene.toml");
    let path = path.to_str().expect("UTF-8");
    let result =
        bench_unless_failed(folder.path(), &["adaptive", path, "missing.glb", "--resolution", "24x18"]);
    check_form("adaptive", &result);
    check_adaptive(&result.1, &[path]);
    assert_eq!(result.0.status.code(), Some(1));
    assert!(result.1["failures"][0]["name"].as_str().is_some_and(|file| file.ends_with("missing.glb")));
}

/// What is promised of each scene: every kind of mesh with its error and its rays.
fn check_adaptive(report: &Value, expected: &[&str]) {
    let scenes = report["adaptive"].as_array().expect("a list");
    let names: Vec<&str> = scenes.iter().filter_map(|scene| scene["name"].as_str()).collect();
    assert_eq!(names, expected);
    for scene in scenes {
        let list = |key: &str| scene[key].as_array().unwrap_or_else(|| panic!("{key} is a list: {scene}"));
        let levels: Vec<u64> = list("meshes").iter().filter_map(|mesh| mesh["levels"].as_u64()).collect();
        assert_eq!(levels, [0, 0, 1, 1, 2, 2]);
        for mesh in list("meshes").iter().chain(list("chosen")) {
            assert!(mesh["own_error"].is_number() && mesh["seconds"].is_number(), "{mesh}");
            assert!(mesh["shadow_rays"].as_u64() >= Some(1), "{mesh}");
        }
        for mesh in list("chosen") {
            assert!(mesh["asked"].is_number() && mesh["found"]["error"].is_number(), "{mesh}");
        }
        assert!(scene["conventional"]["shadow_rays"].as_u64() >= Some(1));
        assert_eq!(list("gains").len(), 2);
    }
}

/// A scene that can't be measured is named in every output and in the error at the end, and the others are there.
#[test]
fn a_scene_that_cannot_be_measured_takes_nothing_from_the_others() {
    let folder = tempfile::tempdir().expect("a folder");
    let scenes = folder.path().join("scenes");
    fs::create_dir(&scenes).expect("writable");
    for (name, text) in [
        ("a-damaged.obj", "v 1 2\n"),
        ("b-dark.toml", SCENE),
        ("c-fine.toml", &(SCENE.to_owned() + LIGHT)),
        ("d-torn.toml", "[[geometry]\n"),
        ("model.obj", MODEL),
    ] {
        fs::write(scenes.join(name), text).expect("writable");
    }
    let path = scenes.to_str().expect("UTF-8");
    let result = bench_unless_failed(folder.path(), &["scenes", path, "missing.glb"]);
    check_form("scenes", &result);
    let (output, report, html) = &result;
    assert_eq!(output.status.code(), Some(1));
    let measured = report["scenes"].as_array().expect("a list");
    let names: Vec<&str> = measured.iter().filter_map(|scene| scene["name"].as_str()).collect();
    assert_eq!(names, [format!("{path}/c-fine.toml"), format!("{path}/model.obj")]);
    measured.iter().for_each(check_scene);
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(message.starts_with("lightmesh: 4 not measured: "), "{message}");
    let failures = report["failures"].as_array().expect("a list");
    assert_eq!(failures.len(), 4);
    let failed = ["a-damaged.obj", "b-dark.toml", "d-torn.toml", "missing.glb"];
    for (failure, name) in failures.iter().zip(failed) {
        let error = failure["error"].as_str().expect("a text");
        assert!(failure["name"].as_str().is_some_and(|file| file.ends_with(name)), "{failure}");
        assert_eq!(error.matches(name).count(), 1, "{error}");
        for place in [&message, &String::from_utf8_lossy(&output.stdout), &html.as_str().into()] {
            assert!(place.contains(name), "{name}");
        }
    }
}

/// Scenes for a benchmark that makes its own are wrong usage, rather than left out.
#[test]
fn benchmarks_that_make_their_scenes_take_none() {
    for arguments in [
        &["bench", "rays", "a.toml"][..],
        &["bench", "--resolution", "8x8"],
        &["bench", "adaptive", "--spp", "4"],
    ] {
        let output =
            Command::new(env!("CARGO_BIN_EXE_lightmesh")).args(arguments).output().expect("the program runs");
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(String::from_utf8_lossy(&output.stderr).contains("bench scenes"), "{arguments:?}");
    }
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
