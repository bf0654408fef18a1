//! What the program says about itself is true: its help, its examples, its manual pages, its completions, its version, its guesses at
//! mistyped names.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

const MODEL: &str = "v -1 -1 0\nv 1 -1 0\nv 0 1 0\nf 1 2 3\n";

const SCENE: &str = "[camera]\nname = \"front\"\nposition = [0, 0, 3]\nlook_at = [0, 0, 0]\n[render]\nresolution = [64, 8]\n\
                     [[geometry]]\nfile = \"model.obj\"\n[[light]]\nposition = [0, 1, 2]\nintensity = 1\n";

const LIST: &str = "[[picture]]\nname = \"first\"\ntitle = \"T\"\nscene = \"scene.toml\"\ncaption = \"C\"\n";

/// Examples that take longer than a test should: benchmarks, and pictures of the usual size.
const NOT_QUICK: [&str; 3] = ["lightmesh bench", "lightmesh render forest/", "lightmesh render model.obj"];

fn program(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lightmesh"));
    command.args(arguments).current_dir(folder);
    command
}

fn run(folder: &Path, arguments: &[&str]) -> Output {
    program(folder, arguments).output().expect("the program runs")
}

fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).expect("UTF-8")
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// A folder with what examples speak of.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, text) in [
        ("model.obj", MODEL),
        ("scene.toml", SCENE),
        ("gallery.toml", LIST),
        ("desks.csv", "0 0 0.1 0 0 1\n"),
    ] {
        fs::write(folder.path().join(name), text).expect("writable");
    }
    for name in ["a.png", "b.png"] {
        let rendered = run(folder.path(), &["render", "scene.toml", "-o", name]);
        assert!(rendered.status.success(), "{}", stderr(&rendered));
    }
    folder
}

/// The names below a command, as its help lists them.
fn subcommands(help: &str) -> Vec<String> {
    let lines = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    // What a line has no room for goes on below, further to the right.
    let lines = lines.take_while(|line| line.starts_with("  ")).filter(|line| !line.starts_with("   "));
    let names = lines.filter_map(|line| line.split_whitespace().next());
    names.filter(|name| *name != "help").map(str::to_owned).collect()
}

/// The help of every command, by its path.
fn helps() -> Vec<(Vec<String>, String)> {
    let (mut helps, mut left) = (Vec::new(), vec![Vec::new()]);
    while let Some(path) = left.pop() {
        let arguments: Vec<&str> = path.iter().map(String::as_str).chain(["--help"]).collect();
        let output = run(Path::new("."), &arguments);
        assert!(output.status.success(), "{path:?}");
        let help = stdout(&output);
        left.extend(subcommands(&help).into_iter().map(|name| [&path[..], &[name]].concat()));
        helps.push((path, help));
    }
    helps
}

/// The quick examples do what they say they do, exactly as they are printed.
#[test]
fn examples_run_as_they_are_printed() {
    let folder = folder();
    // What examples of other commands make.
    let before = [
        "bake scene.toml -o field.lmesh",
        "render scene.toml --tile 1/2 -o t1.exr",
        "render scene.toml --tile 2/2 -o t2.exr",
    ];
    for line in before {
        let output = run(folder.path(), &line.split(' ').collect::<Vec<_>>());
        assert!(output.status.success(), "{line}: {}", stderr(&output));
    }
    let mut ran = 0;
    for (path, help) in helps() {
        let lines = help.lines().skip_while(|line| *line != "Examples:").map(str::trim);
        let examples: Vec<&str> = lines.filter(|line| line.starts_with("lightmesh ")).collect();
        assert!(!examples.is_empty(), "{path:?}: {help}");
        for example in examples {
            if NOT_QUICK.iter().any(|slow| example.starts_with(slow)) {
                continue;
            }
            // What follows is the shell's.
            let words: Vec<&str> =
                example.split_whitespace().skip(1).take_while(|word| *word != ">").collect();
            let output = run(folder.path(), &words);
            assert!(output.status.success(), "{example}: {}", stderr(&output));
            ran += 1;
        }
    }
    assert!(ran > 10, "{ran}");
}

/// There is a page for each command, under the name that `man` looks for, with the options and examples of its help.
#[test]
fn manual_pages_say_what_help_says() {
    let folder = tempfile::tempdir().expect("a folder");
    let output = run(folder.path(), &["man", "man1", "--verbose"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let mut expected = BTreeSet::new();
    for (path, help) in helps() {
        let name = format!("{}.1", [&["lightmesh".to_owned()][..], &path].concat().join("-"));
        let page = fs::read_to_string(folder.path().join("man1").join(&name)).expect("a page");
        // The only characters of flags and command lines that pages escape.
        let page = page.replace("\\-", "-");
        for flag in help.split_whitespace().filter(|word| word.starts_with("--") && word.len() > 2) {
            let flag = flag.trim_end_matches(|c: char| !c.is_alphanumeric());
            assert!(page.contains(flag), "{name} has no {flag}");
        }
        for example in help.lines().map(str::trim).filter(|line| line.starts_with("lightmesh ")) {
            assert!(page.contains(example), "{name} has no `{example}`");
        }
        assert!(stderr(&output).contains(&name), "--verbose names {name}");
        expected.insert(name);
    }
    let files = fs::read_dir(folder.path().join("man1")).expect("a folder");
    let found: BTreeSet<String> =
        files.map(|file| file.expect("a file").file_name().to_string_lossy().into_owned()).collect();
    assert_eq!(found, expected);
}

/// Bash itself completes command lines by the script that is made for it.
#[test]
fn bash_completes_commands_flags_and_values() {
    let folder = tempfile::tempdir().expect("a folder");
    let script = stdout(&run(folder.path(), &["completions", "bash"]));
    fs::write(folder.path().join("lightmesh.bash"), script).expect("writable");
    for (words, completed) in [
        (&["rend"][..], "render"),
        (&["render", "--reso"], "--resolution"),
        (&["render", "--integrator", "refer"], "reference"),
        (&["compare", "--fail"], "--fail-above"),
        (&["generate", "inte"], "interior"),
    ] {
        let last = words[words.len() - 1];
        let before = if words.len() > 1 { words[words.len() - 2] } else { "lightmesh" };
        let line = format!(
            "source ./lightmesh.bash; COMP_WORDS=(lightmesh {}); COMP_CWORD={}; _lightmesh lightmesh {last} {before}; \
             echo \"${{COMPREPLY[@]}}\"",
            words.join(" "),
            words.len(),
        );
        let bash = Command::new("bash").args(["--norc", "-c", &line]).current_dir(folder.path()).output();
        let output = bash.expect("bash runs");
        let found = stdout(&output);
        assert!(
            found.split_whitespace().any(|word| word == completed),
            "{words:?}: {found}{}",
            stderr(&output)
        );
    }
    for shell in ["zsh", "fish", "elvish", "powershell"] {
        assert!(stdout(&run(folder.path(), &["completions", shell])).contains("crosscheck"), "{shell}");
    }
}

/// Colours can be switched off for good, as https://no-color.org has it, even where something else asks for them.
#[test]
fn no_color_means_no_escapes() {
    let colourful = |arguments: &[&str], no_color: Option<&str>| {
        let mut command = program(Path::new("."), arguments);
        command
            .env("CLICOLOR_FORCE", "1")
            .env_remove("NO_COLOR")
            .envs(no_color.map(|value| ("NO_COLOR", value)));
        let output = command.output().expect("the program runs");
        output.stdout.contains(&0x1b) || output.stderr.contains(&0x1b)
    };
    for arguments in [&["--help"][..], &["render", "-h"], &["rendr"], &["render"]] {
        assert!(colourful(arguments, None), "{arguments:?} has colours to switch off");
        assert!(!colourful(arguments, Some("1")), "{arguments:?}");
    }
}

/// What a report of an error has to say about a build can be asked for in one line, in either order, and is not in the way of scripts that
/// want the version alone.
#[test]
fn the_version_has_details_for_who_wants_them() {
    let version = |arguments: &[&str]| {
        let output = run(Path::new("."), arguments);
        assert!(output.status.success() && output.stderr.is_empty(), "{}", stderr(&output));
        stdout(&output)
    };
    let first = format!("lightmesh {}\n", env!("CARGO_PKG_VERSION"));
    assert_eq!(version(&["--version"]), first);
    let details = version(&["--version", "--verbose"]);
    assert!(details.starts_with(&first), "{details}");
    for name in ["commit", "target", "features", "built for", "instructions", "threads", "embree", "bvh"] {
        let lines: Vec<&str> = details.lines().filter(|line| line.starts_with(name)).collect();
        assert!(!lines.is_empty() && lines.iter().all(|line| line.len() > 14), "{name}: {details}");
    }
    for arguments in [&["-vV"][..], &["-V", "-v"], &["--verbose", "--version"]] {
        assert_eq!(version(arguments), details);
    }
    // A library that can't be loaded is named with the reason, and is no failure here.
    let without =
        program(Path::new("."), &["-Vv"]).env("EMBREE_LIB", "/nowhere.so").output().expect("it runs");
    let text = stdout(&without);
    let embree = text.lines().find(|line| line.starts_with("embree")).expect("a line");
    assert!(without.status.success() && embree.contains("none: "), "{embree}");
}

/// A slip of the finger costs one look, wherever a name is given.
#[test]
fn mistyped_names_are_recognised() {
    let folder = folder();
    let broken = SCENE.replace("resolution", "resolutoin");
    fs::write(folder.path().join("broken.toml"), broken).expect("writable");
    fs::write(folder.path().join("list.toml"), LIST.replace("caption", "captoin")).expect("writable");
    for (arguments, code, meant) in [
        (&["rendr", "scene.toml"][..], 2, "'render'"),
        (&["render", "scene.toml", "-o", "c.png", "--resoluton", "8x8"], 2, "'--resolution'"),
        (&["render", "scene.toml", "-o", "c.png", "--estimator", "per-lihgt"], 2, "'per-light'"),
        (&["render", "scene.toml", "-o", "c.png", "--camera", "fornt"], 1, "(did you mean `front`?)"),
        (
            &["info", "broken.toml"],
            1,
            "broken.toml:6: render.resolutoin: unknown key, did you mean `resolution`?",
        ),
        (
            &["gallery", "--list", "gallery.toml", "--out", "out", "--only", "frist"],
            1,
            "(did you mean `first`?)",
        ),
        (
            &["gallery", "--list", "list.toml", "--out", "out"],
            1,
            "captoin: unknown key, did you mean `caption`?",
        ),
        (&["compare", "a.png", "b.png", "--fail-above", "rmes=1"], 2, "(did you mean `rmse`?)"),
    ] {
        let output = run(folder.path(), arguments);
        let message = stderr(&output);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {message}");
        assert!(message.contains(meant), "{arguments:?}: {message}");
        // What clap says about usage has several lines.
        assert!(code == 2 || message.lines().count() == 1, "{message}");
    }
}
