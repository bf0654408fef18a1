//! `render --camera` with several cameras: each has its own file, and its picture is the one that it has alone; one light mesh serves all.

use std::fs;
use std::path::Path;

use tempfile::TempDir;

use crate::rendered::{render, shadow_rays};

/// A triangle between lamps and a floor, seen from two sides by cameras that stand still and from above by one that moves. The spacing is left open, so
/// that it is chosen by what a camera sees.
const SCENE: &str = "
[[camera]]
name = \"left\"
position = [-3, 3, 5]
look_at = [0, 0, 0]
[[camera]]
name = \"right: 2/2\"
position = [3, 3, 5]
look_at = [0, 0, 0]
[[camera]]
name = \"above\"
position = [0, 6, 1]
look_at = [0, 0, 0]
turntable = { frames = 2 }
[render]
integrator = \"light-mesh\"
resolution = [32, 24]
spp = 1
max_error = 0.1
[light_mesh]
leaks = \"allow\"
[[geometry]]
file = \"floor.obj\"
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
    write("twins.toml", &SCENE.replace("right: 2/2", "a/b").replace("left", "a?b"));
    let floor = "v -3 0 -3\nv -3 0 3\nv 3 0 3\nv 3 0 -3\nf 1 2 3 4\n";
    write("floor.obj", &format!("{floor}v -0.5 1 0\nv 0.5 1 0\nv 0 1 -0.8\nf 5 6 7\n"));
    folder
}

fn succeeds(folder: &Path, flags: &[&str]) {
    let output = render(folder, "scene.toml", &[&["--float"], flags].concat());
    assert!(output.status.success(), "{flags:?}: {}", String::from_utf8_lossy(&output.stderr));
}

/// Files are named after their cameras, as far as files can be; each is, to the byte, what its camera alone makes; the second camera profits from what the
/// first one has found. `all` is all, frames or not.
#[test]
fn pictures_of_several_cameras_are_what_they_are_alone() {
    let folder = folder();
    let folder = folder.path();
    let cameras = [("left", "left"), ("right: 2/2", "right_ 2_2")];
    let named = ["--camera", "left", "--camera", "right: 2/2"];
    succeeds(folder, &[&named[..], &["-o", "{camera}.exr", "--stats", "{camera}.json"]].concat());
    succeeds(folder, &["--camera", "all", "-o", "all_{camera}.exr"]);
    succeeds(
        folder,
        &[&named[..], &["--camera", "above", "--frames", "0-1", "-o", "{camera}.##.exr"]].concat(),
    );
    let read = |name: &str| fs::read(folder.join(name)).expect("an image");
    let mut saved = 0;
    for (camera, file) in cameras {
        succeeds(folder, &["--camera", camera, "-o", "alone.exr", "--stats", "alone.json"]);
        assert!(read("alone.exr") == read(&format!("{file}.exr")), "{camera}");
        assert!(read("alone.exr") == read(&format!("all_{file}.exr")), "{camera} among all");
        saved += shadow_rays(folder, "alone.json") - shadow_rays(folder, &format!("{file}.json"));
    }
    assert!(saved > 0, "the light mesh is the same for both");
    assert!(read("left.exr") != read("right_ 2_2.exr") && !read("all_above.exr").is_empty());
    for (camera, file) in cameras.into_iter().chain([("above", "above")]) {
        succeeds(folder, &["--camera", camera, "--frames", "0-1", "-o", "alone.##.exr"]);
        for frame in ["00", "01"] {
            let of_all = read(&format!("{file}.{frame}.exr"));
            assert!(of_all == read(&format!("alone.{frame}.exr")), "{camera}, {frame}");
        }
    }
    assert!(read("above.00.exr") != read("above.01.exr"), "this one moves");
}

/// What can't be is told before anything is rendered; without `--camera` a name is a name.
#[test]
fn mistakes_are_told_at_once() {
    let folder = folder();
    for (scene, flags, problem) in [
        (
            "scene.toml",
            ["--camera", "all", "-o", "a.exr"].as_slice(),
            "a.exr: several cameras need a place for their name in its name, such as {camera}.exr",
        ),
        (
            "none.toml",
            &["--camera", "left", "--camera", "above", "-o", "{camera}.exr", "--stats", "s.json"],
            "s.json: several cameras",
        ),
        (
            "scene.toml",
            &["--camera", "above", "--camera", "above", "-o", "{camera}.exr"],
            "`above` is named twice",
        ),
        (
            "scene.toml",
            &["--camera", "all", "--frames", "0-1", "-o", "{camera}.exr"],
            "several frames need a place",
        ),
        (
            "scene.toml",
            &["--camera", "left", "--camera", "abvoe", "-o", "{camera}.exr"],
            "(did you mean `above`?)",
        ),
        (
            "twins.toml",
            &["--camera", "all", "-o", "{camera}.exr"],
            "files of the cameras `a?b` and `a/b` would both be called `a_b`",
        ),
    ] {
        let output = render(folder.path(), scene, flags);
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code() == Some(1) && said.contains(problem), "{flags:?}: {said}");
    }
    assert_eq!(fs::read_dir(folder.path()).expect("the folder").count(), 3, "nothing was written");
    succeeds(folder.path(), &["-o", "{camera}.exr"]);
    assert!(folder.path().join("{camera}.exr").exists());
}
