//! `lightmesh probe` and `lightmesh export` write what they measured, in every format alike, or nothing.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use lightmesh::image;
use serde_json::Value;

/// A floor, and a lamp of 3 W/sr at a height of 2.
const MODEL: &str = "v -4 0 4\nv 4 0 4\nv 4 0 -4\nv -4 0 -4\nf 1 2 3 4\n";
const SCENE: &str = "preset = \"physical\"\n[camera]\nposition = [0, 3, 5]\nlook_at = [0, 0, 0]\n[render]\nresolution = [32, 24]\n\
                     [[geometry]]\nfile = \"model.obj\"\n[[light]]\nposition = [0, 2, 0]\nintensity = 3\n";

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("model.obj"), MODEL).expect("writable");
    fs::write(folder.path().join("scene.toml"), SCENE).expect("writable");
    folder
}

fn run(folder: &Path, arguments: &[&str]) -> Output {
    let program = Command::new(env!("CARGO_BIN_EXE_lightmesh")).args(arguments).current_dir(folder).output();
    program.expect("the program runs")
}

fn rows(file: &Path) -> Vec<Vec<f64>> {
    let text = fs::read_to_string(file).expect("a table");
    let row = |line: &str| line.split(',').map(|word| word.parse().expect("a number")).collect();
    text.lines().skip(1).map(row).collect()
}

/// A plane on the floor: the table, the image and the closed form agree, the second edge is up in the image, and the false colours are brightest
/// below the lamp.
#[test]
fn a_plane_is_the_same_in_all_formats() {
    let folder = folder();
    // In the half of the floor before the lamp, seen from above.
    let plane = ["--plane", "-1,0,2", "2,0,0", "0,0,-2", "--resolution", "9x6"];
    let outputs = ["-o", "a.csv", "-o", "a.exr", "-o", "a.png", "--indirect", "off"];
    let output = run(folder.path(), &[&["probe", "scene.toml"], &plane[..], &outputs].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let rows = rows(&folder.path().join("a.csv"));
    assert_eq!(rows.len(), 9 * 6);
    let image = image::read(&folder.path().join("a.exr")).expect("an image");
    for (index, row) in rows.iter().enumerate() {
        let [x, y, z, nx, ny, nz, red, _, blue, lux] = row[..] else { panic!("{row:?}") };
        assert_eq!([y, nx, ny, nz], [0.0, 0.0, 1.0, 0.0]);
        let expected = 3.0 * 2.0 / (x * x + z * z + 4.0f64).powf(1.5);
        assert!((red / expected - 1.0).abs() < 0.01 && red == blue, "{red} for {expected}");
        assert!((lux / (683.0 * expected) - 1.0).abs() < 0.01, "{lux}");
        let (column, row_up) = (index as u32 % 9, index as u32 / 9);
        assert_eq!(f64::from(image.get(column, 5 - row_up).expect("a pixel")[0]) as f32, red as f32);
    }
    let colours = image::read(&folder.path().join("a.png")).expect("an image");
    let redness = |x, y| colours.get(x, y).map(|[red, _, blue]| red - blue);
    // The lamp hangs over the middle of the upper edge.
    assert!(redness(4, 0) > redness(0, 5), "{:?}", colours.pixels());
}

/// Points and lines give fluence unless there is a normal; the threads change nothing.
#[test]
fn lines_and_points_are_measured() {
    let folder = folder();
    let folder = folder.path();
    fs::write(folder.join("points.txt"), "0 1 0\n0 1.5 0\n").expect("writable");
    let output =
        run(folder, &["probe", "scene.toml", "--points", "points.txt", "-o", "p.csv", "--indirect", "off"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let found: Vec<f64> = rows(&folder.join("p.csv")).iter().map(|row| row[3]).collect();
    assert!((found[0] - 3.0).abs() < 1e-3 && (found[1] - 12.0).abs() < 1e-2, "{found:?}");

    let line = ["probe", "scene.toml", "--line", "-1,1,0", "1,1,0", "--samples", "3", "--normal", "0,-2,0"];
    for (threads, file) in [("1", "one.csv"), ("2", "two.csv")] {
        let output = run(folder, &[&line[..], &["--threads", threads, "-o", file]].concat());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    let table = |file: &str| fs::read(folder.join(file)).expect("a table");
    assert_eq!(table("one.csv"), table("two.csv"));
    // What faces down receives light from the floor alone.
    let rows = rows(&folder.join("one.csv"));
    assert_eq!(rows.len(), 3);
    assert!(rows.iter().all(|row| row[4] == -1.0 && row[6] > 0.1), "{rows:?}");
}

/// Both forms of a grid of harmonics hold the same numbers, in the layout of docs/probes.md.
#[test]
fn grids_are_written_as_text_and_bytes() {
    let folder = folder();
    let arguments =
        ["probe", "scene.toml", "--grid", "2x3x1", "--box", "-1,0.5,1", "1,2,-1", "--directions", "64"];
    let output =
        run(folder.path(), &[&arguments[..], &["-o", "g.json", "-o", "g.bin", "-o", "g.vti"]].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let file = fs::read(folder.path().join("g.json")).expect("a file");
    let json: Value = serde_json::from_slice(&file).expect("JSON");
    assert_eq!((&json["format"], &json["version"]), (&"lightmesh-sh-grid".into(), &1.into()));
    assert_eq!(json["counts"], serde_json::json!([2, 3, 1]));
    let list = |value: &Value| -> Vec<f32> {
        value
            .as_array()
            .expect("a list")
            .iter()
            .map(|number| number.as_f64().expect("a number") as f32)
            .collect()
    };
    assert_eq!((list(&json["origin"]), list(&json["step"])), (vec![-0.5, 0.75, 0.0], vec![1.0, 0.5, 2.0]));
    let coefficients = json["coefficients"].as_array().expect("a list");
    assert_eq!(coefficients.len(), 6);
    let coefficients: Vec<f32> =
        coefficients.iter().flat_map(|probe| probe.as_array().expect("a list")).flat_map(list).collect();
    let bytes = fs::read(folder.path().join("g.bin")).expect("a file");
    assert_eq!(&bytes[..20], b"LMSH\x01\0\0\0\x02\0\0\0\x03\0\0\0\x01\0\0\0");
    let numbers: Vec<f32> =
        bytes[20..].as_chunks::<4>().0.iter().map(|number| f32::from_le_bytes(*number)).collect();
    assert_eq!(numbers[..6], [-0.5, 0.75, 0.0, 1.0, 0.5, 2.0]);
    assert_eq!(numbers[6..], coefficients);
    assert_eq!(coefficients.len(), 6 * 27);
}

/// What can't be done is said before the scene is read, and nothing is written.
#[test]
fn wrong_usage_is_refused() {
    let folder = folder();
    for (arguments, expected) in [
        (&["-o", "a.csv"][..], "required"),
        (&["--line", "0,0,0", "1,1,1", "--grid", "1x1x1", "-o", "a.csv"], "cannot be used with"),
        (&["--line", "0,0,0", "1,1,1", "-o", "a.png"], ".csv for points and lines"),
        (&["--plane", "0,0,0", "1,0,0", "2,0,0", "-o", "a.png"], "enclose no area"),
        (&["--grid", "2x2x2", "-o", "a.csv"], ".json, .bin or .vti for a grid"),
        (&["--grid", "2x2", "-o", "a.json"], "three numbers above 0"),
        (&["--line", "0,0,0", "1,1,1", "--normal", "0,0,0", "-o", "a.csv"], "length above 0"),
        (&["--plane", "0,0,0", "1,0,0", "0,1,0", "--normal", "0,0,1", "-o", "a.csv"], "no --normal"),
    ] {
        let output = run(folder.path(), &[&["probe", "scene.toml"], arguments].concat());
        let errors = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {errors}");
        assert!(errors.contains(expected), "{arguments:?}: {errors}");
    }
    fs::write(folder.path().join("points.txt"), "0 1 0\n0 1\n").expect("writable");
    let output = run(folder.path(), &["probe", "scene.toml", "--points", "points.txt", "-o", "a.csv"]);
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1));
    assert!(errors.contains("points.txt:2: three numbers or six expected"), "{errors}");
    assert!(fs::read_dir(folder.path()).expect("a folder").count() == 3, "nothing was written");
}

/// The points that a camera needs are exported in all formats; other cameras and formats are refused.
#[test]
fn points_of_a_view_are_exported() {
    let folder = folder();
    let arguments = ["-o", "f.vtu", "-o", "f.ply", "-o", "f.vti"];
    let output = run(folder.path(), &[&["export", "scene.toml"], &arguments[..]].concat());
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{errors}");
    let count = errors.lines().find_map(|line| line.strip_suffix(" points")).expect("the number is reported");
    assert!(count.parse::<u32>().expect("a number") > 0);
    let holds = |file: &str, text: String| {
        let bytes = fs::read(folder.path().join(file)).expect("a file");
        assert!(bytes.windows(text.len()).any(|window| window == text.as_bytes()), "{file}: {text}");
    };
    holds("f.vtu", format!("NumberOfPoints=\"{count}\" NumberOfCells=\"{count}\""));
    holds("f.ply", format!("element vertex {count}\n"));
    holds("f.vti", "<VTKFile type=\"ImageData\"".to_owned());
    assert!(errors.contains(&format!(": {count} are known\n")), "{errors}");
    let jittered = SCENE.replace("[render]", "[light_mesh]\nlayout = \"jittered\"\n[render]");
    fs::write(folder.path().join("jittered.toml"), jittered).expect("writable");
    for (scene, arguments, code, expected) in [
        ("scene.toml", &["-o", "f.obj"][..], 1, "ends in .vtu, .ply or .vti"),
        ("scene.toml", &["-o", "g.ply", "--camera", "none"], 1, "no camera is named `none`"),
        (
            "scene.toml",
            &["-o", "g.vti", "--spacing", "7"],
            1,
            "scene.toml: no grid of mesh points has the spacing 7; there",
        ),
        (
            "scene.toml",
            &["-o", "g.vtu", "--spacing", "7"],
            2,
            "--spacing goes with an output that ends in .vti",
        ),
        (
            "jittered.toml",
            &["-o", "g.ply", "-o", "g.vti"],
            1,
            "jittered.toml: holds no mesh points of the layouts `regular` and",
        ),
    ] {
        let output = run(folder.path(), &[&["export", scene], arguments].concat());
        let errors = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(code) && errors.contains(expected), "{errors}");
    }
    assert!(!folder.path().join("g.ply").exists(), "nothing was written");
}
