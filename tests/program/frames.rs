//! `render --frames` renders the frames of an animation, each to a file of its own, and each as if it were rendered alone.

use std::fs;
use std::process::Output;

use tempfile::TempDir;

use crate::rendered::{render, shadow_rays};

/// A triangle that passes between a lamp and a floor, under a camera on a turntable. Without `--max-error 0` the choice of the spacing would trace rays of its own.
const SCENE: &str = "
[camera]
position = [0, 4, 6]
look_at = [0, 0, 0]
turntable = { frames = 8 }
[render]
integrator = \"light-mesh\"
resolution = [32, 24]
spp = 1
max_error = 0
[light_mesh]
spacing = 0.4
leaks = \"allow\"
[[geometry]]
file = \"floor.obj\"
[[geometry]]
file = \"triangle.obj\"
keyframes = [{ time = 0, translate = [-2, 1, 0] }, { time = 0.125, translate = [2, 1, 0] }]
[[light]]
position = [0, 3, 0]
intensity = 3
[[light]]
position = [2, 3, 1]
intensity = 3
";

fn folder() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).expect("writable");
    write("scene.toml", SCENE);
    write("still.toml", &SCENE.replace("keyframes =", "#").replace("turntable =", "#"));
    write("open.toml", &SCENE.replace("max_error = 0", "max_error = 0.05").replace("spacing = 0.4", ""));
    write("floor.obj", "v -3 0 -3\nv -3 0 3\nv 3 0 3\nv 3 0 -3\nf 1 2 3 4\n");
    write("triangle.obj", "v -0.3 0 0\nv 0.3 0 0\nv 0 0 -0.5\nf 1 2 3\n");
    folder
}

fn lines(output: &Output) -> String {
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{stderr}");
    stderr
}

/// Each frame has its own file and numbers, and is what a process that renders it alone makes of it; it takes fewer rays, and a line says what was kept.
#[test]
fn frames_are_what_they_are_alone() {
    let folder = folder();
    let folder = folder.path();
    let flags = ["--frames", "0-2", "-o", "f.##.exr", "--stats", "s%d.json", "--float"];
    let said = lines(&render(folder, "scene.toml", &flags));
    assert!(said.contains("frame 1: moved: 1 instance, 0 lights; kept: "), "{said}");
    assert!(said.contains("3 frames: "), "{said}");
    for number in ["0", "1", "2"] {
        let flags = ["--frames", number, "-o", "alone.exr", "--stats", "alone.json", "--float", "--quiet"];
        assert!(lines(&render(folder, "scene.toml", &flags)).is_empty());
        let read = |name: &str| fs::read(folder.join(name)).expect("an image");
        assert!(read(&format!("f.0{number}.exr")) == read("alone.exr"), "frame {number}");
        let [of_frame, of_alone] =
            [&format!("s{number}.json"), "alone.json"].map(|name| shadow_rays(folder, name));
        assert_eq!(of_frame < of_alone, number != "0", "{of_frame} of {of_alone} in frame {number}");
    }
    let bytes = |name: &str| fs::read(folder.join(name)).expect("an image");
    assert_ne!(bytes("f.00.exr"), bytes("f.01.exr"), "something moves");
}

/// What settings leave open is chosen by frames all over the animation, whichever of them are rendered: each is what it is alone, and says how wrong it is.
#[test]
fn one_mesh_serves_all_frames() {
    let folder = folder();
    let folder = folder.path();
    let said = lines(&render(folder, "open.toml", &["--frames", "2,5", "-o", "f.#.exr", "--float"]));
    assert!(said.contains("one light mesh for all frames, chosen by frames 0, 1, 2, 3, 4, 5, 6 "), "{said}");
    assert_eq!(said.matches("pixels held out").count(), 2, "{said}");
    for number in ["5", "2"] {
        lines(&render(folder, "open.toml", &["--frames", number, "-o", "alone.exr", "--float"]));
        let read = |name: &str| fs::read(folder.join(name)).expect("an image");
        assert!(read(&format!("f.{number}.exr")) == read("alone.exr"), "frame {number}");
    }
}

/// Without `--frames` what moves stands still, and a name is a name.
#[test]
fn a_still_image_of_an_animated_scene_stands_still() {
    let folder = folder();
    for (scene, name) in [("scene.toml", "a#.exr"), ("still.toml", "b#.exr")] {
        lines(&render(folder.path(), scene, &["-o", name]));
    }
    let read = |name: &str| lightmesh::image::read(&folder.path().join(name)).expect("an image");
    assert!(read("a#.exr") == read("b#.exr"));
}

/// `all` is from the first keyframe, or frame 0 of a turntable, to the last.
#[test]
fn all_frames_are_those_with_keyframes() {
    let folder = folder();
    lines(&render(folder.path(), "scene.toml", &["--frames", "all", "-o", "f.####.png"]));
    let names: Vec<bool> =
        (0..9).map(|number| folder.path().join(format!("f.{number:04}.png")).exists()).collect();
    assert_eq!(names, [[true; 8].as_slice(), &[false]].concat());
}

/// What can't be is told before anything is rendered.
#[test]
fn mistakes_are_told_at_once() {
    let folder = folder();
    for (scene, flags, code, problem) in [
        (
            "scene.toml",
            ["--frames", "1-2", "-o", "f.exr"].as_slice(),
            1,
            "f.exr: several frames need a place",
        ),
        (
            "scene.toml",
            &["--frames", "1-2", "-o", "f#.exr", "--stats", "s.json"],
            1,
            "s.json: several frames",
        ),
        ("scene.toml", &["--frames", "1-2", "-o", "none/f#.exr"], 1, "none/f1.exr"),
        ("scene.toml", &["--frames", "2-1", "-o", "f#.exr"], 2, "`2-1` ends before it begins"),
        ("scene.toml", &["--frames", "1,1", "-o", "f#.exr"], 2, "frame 1 is named twice"),
        ("still.toml", &["--frames", "all", "-o", "f#.exr"], 1, "still.toml: nothing moves"),
    ] {
        let output = render(folder.path(), scene, flags);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{flags:?}: {said}");
        assert!(said.contains(problem), "{flags:?}: {said}");
    }
    assert!(fs::read_dir(folder.path()).expect("the folder").count() == 5, "nothing was written");
}
