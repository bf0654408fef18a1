//! The gallery's list, its scenes and its committed pictures fit together.

use std::fs;
use std::path::{Path, PathBuf};

use clap::Parser;
use lightmesh::cli::gallery::{Gallery, GalleryArgs, run};
use lightmesh::cli::{CommandError, Outcome, describe};
use lightmesh::scene::load::load_scene_file;

/// The command line, without the program's own part.
#[derive(Parser)]
struct Line {
    #[command(flatten)]
    args: GalleryArgs,
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn gallery(arguments: &[&str]) -> Result<Outcome, CommandError> {
    run(&Line::parse_from(["gallery", "--quiet"].iter().chain(arguments)).args)
}

/// A list of two pictures of one triangle.
fn small_list(folder: &Path) -> PathBuf {
    let scene = "[camera]\nposition = [0, 0, 3]\nlook_at = [0, 0, 0]\n[render]\nresolution = [8, 8]\n\
                 [[geometry]]\nfile = \"a.obj\"\n[[light]]\nposition = [0, 1, 2]\nintensity = 1\n";
    fs::write(folder.join("a.toml"), scene).unwrap();
    fs::write(folder.join("a.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let picture = |name: &str| {
        format!(
            "[[picture]]\nname = \"{name}\"\ntitle = \"The {name} <one>\"\nscene = \"a.toml\"\ncaption = \"Seen.\"\n"
        )
    };
    let list = folder.join("list.toml");
    fs::write(&list, picture("first") + &picture("second")).unwrap();
    list
}

/// Every picture of the list is committed, small, and its scene loads; nothing else lies there.
#[test]
fn the_committed_gallery_is_complete_and_small() {
    let list = Gallery::read(&root().join("scenes/gallery.toml")).unwrap();
    let folder = root().join("docs/gallery");
    let mut total = 0;
    for picture in &list.images {
        match picture.missing(&root().join("scenes")) {
            Some(model) => println!("skipped: the scene of {} needs {}", picture.name, model.display()),
            None => drop(load_scene_file(&root().join("scenes").join(&picture.scene)).unwrap()),
        }
        for (name, _) in picture.files() {
            let size = fs::metadata(folder.join(format!("{name}.png"))).unwrap().len();
            assert!(size <= 1_000_000, "{name}: {size} bytes");
            total += size;
        }
    }
    assert!(total < 10_000_000, "{total} bytes");
    for file in fs::read_dir(&folder).unwrap() {
        let path = file.unwrap().path();
        let stem = path.file_stem().unwrap().to_str().unwrap();
        let known = ["page", "index"].contains(&stem)
            || list.images.iter().any(|p| p.files().any(|(name, _)| name == stem));
        assert!(known, "{} belongs to no picture", path.display());
    }
}

/// Each picture brings its statistics, and that of the conventional tracer where the list asks for it; the pages name them all.
#[test]
fn a_gallery_is_pictures_and_pages() {
    let folder = tempfile::tempdir().unwrap();
    let list = small_list(folder.path());
    let out = folder.path().join("out");
    let arguments = ["--list", list.to_str().unwrap(), "--out", out.to_str().unwrap()];

    gallery(&[&arguments[..], &["--only", "second"]].concat()).unwrap();
    assert!(!out.join("first.png").exists());
    let page = fs::read_to_string(out.join("page.md")).unwrap();
    assert!(page.contains("(second.png)") && !page.contains("first"));

    gallery(&arguments).unwrap();
    let page = fs::read_to_string(out.join("page.md")).unwrap();
    assert!(page.find("(first.png)").unwrap() < page.find("(second.png)").unwrap());
    assert!(page.contains("Seen.") && page.contains("mesh points") && page.contains("resolution = [8, 8]"));
    let html = fs::read_to_string(out.join("index.html")).unwrap();
    assert!(html.contains("src=\"first.png\"") && html.contains("src=\"second.png\""));
    assert_eq!(html.matches("src=").count(), 2);

    fs::write(&list, fs::read_to_string(&list).unwrap() + "conventional = true\n").unwrap();
    gallery(&[&arguments[..], &["--only", "second"]].concat()).unwrap();
    let page = fs::read_to_string(out.join("page.md")).unwrap();
    assert!(page.contains("(second-conventional.png)") && page.contains("| seconds, conventionally |"));
    assert!(fs::read_to_string(out.join("second-conventional.json")).unwrap().contains("\"conventional\""));
    assert!(html.contains("The first &lt;one&gt;"));
}

/// A picture of a model that isn't there is passed over; what was rendered of it before stays on the page.
#[test]
fn a_picture_whose_model_is_missing_is_skipped() {
    let folder = tempfile::tempdir().unwrap();
    let list = small_list(folder.path());
    let out = folder.path().join("out");
    let arguments = ["--list", list.to_str().unwrap(), "--out", out.to_str().unwrap()];
    let text = fs::read_to_string(&list).unwrap() + "needs = [\"models/absent.glb\"]\n";
    fs::write(&list, text).unwrap();

    gallery(&arguments).unwrap();
    assert!(out.join("first.png").exists() && !out.join("second.png").exists());
    fs::create_dir(folder.path().join("models")).unwrap();
    fs::write(folder.path().join("models/absent.glb"), "").unwrap();
    gallery(&arguments).unwrap();
    assert!(out.join("second.png").exists());
    fs::remove_file(folder.path().join("models/absent.glb")).unwrap();
    gallery(&arguments).unwrap();
    assert!(fs::read_to_string(out.join("page.md")).unwrap().contains("(second.png)"));
}

/// What is wrong with a list is said with its name.
#[test]
fn a_list_that_makes_no_sense_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let list = small_list(folder.path());
    let path = list.to_str().unwrap();
    let out = folder.path().join("out");
    let failure = |arguments: &[&str]| {
        let message = gallery(&[&["--list", path, "--out", out.to_str().unwrap()], arguments].concat());
        describe(&message.unwrap_err())
    };
    assert!(failure(&["--only", "third"]).contains("no picture is named `third`; there are: first, second"));
    let good = fs::read_to_string(&list).unwrap();
    for (bad, expected) in [
        (good.replace("\"second\"", "\"first\""), "two pictures `first`"),
        (good.replace("\"second\"", "\"../second\""), "picture[1].name"),
        (good.replace("caption = ", "legend = "), "legend"),
        (good.replace("a.toml", "b.toml"), "b.toml"),
    ] {
        fs::write(&list, bad).unwrap();
        let message = failure(&[]);
        assert!(message.contains(expected), "{message}");
    }
}
