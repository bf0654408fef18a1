//! What all subcommands have in common: what they print where, how they end, and which values they take.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use lightmesh::image::exr::{ChannelImage, decode_channels};

/// A triangle, and a line that no scene takes over: worth a warning.
const MODEL: &str = "v -1 -1 0\nv 1 -1 0\nv 0 1 0\nf 1 2 3\nl 1 2\n";

const SCENE: &str = "[camera]\nposition = [0, 0, 3]\nlook_at = [0, 0, 0]\n[render]\nresolution = [8, 8]\n\
                     exposure = EXPOSURE\n[[geometry]]\nfile = \"a.obj\"\n\
                     [[light]]\nposition = [0, 1, 2]\nintensity = 1\n";

fn lightmesh(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_lightmesh"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("the program runs")
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// A folder with a model and a scene file.
fn folder(exposure: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("a.obj"), MODEL).expect("writable");
    fs::write(folder.path().join("a.toml"), SCENE.replace("EXPOSURE", exposure)).expect("writable");
    folder
}

/// Notices go to stderr, where scripts can switch them off; errors can't be switched off.
#[test]
fn quiet_commands_write_nothing_to_stderr_but_errors() {
    let folder = folder("0");
    for arguments in [
        &["render", "a.obj", "-o", "a.png", "--backend", "bvh", "--resolution", "8x8"][..],
        &["init", "a.obj", "-o", "b.toml"],
        &["info", "a.obj"],
        &["crosscheck", "a.obj", "--rays", "100"],
    ] {
        let quiet = lightmesh(folder.path(), &[arguments, &["--quiet"]].concat());
        assert!(quiet.status.success() && quiet.stderr.is_empty(), "{arguments:?}: {}", stderr(&quiet));
        // What `info` finds is its result, and goes to stdout.
        if arguments[0] != "info" {
            let warned = stderr(&lightmesh(folder.path(), arguments));
            assert!(warned.contains("left out 1 line elements"), "{arguments:?}: {warned}");
        }
    }
    let failed = lightmesh(folder.path(), &["info", "missing.obj", "--quiet"]);
    assert!(stderr(&failed).contains("missing.obj"));
}

/// One line names the program, the file and the reason, each of them once.
#[test]
fn an_error_is_one_line_that_says_everything_once() {
    let folder = folder("0");
    for arguments in [
        &["render", "missing.toml", "-o", "a.png"][..],
        &["render", "a.toml", "-o", "missing/a.png"],
        &["compare", "missing.png", "a.png"],
        &["crosscheck", "a.obj", "--replay", "missing.txt"],
        &["gallery", "--list", "missing.toml"],
        &["generate", "forest", "-o", "a.obj/missing"],
    ] {
        let output = lightmesh(folder.path(), arguments);
        let message = stderr(&output);
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {message}");
        assert!(message.starts_with("lightmesh: ") && message.contains("missing"), "{message}");
        assert_eq!(message.lines().count(), 1, "{message}");
        let reasons = message.to_lowercase().matches("no such file or directory").count()
            + message.to_lowercase().matches("not a directory").count();
        assert_eq!(reasons, 1, "{message}");
        assert!(!message.contains("os error"), "{message}");
    }
}

/// An image of 2³² pixels is refused as wrong usage, before the scene is even looked for.
#[test]
fn a_size_that_no_image_can_have_is_wrong_usage() {
    let folder = folder("0");
    let arguments = ["render", "missing.toml", "-o", "a.png", "--resolution", "65536x65536"];
    let output = lightmesh(folder.path(), &arguments);
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(stderr(&output).contains("--resolution"));
}

/// The documented range of exposures, 100 stops either way, holds wherever one can be given.
#[test]
fn exposures_have_one_range() {
    for (exposure, accepted) in [("100.0", true), ("-100.0", true), ("100.5", false), ("-100.5", false)] {
        let folder = folder(exposure);
        let render = |scene_exposure: &str, flags: &[&str]| {
            fs::write(folder.path().join("a.toml"), SCENE.replace("EXPOSURE", scene_exposure))
                .expect("writable");
            let arguments = ["render", "a.toml", "--quiet", "--backend", "bvh", "-o", "a.png"];
            lightmesh(folder.path(), &[&arguments[..], flags].concat()).status.code()
        };
        let code = |failure| Some(if accepted { 0 } else { failure });
        assert_eq!(render("0", &["--exposure", exposure]), code(2), "--exposure {exposure}");
        assert_eq!(render(exposure, &[]), code(1), "exposure = {exposure}");
        assert_eq!(render("0", &[]), Some(0));
        let compared = lightmesh(folder.path(), &["compare", "a.png", "a.png", "--exposure", exposure]);
        assert_eq!(compared.status.code(), code(2), "compare --exposure {exposure}");
    }
}

/// What an EXR file holds, but for the name of the scene.
fn contents(file: &Path) -> ChannelImage {
    let bytes = fs::read(file).expect("an image");
    let mut image = decode_channels(&bytes).expect("a sound image");
    image.metadata.retain(|(name, _)| name != "lightmesh:scene");
    image
}

/// The tolerance of traced shadows is a number from 0 up, in the scene file as on the command line, and either way means the
/// same; image files name it among their settings.
#[test]
fn tolerances_have_one_range_and_one_meaning() {
    for (tolerance, accepted) in
        [("0", true), ("0.005", true), ("2.5", true), ("-0.01", false), ("nan", false), ("inf", false)]
    {
        let folder = folder("0");
        let mesh = "[light_mesh]\nresolve = \"trace\"\n";
        let scene = SCENE.replace("EXPOSURE", "0") + mesh;
        fs::write(folder.path().join("a.toml"), &scene).expect("writable");
        fs::write(folder.path().join("b.toml"), format!("{scene}tolerance = {tolerance}\n"))
            .expect("writable");
        let render = |scene: &str, image: &str, flags: &[&str]| {
            let arguments = ["render", scene, "--quiet", "--backend", "bvh", "-o", image];
            lightmesh(folder.path(), &[&arguments[..], flags].concat()).status.code()
        };
        let code = |failure| Some(if accepted { 0 } else { failure });
        let flag = format!("--tolerance={tolerance}");
        assert_eq!(render("a.toml", "a.exr", &[&flag]), code(2), "{flag}");
        assert_eq!(render("b.toml", "b.exr", &[]), code(1), "tolerance = {tolerance}");
        if accepted {
            let [a, b] = ["a.exr", "b.exr"].map(|name| contents(&folder.path().join(name)));
            assert!(a == b, "{flag} is not tolerance = {tolerance}");
        }
    }
}

/// Indirect light can be had and left out from the command line: with as many bounces as a scene file's table asks for, or none.
#[test]
fn indirect_light_can_be_added_and_left_out() {
    let folder = folder("0");
    let plain = SCENE.replace("EXPOSURE", "0");
    let lit = format!("{plain}[light_mesh.indirect]\nbounces = 2\n");
    for (name, text) in [("plain.toml", &plain), ("lit.toml", &lit)] {
        fs::write(folder.path().join(name), text).expect("writable");
    }
    let render = |scene: &str, image: &str, flags: &[&str]| {
        let arguments = ["render", scene, "--quiet", "--backend", "bvh", "-o", image];
        lightmesh(folder.path(), &[&arguments[..], flags].concat()).status.code()
    };
    let image = |name: &str| contents(&folder.path().join(name));
    for (scene, flags, same_as) in
        [("plain.toml", ["--indirect", "2"], "lit.toml"), ("lit.toml", ["--indirect", "off"], "plain.toml")]
    {
        assert_eq!(render(scene, "a.exr", &flags), Some(0));
        assert_eq!(render(same_as, "b.exr", &[]), Some(0));
        assert!(image("a.exr") == image("b.exr"), "{scene} with {flags:?} is not {same_as}");
    }
    for wrong in ["0", "1001", "on", "-1"] {
        assert_eq!(render("plain.toml", "a.exr", &[&format!("--indirect={wrong}")]), Some(2), "{wrong}");
    }
}

/// A reader that leaves early makes no failure, and doesn't turn a failed check into a success.
#[cfg(unix)]
#[test]
fn a_closed_pipe_changes_no_outcome() {
    let folder = folder("0");
    let render = |name: &str, exposure: &str| {
        let arguments = ["render", "a.toml", "--quiet", "--exposure", exposure, "-o", name];
        assert!(lightmesh(folder.path(), &arguments).status.success());
    };
    render("a.png", "0");
    render("b.png", "2");
    let unread = |arguments: &[&str]| {
        let (reader, writer) = std::io::pipe().expect("a pipe");
        drop(reader);
        let mut command = Command::new(env!("CARGO_BIN_EXE_lightmesh"));
        command.args(arguments).current_dir(folder.path()).stdout(writer);
        command.status().expect("the program runs").code()
    };
    assert_eq!(unread(&["info", "a.toml"]), Some(0));
    assert_eq!(unread(&["--help"]), Some(0));
    assert_eq!(unread(&["compare", "a.png", "a.png", "--fail-above", "0"]), Some(0));
    assert_eq!(unread(&["compare", "a.png", "b.png", "--fail-above", "0"]), Some(1));
}
