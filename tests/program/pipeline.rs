//! Parts, files of light meshes and interruptions: whatever way an image comes about, it is the one that a single command makes
//! (docs/light-mesh-files.md).

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use lightmesh::image::{self, Image};
use lightmesh::scene::generate::interior::Interior;

/// A room with lamps, light from surfaces and shadow edges: nothing is left out that has to know the whole image.
fn room(folder: &Path) {
    Interior { bays: 1, lamps: 6 }.write(folder).expect("a room");
    let path = folder.join("interior.toml");
    let scene = fs::read_to_string(&path).expect("a scene");
    fs::write(path, format!("preset = \"physical\"\n{scene}")).expect("writable");
}

fn command(folder: &Path, args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lightmesh"));
    command.args(args).current_dir(folder).stdout(Stdio::null()).stderr(Stdio::piped());
    command
}

fn run(folder: &Path, args: &[&str]) -> Output {
    command(folder, args).output().expect("the program runs")
}

fn succeed(folder: &Path, args: &[&str]) -> String {
    let output = run(folder, args);
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{args:?}: {stderr}");
    stderr
}

fn read(folder: &Path, name: &str) -> Image {
    image::read(&folder.join(name)).expect("an image")
}

const SIZE: &[&str] = &["--resolution", "96x80", "--spp", "2", "--float"];

/// Tiles put together are the whole image, bit for bit, with a baked light mesh and without; a file that was cut, or a part that is missing, is not.
#[test]
fn merged_tiles_are_the_whole() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    room(folder);
    let render = |more: &[&str]| succeed(folder, &[&["render", "interior.toml"], SIZE, more].concat());
    render(&["-o", "whole.exr"]);
    succeed(folder, &[&["bake", "interior.toml", "-o", "field.lmesh"], &SIZE[..4]].concat());
    for file in [&["--light-mesh", "field.lmesh"][..], &[]] {
        let mut names = vec!["merge".to_owned()];
        for number in 1..=3 {
            let (tile, name) = (format!("{number}/3"), format!("t{number}.exr"));
            render(&[&["--tile", &tile, "-o", &name], file].concat());
            names.push(name);
        }
        names.extend(["-o", "merged.exr"].map(str::to_owned));
        let mut names: Vec<&str> = names.iter().map(String::as_str).collect();
        succeed(folder, &names);
        assert!(read(folder, "merged.exr") == read(folder, "whole.exr"), "with {file:?}");
        // The second tile.
        names.remove(2);
        let output = run(folder, &names);
        assert_eq!(output.status.code(), Some(1));
        assert!(String::from_utf8_lossy(&output.stderr).contains("pixels are missing"));
    }
    render(&["--crop", "10,20,70,75", "-o", "part.exr", "-o", "part.png"]);
    let (part, whole) = (read(folder, "part.exr"), read(folder, "whole.exr"));
    for (x, y) in [(10, 20), (69, 74), (40, 50)] {
        assert_eq!(part.get(x, y), whole.get(x, y));
    }
    assert_eq!((part.get(9, 20), part.width()), (Some([0.0; 3]), 96));
    assert_eq!((read(folder, "part.png").width(), read(folder, "part.png").height()), (60, 55));
}

/// A light mesh of another scene is told apart from one that is damaged by the exit code, and neither is written over.
#[test]
fn other_and_damaged_files_have_exit_codes_of_their_own() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    room(folder);
    let bake = |scene: &str, name: &str| {
        run(folder, &["bake", scene, "-o", name, "--resolution", "32x24", "--spp", "1"])
    };
    assert_eq!(bake("interior.toml", "field.lmesh").status.code(), Some(0));
    let sound = fs::read(folder.join("field.lmesh")).expect("a file");
    let scene = fs::read_to_string(folder.join("interior.toml")).expect("a scene");
    let moved = scene + "\n[[light]]\nposition = [0.5, 1.0, 0.5]\nintensity = 0.1\n";
    fs::write(folder.join("moved.toml"), moved).expect("writable");
    let info = command(folder, &["info", "field.lmesh"]).stdout(Stdio::piped()).output().expect("it runs");
    let info = String::from_utf8_lossy(&info.stdout).into_owned();
    assert!(info.contains("views      1\n") && info.contains("surfaces   with light"), "{info}");
    let render = |scene: &str, name: &str| {
        run(
            folder,
            &["render", scene, "--light-mesh", name, "--update", "-o", "out.exr", "--resolution", "32x24"],
        )
    };
    for output in [render("moved.toml", "field.lmesh"), bake("moved.toml", "field.lmesh")] {
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(3), "{stderr}");
        assert!(stderr.contains("field.lmesh") && stderr.contains("another scene"), "{stderr}");
    }
    fs::write(folder.join("cut.lmesh"), &sound[..sound.len() / 2]).expect("writable");
    assert_eq!(render("interior.toml", "cut.lmesh").status.code(), Some(1));
    assert!(fs::read(folder.join("field.lmesh")).expect("a file") == sound);
    assert!(!folder.join("out.exr").exists());
}

/// Sends a signal to a child; the program `kill` is on every Unix system.
#[cfg(unix)]
fn signal(child: &Child, name: &str) {
    let status = Command::new("kill").args([name, &child.id().to_string()]).status().expect("kill");
    assert!(status.success());
}

/// Ctrl-C and SIGTERM leave what is done, with the exit codes that shells know; `--resume` ends with the bits of a render that nobody interrupted, and leaves a
/// finished image alone.
#[cfg(unix)]
#[test]
fn interrupted_renders_go_on() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    room(folder);
    let render = |more: &[&'static str]| -> Vec<&'static str> {
        let size = [
            "render",
            "interior.toml",
            "--resolution",
            "320x240",
            "--spp",
            "16",
            "--float",
            "--max-error",
            "0",
        ];
        [&size[..], &["--threads", "1", "-o"], more].concat()
    };
    succeed(folder, &render(&["whole.exr"]));
    for (name, code) in [("-INT", 130), ("-TERM", 143)] {
        let args = render(&["part.exr"]);
        let _ = fs::remove_file(folder.join("part.exr"));
        // Whenever the signal comes, the image is whole or not there, and nothing is lost; most moments are in the middle.
        let mut interrupted = false;
        for delay in [100, 200, 400, 800, 50, 25, 10] {
            let child = command(folder, &args).spawn().expect("the program runs");
            sleep(Duration::from_millis(delay));
            signal(&child, name);
            let output = child.wait_with_output().expect("it ends");
            if output.status.code() == Some(code) {
                let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
                assert!(stderr.contains("--resume") && folder.join("part.exr.partial").exists(), "{stderr}");
                interrupted = true;
                break;
            }
            // A signal from before they are caught, or after the end.
            assert!(output.status.code().is_none_or(|code| code == 0));
            let _ = fs::remove_file(folder.join("part.exr"));
        }
        assert!(interrupted && !folder.join("part.exr").exists(), "{name}");
        let resume = [&args[..], &["--resume"]].concat();
        succeed(folder, &resume);
        assert!(read(folder, "part.exr") == read(folder, "whole.exr"), "{name}");
        assert!(!folder.join("part.exr.partial").exists());
        let written = fs::metadata(folder.join("part.exr")).and_then(|data| data.modified()).expect("a time");
        assert!(succeed(folder, &resume).contains("finished"));
        assert_eq!(
            fs::metadata(folder.join("part.exr")).and_then(|data| data.modified()).expect("a time"),
            written
        );
    }
}

/// Programs that are killed at any moment while they add to one file leave it whole, and nothing is lost of what another one reported as written.
#[cfg(unix)]
#[test]
fn killed_programs_lose_nothing_of_others() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    room(folder);
    // Views of their own, so that each has something to add.
    let args = |number: usize| -> Vec<String> {
        let size = format!("{}x24", 32 + number);
        let fixed = [
            "bake",
            "interior.toml",
            "-o",
            "field.lmesh",
            "--spp",
            "1",
            "--max-error",
            "0",
            "--indirect",
            "off",
            "--resolution",
        ];
        fixed.into_iter().map(str::to_owned).chain([size]).collect()
    };
    let start = |number: usize| {
        let args = args(number);
        command(folder, &args.iter().map(String::as_str).collect::<Vec<_>>())
            .spawn()
            .expect("the program runs")
    };
    let output = start(0).wait_with_output().expect("it ends");
    assert!(output.status.success());
    let begin = Instant::now();
    start(1).wait_with_output().expect("it ends");
    let usual = begin.elapsed();
    for round in 0..10 {
        let (mut doomed, other) = (start(2 * round + 2), start(2 * round + 3));
        sleep(usual.mul_f32(0.1 + 0.12 * round as f32));
        let _ = doomed.kill();
        doomed.wait().expect("it ends");
        let output = other.wait_with_output().expect("it ends");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        // What was written is there: the view is known, and nothing is evaluated again.
        let args = args(2 * round + 3);
        let again = succeed(folder, &args.iter().map(String::as_str).collect::<Vec<_>>());
        assert!(again.contains(" 0 points evaluated"), "round {round}: {again}");
    }
    let left: Vec<_> =
        fs::read_dir(folder).expect("a folder").flatten().map(|entry| entry.file_name()).collect();
    assert!(left.iter().any(|name| name == "field.lmesh"));
}
