//! What `lightmesh render` says of the error of its picture, in words and in the file of `--stats`, and how limits end it (method §10).

use std::fs;
use std::path::Path;
use std::process::Command;

use lightmesh::image;
use serde_json::Value;

const MODEL: &str =
    "v -3 0 -3\nv 3 0 -3\nv 3 0 3\nv -3 0 3\nv -1 1 0\nv 1 1 0\nv 0 2 0\nf 1 4 3 2\nf 5 6 7\n";

const SCENE: &str = "[camera]\nposition = [0, 3, 6]\nlook_at = [0, 0, 0]\n[render]\nresolution = [48, 32]\n\
                     [[geometry]]\nfile = \"model.obj\"\n[[light]]\nposition = [0.5, 4, 1]\nintensity = 5\n\
                     [[light]]\nposition = [-1, 3, 2]\nintensity = 4\n";

/// Renders the scene; the statistics and the last line on stderr.
fn render(folder: &Path, flags: &[&str]) -> (Value, String) {
    render_scene(folder, SCENE, flags)
}

/// The same for another scene of that model.
fn render_scene(folder: &Path, scene: &str, flags: &[&str]) -> (Value, String) {
    fs::write(folder.join("model.obj"), MODEL).expect("writable");
    fs::write(folder.join("scene.toml"), scene).expect("writable");
    let output = Command::new(env!("CARGO_BIN_EXE_lightmesh"))
        .args(["render", "scene.toml", "-o", "out.exr", "--stats", "stats.json"])
        .args(flags)
        .current_dir(folder)
        .output()
        .expect("the program runs");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{flags:?}: {stderr}");
    let stats = fs::read(folder.join("stats.json")).expect("statistics are written");
    let last = stderr.lines().last().unwrap_or_default().to_owned();
    (serde_json::from_slice(&stats).expect("JSON is valid"), last)
}

/// The last line is about the error, with the limit that was asked for, by default 5 %; 0 asks for nothing.
#[test]
fn a_render_says_how_wrong_it_is() {
    let folder = tempfile::tempdir().expect("a folder");
    for (flags, asked) in [(vec![], 0.05), (vec!["--max-error", "10%"], 0.1)] {
        let (stats, last) = render(folder.path(), &flags);
        let accuracy = &stats["accuracy"];
        assert!((accuracy["asked"].as_f64().expect("a number") - asked).abs() < 1e-6, "{accuracy}");
        let found = &accuracy["found"];
        assert!(found["error"].as_f64().is_some_and(|error| error <= asked), "{found}");
        assert_eq!(accuracy["ending"], "error");
        assert!(last.starts_with("error ") && last.contains("held out"), "{last}");
        assert!(last.contains(&format!("within the {} % asked for", 100.0 * asked)), "{last}");
    }
    let (stats, last) = render(folder.path(), &["--max-error", "0"]);
    assert!(stats["accuracy"].is_null() && !last.starts_with("error"), "{last}");
    let (stats, last) = render(folder.path(), &["--integrator", "conventional"]);
    assert_eq!(stats["accuracy"]["ending"], "exact");
    assert_eq!(last, "error 0: every shadow ray was traced");
}

/// Time that is over leaves a whole picture and success, since that is what was asked for.
#[test]
fn a_time_limit_leaves_a_whole_picture() {
    let folder = tempfile::tempdir().expect("a folder");
    let (stats, last) = render(folder.path(), &["--time-limit", "0.000001"]);
    assert_eq!(stats["accuracy"]["ending"], "time");
    assert!(last.contains("time limit"), "{last}");
    let picture = image::read(&folder.path().join("out.exr")).expect("an image");
    assert_eq!((picture.width(), picture.height()), (48, 32));
    assert!(picture.pixels().iter().any(|pixel| pixel[0] > 0.0));
}

/// The last of several steps is written in the end, whether those before it were or not.
#[test]
fn steps_that_are_written_end_with_the_last_one() {
    let folder = tempfile::tempdir().expect("a folder");
    let picture = |flags: &[&str]| {
        render(folder.path(), flags);
        fs::read(folder.path().join("out.exr")).expect("an image")
    };
    let pixels = |bytes: &[u8]| image::decode(bytes).expect("an image").pixels().to_vec();
    let alone = picture(&[]);
    let steps = picture(&["--steps", "3", "--write-partial"]);
    assert_eq!(pixels(&alone), pixels(&steps));
}

/// What a memory limit leaves after the scene is all that light meshes get. A mesh that is named and needs more is an error that names the scene and
/// leaves no picture; with a picture on the way, that one is left, and the last line says why.
#[test]
fn a_memory_limit_bounds_light_meshes() {
    let folder = tempfile::tempdir().expect("a folder");
    let mesh = ["--shadows", "soft", "--spacing", "0.05", "--memory-limit"];
    let flags = |limit: &'static str| mesh.iter().copied().chain([limit]).collect::<Vec<_>>();
    render(folder.path(), &flags("1G"));
    fs::remove_file(folder.path().join("out.exr")).expect("an image");
    let scene = fs::read_to_string(folder.path().join("scene.toml")).expect("the scene");
    let refused = Command::new(env!("CARGO_BIN_EXE_lightmesh"))
        .args(["render", "scene.toml", "-o", "out.exr"])
        .args(flags("100K"))
        .current_dir(folder.path())
        .output()
        .expect("the program runs");
    let message = String::from_utf8_lossy(&refused.stderr);
    assert_eq!(refused.status.code(), Some(1), "{message}");
    assert!(message.contains("scene.toml: light meshes would take"), "{message}");
    assert!(!folder.path().join("out.exr").exists());

    let steps = scene.replace("[render]\n", "[render]\nsteps = [{ spacing = 1.5 }]\n");
    let (stats, last) = render_scene(folder.path(), &steps, &flags("100K"));
    assert_eq!(stats["accuracy"]["ending"], "memory");
    assert!(last.contains("the memory limit ended it"), "{last}");
}

/// The two words for shadows are the two ways of `--resolve`, and more than one word is one too many.
#[test]
fn shadows_are_said_once() {
    let folder = tempfile::tempdir().expect("a folder");
    let picture = |flags: &[&str]| {
        render(folder.path(), &[&["--max-error", "0", "--integrator", "light-mesh"], flags].concat());
        fs::read(folder.path().join("out.exr")).expect("an image")
    };
    let [soft, sharp] = ["soft", "sharp"].map(|word| picture(&["--shadows", word]));
    assert!(soft == picture(&["--resolve", "average"]) && sharp == picture(&["--resolve", "trace"]));
    assert!(soft != sharp);
    let init = Command::new(env!("CARGO_BIN_EXE_lightmesh"))
        .args(["init", "model.obj", "-o", "new.toml", "--quiet"])
        .current_dir(folder.path())
        .status()
        .expect("the program runs");
    let new = fs::read_to_string(folder.path().join("new.toml")).expect("a scene file");
    assert!(init.success() && new.contains("\nshadows = \"sharp\"\n") && !new.contains("resolve"), "{new}");
    let both = Command::new(env!("CARGO_BIN_EXE_lightmesh"))
        .args(["render", "scene.toml", "-o", "out.exr", "--shadows", "soft", "--resolve", "trace"])
        .current_dir(folder.path())
        .output()
        .expect("the program runs");
    let message = String::from_utf8_lossy(&both.stderr);
    assert_eq!(both.status.code(), Some(2), "{message}");
    assert!(message.contains("--shadows") && message.contains("--resolve"), "{message}");
}

/// A limit that can't be meant is refused as wrong usage.
#[test]
fn limits_out_of_range_are_refused() {
    for flags in [["--max-error", "5"], ["--max-error", "-1%"], ["--time-limit", "soon"], ["--steps", "0"]] {
        let output = Command::new(env!("CARGO_BIN_EXE_lightmesh"))
            .args(["render", "scene.toml", "-o", "out.exr"])
            .arg(format!("{}={}", flags[0], flags[1]))
            .output()
            .expect("the program runs");
        assert_eq!(output.status.code(), Some(2), "{flags:?}");
        assert!(String::from_utf8_lossy(&output.stderr).contains(flags[0]), "{flags:?}");
    }
}
