//! Layers in files: other programs read them, and `info` says what there is.

use std::path::Path;
use std::process::Command;

use lightmesh::image::exr::decode_channels;
use lightmesh::image::{self, Image};

use crate::common::data::run;

/// Two upright rectangles that touch at x = 0, before a black background, and a red and a blue light.
const LEFT: &str = "mtllib two.mtl
v -1 -1 0
v 0 -1 0
v 0 1 0
v -1 1 0
usemtl oak
f 1 2 3 4
";
const RIGHT: &str = "mtllib two.mtl
v 0 -1 0
v 1 -1 0
v 1 1 0
v 0 1 0
usemtl steel
f 1 2 3 4
";
const MATERIALS: &str = "newmtl oak\nKd 0.5 0.4 0.3\nnewmtl steel\nKd 0.2 0.3 0.4\n";
const SCENE: &str = r#"
[camera]
position = [0, 0, 4]
look_at = [0, 0, 0]
[render]
resolution = [41, 32]
spp = 16
[[geometry]]
file = "left.obj"
[[geometry]]
file = "right.obj"
[[light]]
position = [1, 1, 3]
intensity = [1, 0, 0]
group = "red"
[[light]]
position = [-1, 1, 3]
intensity = [0, 0, 1]
"#;

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in
        [("left.obj", LEFT), ("right.obj", RIGHT), ("two.mtl", MATERIALS), ("two.toml", SCENE)]
    {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}

fn lightmesh(folder: &Path, arguments: &[&str]) -> (bool, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_lightmesh"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("the program runs");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.success(), text(&output.stdout), text(&output.stderr))
}

/// Renders with some flags.
fn rendered(folder: &Path, name: &str, flags: &[&str]) {
    let arguments = [&["render", "two.toml", "--quiet", "-o", name], flags].concat();
    let (succeeded, _, errors) = lightmesh(folder, &arguments);
    assert!(succeeded, "{errors}");
}

/// A program that knows nothing of ours finds the names, and how much of each pixel everything covers: half of the middle column each, to
/// within a sixteenth, as evenly spread samples have it.
#[test]
fn cryptomattes_are_read_by_others() {
    let folder = folder();
    let file = folder.path().join("ids.exr");
    rendered(folder.path(), "ids.exr", &["--aov", "object,material"]);
    if run("kriptomatte", "kriptomatte of PyPI", &[Path::new("-i"), &file]).is_none() {
        return;
    }
    for (layer, left, right) in [("CryptoObject", "left", "right"), ("CryptoMaterial", "oak", "steel")] {
        let mask = |name: &str| -> Image {
            image::read(&folder.path().join(format!("ids_{layer}/{name}_mask.png"))).unwrap()
        };
        let (left, right) = (mask(left), mask(right));
        let row = 16;
        // At distance 4 and 45°, half of the height are 1.657 units, so that a rectangle is 9.66 pixels wide.
        for x in 0..41 {
            let codes = [&left, &right].map(|mask| mask.get(x, row).unwrap()[0]);
            match x {
                12..20 => assert_eq!(codes, [1.0, 0.0], "{layer} {x}"),
                21..29 => assert_eq!(codes, [0.0, 1.0], "{layer} {x}"),
                // A mask is colour and opacity at once: the codes of 7/16 and 9/16 are linear light of 0.16 and 0.28, times that.
                20 => assert!(codes.iter().all(|code| (0.07..0.16).contains(code)), "{layer}: {codes:?}"),
                0..10 | 31.. => assert_eq!(codes, [0.0, 0.0], "{layer} {x}"),
                _ => {}
            }
        }
    }
}

/// A lamp that was given a group shines in its layer and in no other.
#[test]
fn groups_of_the_scene_file_have_their_layers() {
    let folder = folder();
    rendered(folder.path(), "groups.exr", &["--light-groups", "--float"]);
    let read = decode_channels(&std::fs::read(folder.path().join("groups.exr")).unwrap()).unwrap();
    let names: Vec<&str> = read.channels.iter().map(|channel| channel.name.as_str()).collect();
    let colours = |layer: &str| ["B", "G", "R"].map(|colour| format!("{layer}{colour}"));
    let expected = [colours(""), colours("light_default."), colours("light_red.")].concat();
    assert_eq!(names, expected);
    let bright = |name: &str| {
        let samples = &read.channel(name).unwrap().samples;
        (0..samples.len()).any(|pixel| samples.get(pixel).unwrap() > 0.01)
    };
    let lit = ["light_red.R", "light_red.B", "light_default.R", "light_default.B"].map(bright);
    assert_eq!(lit, [true, false, false, true]);
}

/// The picture's own channels stay where readers look for them; numbers that half precision would spoil are float.
#[test]
fn info_says_what_an_image_holds() {
    let folder = folder();
    rendered(folder.path(), "all.exr", &["--aov", "all"]);
    let (succeeded, shown, errors) = lightmesh(folder.path(), &["info", "all.exr"]);
    assert!(succeeded, "{errors}");
    for line in [
        "size       41 by 32 pixels",
        "window     41 by 32 pixels at (0, 0)",
        "channels   Albedo.B, Albedo.G, Albedo.R (half)",
        "channels   CryptoObject00.A, CryptoObject00.B, CryptoObject00.G, CryptoObject00.R (float)",
        "channels   P.X, P.Y, P.Z (float)",
        "attribute  lightmesh:scene: two.toml",
        "attribute  lightmesh:exposure: 0",
    ] {
        assert!(shown.contains(&format!("{line}\n")), "{line}: {shown}");
    }
    assert!(shown.contains("lightmesh:settings: ") && shown.contains("\"left\":"), "{shown}");
    let (_, json, _) = lightmesh(folder.path(), &["info", "all.exr", "--json"]);
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["size"], serde_json::json!([41, 32]));
    assert_eq!(image::read(&folder.path().join("all.exr")).unwrap().width(), 41);

    std::fs::write(folder.path().join("cut.exr"), b"\x76\x2f\x31\x01").unwrap();
    let (succeeded, _, errors) = lightmesh(folder.path(), &["info", "cut.exr"]);
    assert!(!succeeded && errors.contains("cut.exr: damaged EXR file"), "{errors}");
}

#[test]
fn mistakes_are_refused_before_anything_is_rendered() {
    let folder = folder();
    for (flags, expected) in [
        (&["-o", "a.exr", "--aov", "normals"][..], "unknown name `normals`"),
        (&["-o", "a.png", "--aov", "normal"], "a.png: layers need an output that ends in .exr"),
    ] {
        let (succeeded, _, errors) = lightmesh(folder.path(), &[&["render", "two.toml"], flags].concat());
        assert!(!succeeded && errors.contains(expected), "{errors}");
    }
    assert!(!folder.path().join("a.exr").exists() && !folder.path().join("a.png").exists());
    let broken = SCENE.replace("\"red\"", "\"a.b\"");
    std::fs::write(folder.path().join("two.toml"), broken).unwrap();
    let (_, _, errors) = lightmesh(folder.path(), &["render", "two.toml", "-o", "a.exr"]);
    assert!(
        errors.contains("two.toml:") && errors.contains("light[0]") && errors.contains("a.b"),
        "{errors}"
    );
}
