//! Progress comes in the form that was asked for, where its readers look for it, and changes no picture.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

const MODEL: &str = "v -1 -1 0\nv 1 -1 0\nv 0 1 0\nf 1 2 3\nl 1 2\n";

const SCENE: &str = "[camera]\nposition = [0, 0, 3]\nlook_at = [0, 0, 0]\n[render]\nresolution = [100, 80]\nspp = 1\n\
                     [[geometry]]\nfile = \"a.obj\"\n[[light]]\nposition = [0, 1, 2]\nintensity = 1\n";

const PIXELS: u64 = 100 * 80;

const FORMS: [&str; 5] = ["auto", "bar", "json", "openjd", "none"];

fn lightmesh(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lightmesh"));
    command.args(arguments).current_dir(folder).output().expect("the program runs")
}

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("a.obj"), MODEL).expect("writable");
    fs::write(folder.path().join("a.toml"), SCENE).expect("writable");
    folder
}

/// Renders with a form of progress; the picture's bytes, stdout and stderr.
fn rendered(folder: &Path, form: &str, flags: &[&str]) -> (Vec<u8>, String, String) {
    let arguments = ["render", "a.toml", "-o", "a.exr", "--backend", "bvh", "--progress", form];
    let output = lightmesh(folder, &[&arguments[..], flags].concat());
    let [out, err] =
        [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes).into_owned());
    assert!(output.status.success(), "{form}: {err}");
    (fs::read(folder.join("a.exr")).expect("a picture"), out, err)
}

fn events(text: &str) -> Vec<serde_json::Value> {
    text.lines()
        .map(|line| serde_json::from_str(line).unwrap_or_else(|_| panic!("no JSON: {line}")))
        .collect()
}

/// Whoever watches changes nothing: the file is the same to the byte.
#[test]
fn no_form_of_progress_changes_the_picture() {
    let folder = folder();
    let (plain, ..) = rendered(folder.path(), "none", &[]);
    for form in FORMS {
        for flag in ["--quiet", "--verbose"] {
            assert!(rendered(folder.path(), form, &[flag]).0 == plain, "{form} {flag}");
        }
    }
}

/// Every line on stderr is an event; counts grow from nothing to all the pixels; what is otherwise said is said in events.
#[test]
fn json_is_lines_of_events() {
    let folder = folder();
    let (_, out, err) = rendered(folder.path(), "json", &[]);
    assert_eq!(out, "");
    let events = events(&err);
    let of = |kind: &'static str| events.iter().filter(move |event| event["event"] == kind);
    assert_eq!(
        of("stage").map(|event| &event["stage"]).collect::<Vec<_>>(),
        ["reading", "building", "rendering"]
    );
    let done: Vec<u64> = of("progress").filter_map(|event| event["done"].as_u64()).collect();
    assert!(done.is_sorted() && done.first() == Some(&0) && done.last() == Some(&PIXELS), "{done:?}");
    assert!(of("progress").all(|event| event["total"] == PIXELS && event["stage"] == "rendering"));
    let warned =
        |text: &str| of("message").any(|event| event["text"].as_str().is_some_and(|t| t.contains(text)));
    assert!(warned("left out 1 line elements") && warned("shadow rays"), "{err}");

    let failed = lightmesh(folder.path(), &["info", "missing.toml", "--progress", "json"]);
    let events = self::events(&String::from_utf8_lossy(&failed.stderr));
    let last = events.last().expect("an event");
    assert!(
        last["event"] == "error"
            && last["text"].as_str().is_some_and(|text| text.starts_with("missing.toml: "))
    );
}

/// Probes are counted as pixels are, whether light is measured at points or in a grid.
#[test]
fn probes_are_counted() {
    let folder = folder();
    let places = [
        &["--line", "-1,0,1", "1,0,1", "--samples", "300", "-o", "a.csv"][..],
        &["--grid", "5x6x10", "-o", "a.bin"],
    ];
    for place in places {
        let run = |form: &str| {
            let arguments = ["probe", "a.toml", "--quiet", "--progress", form];
            let output = lightmesh(folder.path(), &[&arguments[..], place].concat());
            let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
            assert!(output.status.success(), "{}", text(&output.stderr));
            [text(&output.stdout), text(&output.stderr)]
        };
        let events = events(&run("json")[1]);
        let progress: Vec<_> = events.iter().filter(|event| event["event"] == "progress").collect();
        assert!(progress.iter().all(|event| event["stage"] == "measuring" && event["total"] == 300));
        let done: Vec<u64> = progress.iter().filter_map(|event| event["done"].as_u64()).collect();
        assert!(done.is_sorted() && done.first() == Some(&0) && done.last() == Some(&300), "{done:?}");
        assert!(run("openjd")[0].ends_with("openjd_progress: 100.0\n"));
        assert!(run("bar")[1].ends_with("measuring: 100 %\n"));
        assert_eq!(run("none"), [String::new(), String::new()]);
    }
}

/// Sessions of Open Job Description read `openjd_progress: ` with a number from 0 to 100, `openjd_status: ` and `openjd_fail: `; nothing else is on
/// stdout, and notices stay where they are.
#[test]
fn open_job_description_reads_stdout() {
    let folder = folder();
    let (_, out, err) = rendered(folder.path(), "openjd", &[]);
    let values = |key: &str| -> Vec<String> {
        out.lines()
            .filter_map(|line| line.strip_prefix(&format!("openjd_{key}: ")))
            .map(str::to_owned)
            .collect()
    };
    assert_eq!(values("status"), ["reading", "building", "rendering"]);
    let percents: Vec<f64> = values("progress").iter().map(|text| text.parse().expect("a number")).collect();
    assert!(
        percents.is_sorted() && percents.first() == Some(&0.0) && percents.last() == Some(&100.0),
        "{percents:?}"
    );
    assert_eq!(out.lines().count(), 3 + percents.len(), "{out}");
    assert!(err.contains("warning: ") && !err.contains("openjd_"), "{err}");

    let failed = lightmesh(folder.path(), &["render", "missing.toml", "-o", "b.png", "--progress", "openjd"]);
    let [out, err] =
        [&failed.stdout, &failed.stderr].map(|bytes| String::from_utf8_lossy(bytes).into_owned());
    assert!(out.lines().any(|line| line.starts_with("openjd_fail: missing.toml: ")), "{out}");
    assert!(err.starts_with("lightmesh: missing.toml: ") && failed.status.code() == Some(1), "{err}");
}

/// Into a file goes what can be read there: a line per tenth if bars are asked for, and nothing by itself.
#[test]
fn bars_in_files_are_lines() {
    let folder = folder();
    let progress = |form: &str| -> Vec<String> {
        let lines = rendered(folder.path(), form, &[]).2;
        lines.lines().filter(|line| line.starts_with("rendering: ")).map(str::to_owned).collect()
    };
    let lines = progress("bar");
    assert!((2..=12).contains(&lines.len()), "{lines:?}");
    assert_eq!(
        (lines.first().map(String::as_str), lines.last().map(String::as_str)),
        (Some("rendering: 0 %"), Some("rendering: 100 %"))
    );
    assert!(progress("auto").is_empty() && progress("none").is_empty());
}

/// Quiet is quiet but for the progress that somebody asked for; verbose says more; both at once make no sense.
#[test]
fn quiet_and_verbose_mean_the_same_everywhere() {
    let folder = folder();
    let _ = rendered(folder.path(), "none", &[]);
    let (_, out, err) = rendered(folder.path(), "auto", &["--quiet"]);
    assert_eq!((out.as_str(), err.as_str()), ("", ""));
    let (_, _, err) = rendered(folder.path(), "json", &["--quiet"]);
    assert!(events(&err).iter().all(|event| event["event"] != "message"), "{err}");

    for arguments in [
        &["render", "a.toml", "-o", "a.exr"][..],
        &["info", "a.toml"],
        &["init", "a.obj", "-o", "b.toml"],
        &["generate", "still-life", "-o", "still"],
        &["crosscheck", "a.toml", "--rays", "100"],
        &["compare", "a.exr", "a.exr"],
        &["man", "man1"],
    ] {
        let with = |flag: &str| lightmesh(folder.path(), &[arguments, &[flag]].concat());
        let lines = |output: &Output| {
            assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
            output.stderr.iter().filter(|byte| **byte == b'\n').count()
        };
        assert_eq!(lines(&with("--quiet")), 0, "{arguments:?}");
        let plain = lines(&lightmesh(folder.path(), arguments));
        assert!(lines(&with("--verbose")) > plain, "{arguments:?}");
        // The flags may stand before the command too.
        let before = [&["--verbose"], arguments].concat();
        assert!(lines(&lightmesh(folder.path(), &before)) > plain, "{arguments:?}");
    }
    let both = lightmesh(folder.path(), &["info", "a.toml", "--quiet", "--verbose"]);
    assert_eq!(both.status.code(), Some(2));
}
