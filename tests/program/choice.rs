//! `render --stats` says which integrator rendered, and why where that was left to `auto`; a note says the same.

use std::fs;
use std::path::Path;
use std::process::Command;

use lightmesh::image;
use serde_json::{Value, json};

const MODEL: &str = "v -1 -1 0\nv 1 -1 0\nv 0 1 0\nf 1 2 3\n";

/// A triangle that faces one light; without `integrator`, which then is `auto`.
const SCENE: &str = "[camera]\nposition = [0, 0, 3]\nlook_at = [0, 0, 0]\n[render]\nresolution = [32, 32]\n\
                     [[geometry]]\nfile = \"model.obj\"\n[[light]]\nposition = [0, 0, 2]\nintensity = 1\n";

fn folder(scene: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("model.obj"), MODEL).expect("writable");
    fs::write(folder.path().join("scene.toml"), scene).expect("writable");
    folder
}

/// The statistics of a render, and the notes on stderr.
fn render(folder: &Path, scene: &str, flags: &[&str]) -> (Value, Vec<String>) {
    let output = Command::new(env!("CARGO_BIN_EXE_lightmesh"))
        .args(["render", scene, "-o", "out.exr", "--stats", "stats.json"])
        .args(flags)
        .current_dir(folder)
        .output()
        .expect("the program runs");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{scene} {flags:?}: {stderr}");
    let stats = fs::read(folder.join("stats.json")).expect("statistics are written");
    let notes = stderr.lines().filter_map(|line| line.strip_prefix("note: ")).map(str::to_owned).collect();
    (serde_json::from_slice(&stats).expect("JSON is valid"), notes)
}

/// What every choice promises: an integrator that renders, which is the one that did, and a note that begins with its name.
fn check_choice(stats: &Value, notes: &[String]) {
    let taken = stats["choice"]["integrator"].as_str().expect("auto chose");
    assert!(["light-mesh", "conventional"].contains(&taken), "{taken}");
    assert_eq!(stats["integrator"], taken);
    assert_eq!(notes.iter().filter(|note| note.starts_with(&format!("{taken}: "))).count(), 1, "{notes:?}");
    // Conventional shading evaluates no mesh point, and a light mesh leaves no surface point without one.
    let evaluated = stats["mesh_points"]["direct"]["evaluated"].as_u64().expect("a count");
    assert!(taken == "conventional" || evaluated > 0, "{evaluated} mesh points");
}

/// A mesh point costs at least one ray per light, and so does a surface point: there is nothing to save with one light
/// before a triangle, but a mesh to pay for.
#[test]
fn one_light_is_traced_conventionally() {
    let folder = folder(&(SCENE.to_owned() + "[light_mesh]\nresolve = \"trace\"\n"));
    let (stats, notes) = render(folder.path(), "scene.toml", &[]);
    check_choice(&stats, &notes);
    assert_eq!(stats["choice"]["integrator"], "conventional");
    let lights = stats["choice"]["reason"]["lights"].as_f64().expect("too small for a trial: lights decide");
    assert!((lights - 1.0).abs() < 1e-6, "every surface point faces the light, {lights} do");
}

/// Shadow edges of bare models are traced, so that they can be rendered by either way.
#[test]
fn a_bare_model_is_rendered_by_what_was_chosen() {
    let folder = folder(SCENE);
    let (stats, notes) = render(folder.path(), "model.obj", &["--resolution", "32x32"]);
    check_choice(&stats, &notes);
    assert_ne!(stats["choice"]["reason"], "settings");
    let lights = stats["choice"]["reason"]["lights"].as_f64().expect("too small for a trial: lights decide");
    assert!((0.0..=stats["lights"].as_f64().expect("a number")).contains(&lights), "{lights}");
}

/// An image large enough for a trial, with enough lights for one, is decided by the estimated cost of a light mesh, which is reported.
#[test]
fn a_trial_takes_what_it_estimates_to_cost_less() {
    let lights = "[[light]]\nposition = [0, 0.5, 2]\nintensity = 1\n".repeat(7);
    let folder = folder(&(SCENE.to_owned() + &lights + "[light_mesh]\nresolve = \"trace\"\n"));
    let (stats, notes) = render(folder.path(), "scene.toml", &["--resolution", "320x320"]);
    check_choice(&stats, &notes);
    let share = stats["choice"]["reason"]["trial"].as_f64().expect("large enough for a trial");
    let cheaper = if share < 1.0 { "light-mesh" } else { "conventional" };
    assert_eq!(stats["choice"]["integrator"], cheaper, "estimated at {share}");
}

/// Soft shadows and indirect light come from light meshes alone, however few lights there are and whatever they cost.
#[test]
fn what_only_a_light_mesh_gives_is_never_traced_away() {
    for table in [
        "",
        "[light_mesh]\nresolve = \"average\"\n",
        "[light_mesh]\nresolve = \"trace\"\n[light_mesh.indirect]\ndirections = 16\n",
    ] {
        let folder = folder(&(SCENE.to_owned() + table));
        for flags in [&[][..], &["--integrator", "auto"]] {
            let (stats, notes) = render(folder.path(), "scene.toml", flags);
            check_choice(&stats, &notes);
            let expected = json!({ "integrator": "light-mesh", "reason": "settings" });
            assert_eq!(stats["choice"], expected, "{table} {flags:?}");
        }
    }
}

/// A floor and a wall beside it, both white.
const CORNER: &str = "v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nv -1 2 -1\nv 1 2 -1\nf 1 4 3 2\nf 1 2 6 5\n";

/// Light that surfaces send each other belongs to a bare model, is the same whatever computes the direct light, and can be left out.
#[test]
fn light_from_surfaces_goes_with_every_integrator() {
    let folder = folder(SCENE);
    fs::write(folder.path().join("corner.obj"), CORNER).expect("writable");
    let image = |flags: &[&str]| {
        let flags = [&["--resolution", "32x24", "--float"], flags].concat();
        render(folder.path(), "corner.obj", &flags);
        image::read(&folder.path().join("out.exr")).expect("an image").pixels().to_vec()
    };
    let added = |integrator: &[&str]| -> Vec<f32> {
        let (with, without) = (image(integrator), image(&[integrator, &["--indirect", "off"]].concat()));
        with.iter()
            .zip(&without)
            .map(|(with, without)| with.iter().sum::<f32>() - without.iter().sum::<f32>())
            .collect()
    };
    let by_default = added(&[]);
    assert!(by_default.iter().sum::<f32>() > 0.0, "the corner lights itself");
    for integrator in ["light-mesh", "conventional"] {
        for (found, expected) in added(&["--integrator", integrator]).iter().zip(&by_default) {
            assert!((found - expected).abs() < 1e-4, "{integrator}: {found} instead of {expected}");
        }
    }
}

/// An integrator that is named is no choice, and nothing is said about it.
#[test]
fn a_named_integrator_is_no_choice() {
    let folder = folder(SCENE);
    for name in ["light-mesh", "conventional", "reference"] {
        let flags = ["--integrator", name, "--reference-samples", "4"];
        let (stats, notes) = render(folder.path(), "scene.toml", &flags);
        assert_eq!(stats["integrator"], name);
        assert_eq!(stats["choice"], Value::Null);
        assert!(!notes.iter().any(|note| note.starts_with(name)), "{notes:?}");
    }
}
