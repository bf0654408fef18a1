//! A scene file means what docs/scene-format.md says, and every mistake in it is one error that names file, line
//! and key.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use glam::Vec3;
use lightmesh::scene::Falloff;
use lightmesh::scene::load::scene_file::load_scene_text;
use lightmesh::scene::load::{LoadError, LoadedScene, load_scene_file};
use lightmesh::settings::{
    Estimator, IndirectForm, Integrator, Leaks, Named, Neighbourhood, Normalization, PointLayout, Radius,
    Resolve, Spacing, Step, Steps,
};
use tempfile::TempDir;

mod contents;
mod motion;

const MODEL: &str = "\
mtllib model.mtl
v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 1
o lamp
usemtl leaf
f 1 2 3
o rest
f 1 3 4
";

const CAMERA: &str = "\n[camera]\nposition = [0, 2, 5]\nlook_at = [0, 1, 0]\n";
const GEOMETRY: &str = "\n[[geometry]]\nfile = \"model.obj\"\n";

/// A folder with the files that examples refer to.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::write(folder.path().join("model.obj"), MODEL).expect("writable");
    fs::write(folder.path().join("model.mtl"), "newmtl leaf\nKd 0.1 0.2 0.3\n").expect("writable");
    fs::write(folder.path().join("points.csv"), "x,y,z\n0,0,0\n1, 2, 3\n").expect("writable");
    folder
}

fn load_in(folder: &TempDir, text: &str) -> Result<LoadedScene, LoadError> {
    load_scene_text(text, &folder.path().join("scene.toml"))
}

/// Loads `text` with a camera and a model added where it has none.
fn load(text: &str) -> Result<LoadedScene, LoadError> {
    let mut whole = text.to_owned();
    if !text.contains("[camera]") && !text.contains("[[camera]]") {
        whole.push_str(CAMERA);
    }
    if !text.contains("[[geometry]]") {
        whole.push_str(GEOMETRY);
    }
    load_in(&folder(), &whole)
}

fn loaded(text: &str) -> LoadedScene {
    load(text).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

/// The error's message without the folder in front of it.
fn message(text: &str) -> String {
    let error = load(text).err().unwrap_or_else(|| panic!("loads: {text}")).to_string();
    let at = error.find("scene.toml").unwrap_or_else(|| panic!("names no file: {error}"));
    error[at..].to_owned()
}

fn documentation() -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/scene-format.md");
    fs::read_to_string(path).expect("the documentation")
}

#[test]
fn every_example_of_the_documentation_loads() {
    let text = documentation();
    let examples: Vec<&str> =
        text.split("```toml\n").skip(1).filter_map(|rest| rest.split("```").next()).collect();
    assert!(examples.len() >= 12, "found {} examples", examples.len());
    for example in examples {
        loaded(example);
    }
}

/// Keys of one table, from the parser's own list of what it expects.
fn accepted_keys(table: &str) -> BTreeSet<String> {
    let text = format!("{table}\nno_such_key = 1\n");
    let error = message(&text);
    let (_, expected) = error.split_once("expected").unwrap_or_else(|| panic!("{error}"));
    expected.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

/// Keys in the first column of the table under a heading.
fn documented_keys(documentation: &str, heading: &str) -> BTreeSet<String> {
    let section =
        documentation.split(&format!("\n{heading}\n")).nth(1).unwrap_or_else(|| panic!("no {heading}"));
    let section = section.split("\n#").next().unwrap_or_default();
    let rows = section.lines().filter_map(|line| line.strip_prefix("| `"));
    rows.filter_map(|row| row.split('|').next())
        .flat_map(|cell| cell.split(['`', ',', ' ']))
        .filter(|key| !key.is_empty())
        .map(str::to_owned)
        .collect()
}

#[test]
fn exactly_the_documented_keys_are_accepted() {
    let text = documentation();
    for heading in [
        "## `[render]`",
        "### `[[render.steps]]`",
        "## `[camera]`",
        "### `[[camera.keyframes]]`",
        "### `[camera.turntable]`",
        "## `[animation]`",
        "## `[[material]]`",
        "## `[[light]]`",
        "## `[[light_box]]`",
        "## `[[light_grid]]`",
        "## `[[geometry]]`",
        "### `[[light_mesh.region]]`",
    ] {
        let header = heading.trim_start_matches('#').trim().trim_matches('`');
        assert_eq!(accepted_keys(header), documented_keys(&text, heading), "{header}");
    }
    let of_geometry = accepted_keys("[[geometry]]\nfile = \"model.obj\"\n[[geometry.keyframes]]");
    assert_eq!(of_geometry, documented_keys(&text, "### `[[geometry.keyframes]]`"));
    let tables = ["indirect", "region"].map(str::to_owned);
    let mut points = documented_keys(&text, "## `[light_mesh]`");
    let direct: BTreeSet<String> = accepted_keys("[light_mesh]");
    points.extend(tables.clone());
    assert_eq!(direct, points);
    let mut indirect = documented_keys(&text, "### `[light_mesh.indirect]`");
    // The indirect part documents a `tolerance` of its own.
    points.retain(|key| {
        !["estimator", "shadows", "resolve", "tolerance", "levels", "indirect"].contains(&key.as_str())
    });
    indirect.extend(points);
    assert_eq!(accepted_keys("[light_mesh.indirect]"), indirect);
    let mut top = documented_keys(&text, "## Top-level keys");
    top.extend(
        [
            "camera",
            "animation",
            "render",
            "geometry",
            "material",
            "light",
            "light_box",
            "light_grid",
            "light_mesh",
        ]
        .map(str::to_owned),
    );
    assert_eq!(accepted_keys(""), top);
}

/// Every mistake is told with its line and the path of its key.
#[test]
fn mistakes_name_file_line_and_key() {
    for (text, expected) in [
        (
            "\n[camera]\nposition = [0, 2, 5]\nlook_at = [0, 1, 0]\nvertical_fov = 190",
            "5: camera.vertical_fov: must lie in (0, 180), found 190",
        ),
        ("[camera]\nposition = [0, 2, nan]\nlook_at = [0, 1, 0]", "2: camera.position: must be a finite"),
        (
            "[camera]\nposition = [0, 2]\nlook_at = [0, 1, 0]",
            "2: camera.position: must have three numbers, found 2",
        ),
        (
            "[camera]\nposition = [0, 1, 0]\nlook_at = [0, 1, 0]",
            "1: camera.look_at: must differ from position",
        ),
        ("[camera]\nposition = [0, 5, 0]\nlook_at = [0, 1, 0]", "1: camera.up: must not be parallel"),
        ("[camera]\nposition = [0, 5, 0]", "1: camera.look_at: is required"),
        ("background = -1", "1: background: must not be negative"),
        ("background = 1e39", "1: background: must be a finite"),
        ("colour = 1", "1: colour: unknown key, expected one of"),
        ("bakground = 1", "1: bakground: unknown key, did you mean `background`?"),
        ("[light_mesh]\nradous = 1", "2: light_mesh.radous: unknown key, did you mean `radius`?"),
        (
            "[light_mesh]\nleaks = \"visibilty\"",
            "2: light_mesh.leaks: unknown name `visibilty` (did you mean `visibility`?)",
        ),
        ("falloff = \"cubic\"", "1: falloff: unknown name `cubic`"),
        ("falloff = \"none\"\nfalloff_constant = 2", "2: falloff_constant: needs falloff"),
        ("[render]\nspp = 0", "2: render.spp: must lie in [1, 65536], found 0"),
        ("[render]\nspp = \"four\"", "2: render.spp: invalid type"),
        ("[render]\nsteps = 9", "2: render.steps: must lie in [1, 8], found 9"),
        ("[render]\nsteps = \"many\"", "2: render.steps: invalid type: string"),
        (
            "[[render.steps]]\nspacing = 1\n[[render.steps]]\nspacing = 0",
            "4: render.steps[1].spacing: must be greater than 0",
        ),
        ("[[render.steps]]\nradius = -1", "2: render.steps[0].radius: must be greater than 0"),
        ("[[render.steps]]\nspaicng = 1", "2: render.steps[0].spaicng: unknown key, did you mean `spacing`?"),
        (
            "[render]\nsteps = [{}, {}, {}, {}, {}, {}, {}, {}]",
            "2: render.steps: must make at most 8 pictures with the last, found 9",
        ),
        ("[render]\nresolution = [60000, 60000]", "2: render.resolution: 60000 × 60000 is more than"),
        ("[render]\nweight_threshold = 2", "2: render.weight_threshold: must lie in [0, 1], found 2"),
        (
            "[[light]]\nposition = [0, 0, 0]\nintensity = 1\n[[light]]\nposition = [0, 0, 0]\nintensity = [1, -1, 1]",
            "6: light[1].intensity: must not be negative",
        ),
        ("[[light]]\nposition = [0, 0, 0]", "1: light[0].intensity: is required"),
        (
            "[[light]]\nintensity = 1\ndirection = [0, 1, 0]\nradius = 1",
            "1: light[0]: radius needs a position",
        ),
        (
            "[[light]]\nintensity = 1\nposition = [0, 1, 0]\nradius = 0",
            "4: light[0].radius: must be greater than 0",
        ),
        ("[[light]]\nintensity = 1\nposition = [0, 1, 0]\nradius = 1e-30", "1: light[0]: the radiance"),
        ("[[light]]\nintensity = 1\nposition = [0, 1, 0]\nsize = [1, 1]", "1: light[0]: size needs"),
        (
            "[[light]]\nintensity = 1\nposition = [0, 1, 0]\nvisible = true",
            "1: light[0]: visible needs a radius",
        ),
        (
            "[[light_box]]\nmin = [0, 2, 0]\nmax = [1, 1, 1]\ncount = 3\nintensity = 1",
            "1: light_box[0]: min must not exceed max",
        ),
        ("[[light_box]]\nmin = [0, 0, 0]\nmax = [1, 1, 1]\ncount = 3", "1: light_box[0]: exactly one of"),
        (
            "[[light_grid]]\nmin = [0, 0, 0]\nmax = [1, 1, 1]\ncounts = [1000, 1000, 1000]\nintensity = 1",
            "1: light_grid[0]: counts make more than",
        ),
        ("[light_mesh]\nspacing = 0", "2: light_mesh.spacing: must be greater than 0"),
        (
            "[light_mesh]\nradius = 1\nradius_in_spacings = 2",
            "2: light_mesh.radius: radius and radius_in_spacings exclude",
        ),
        ("[light_mesh]\ntolerance = -0.01", "2: light_mesh.tolerance: must not be negative, found -0.01"),
        ("[light_mesh]\ntolerance = nan", "2: light_mesh.tolerance: must be a finite"),
        (
            "[light_mesh]\nresolve = \"trace\"\nshadows = \"sharp\"",
            "3: light_mesh.shadows: shadows and resolve exclude each other",
        ),
        ("[light_mesh]\nshadows = \"hard\"", "2: light_mesh.shadows: unknown name `hard`"),
        ("[light_mesh]\nlayout_seed = 1", "2: light_mesh.layout_seed: needs layout"),
        ("[light_mesh]\npoints_file = \"none.csv\"", "2: light_mesh.points_file: cannot read"),
        ("[light_mesh.indirect]\nbounces = 0", "2: light_mesh.indirect.bounces: must lie in"),
        (
            "[[light_mesh.region]]\nmin = [0, 0, 0]\nmax = [1, 0, 1]\nradius = 1",
            "1: light_mesh.region[0]: min must be less",
        ),
        ("[[geometry]]\nfile = \"none.obj\"", "2: geometry[0].file: cannot read"),
        ("[[geometry]]\nfile = \".\"", "2: geometry[0].file: cannot read"),
        ("[[geometry]]\nfile = \"model.obj\"\nscale = [1, 0, 1]", "3: geometry[0].scale: must not be 0"),
        (
            "[[geometry]]\nfile = \"model.obj\"\nmatrix = [[1, 0, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0]]",
            "3: geometry[0].matrix: flattens space",
        ),
        (
            "[[geometry]]\nfile = \"model.obj\"\nrotate = { axis = [0, 0, 0], degrees = 3 }",
            "3: geometry[0].rotate.axis: must not be the zero",
        ),
        ("[[material]]\nname = \"lead\"", "1: material[0].name: no triangle has a material 'lead'"),
        ("[[material]]\nobject = \"lead\"", "1: material[0].object: there is no object or group 'lead'"),
        ("[[material]]\nname = \"leaf\"\ndiffuse = 1.5", "3: material[0].diffuse: must lie in [0, 1]"),
        ("[render\nspp = 1", "1: "),
    ] {
        assert_message(text, expected);
    }
}

/// A text's error has a message in one line that begins with what is expected.
fn assert_message(text: &str, expected: &str) {
    let found = message(text);
    assert!(found.starts_with(&format!("scene.toml:{expected}")), "{text}\ngives {found}\nnot   {expected}");
    assert!(!found.contains('\n'), "more than one line: {found}");
}

#[test]
fn a_scene_without_camera_or_geometry_says_so() {
    let folder = folder();
    for (text, key) in [(CAMERA, "geometry"), (GEOMETRY, "camera")] {
        let error = load_in(&folder, text).err().expect("incomplete").to_string();
        assert!(error.contains(&format!("{key}: is ")), "{error}");
    }
    // It is no key of what the file begins with.
    let error =
        load_in(&folder, &format!("preset = \"physical\"\n{CAMERA}")).err().expect("incomplete").to_string();
    assert!(error.contains(":1: geometry: is "), "{error}");
}

#[test]
fn a_scene_file_that_is_no_text_is_an_error() {
    let folder = folder();
    let path = folder.path().join("scene.toml");
    fs::write(&path, b"\n# \xff\n").expect("writable");
    assert!(
        load_scene_file(&path)
            .err()
            .expect("not UTF-8")
            .to_string()
            .ends_with("scene.toml:2: is not UTF-8 text")
    );
    let directory = load_scene_file(folder.path()).err().expect("a directory").to_string();
    assert!(directory.contains("cannot be read"), "{directory}");
    assert!(load_scene_file(&folder.path().join("none.toml")).is_err());
}

/// Two ways to say one thing are one setting; the preset's stays where neither is given.
#[test]
fn shadows_are_what_resolve_says_in_other_words() {
    for (shadows, resolve) in [("soft", "average"), ("sharp", "trace")] {
        let [a, b] = [format!("shadows = \"{shadows}\""), format!("resolve = \"{resolve}\"")]
            .map(|key| loaded(&format!("preset = \"physical\"\n[light_mesh]\n{key}\n")).settings);
        assert_eq!(a, b, "{shadows}");
        assert_eq!(a.shading.resolve.name(), resolve);
    }
    assert_eq!(loaded("preset = \"physical\"").settings.shading.resolve, Resolve::Trace);
}

/// A number of steps, tables and a list of tables all reach the renderer; what a table leaves out is left to the settings.
#[test]
fn steps_are_a_number_or_a_list() {
    let steps = |text: &str| loaded(text).settings.limits.steps;
    assert_eq!(steps(""), Steps::Count(1));
    assert_eq!(steps("[render]\nsteps = 8"), Steps::Count(8));
    assert_eq!(steps("[render]\nsteps = []").pictures(), 1);
    let listed = Steps::List(vec![
        Step {
            spacing: Some(Vec3::new(4.0, 2.0, 4.0)),
            neighbourhood: Some(Neighbourhood::Nearest),
            radius: None,
        },
        Step { radius: Some(3.0), ..Step::default() },
    ]);
    assert_eq!(listed.pictures(), 3);
    let tables =
        "[[render.steps]]\nspacing = [4, 2, 4]\nneighbourhood = \"nearest\"\n[[render.steps]]\nradius = 3\n";
    let list = "[render]\nsteps = [{ spacing = [4, 2, 4], neighbourhood = \"nearest\" }, { radius = 3 }]";
    assert_eq!((steps(tables), steps(list)), (listed.clone(), listed));
}

#[test]
fn every_setting_reaches_the_renderer() {
    let scene = loaded(
        "\
background = [1, 2, 3]
falloff_constant = 0.5
[render]
integrator = \"conventional\"
resolution = [60, 40]
spp = 4
max_depth = 3
weight_threshold = 0.25
exposure = -1.5
[light_mesh]
estimator = \"ratio\"
resolve = \"trace\"
tolerance = 0.25
layout = \"jittered\"
layout_seed = 9
spacing = [1, 2, 3]
radius = 4
neighbourhood = \"nearest\"
hemisphere = false
leaks = \"allow\"
[[light_mesh.region]]
min = [0, 0, 0]
max = [1, 1, 1]
spacing = 0.5
[light_mesh.indirect]
directions = 64
emitter_samples = 0
at_surface = true
bounces = 2
tolerance = 0.125
form = \"scalar\"
normalization = \"integral\"
spacing = \"auto\"
radius_in_spacings = 3
layout = \"body-centred\"
",
    );
    assert_eq!(scene.scene.background, Vec3::new(1.0, 2.0, 3.0));
    assert_eq!(scene.scene.falloff, Falloff::Linear { constant: 0.5 });
    let settings = scene.settings;
    assert_eq!(settings.shading.integrator, Integrator::Conventional);
    assert_eq!(
        (settings.view.resolution, settings.view.samples_per_pixel, settings.view.max_depth),
        ((60, 40), 4, 3)
    );
    assert_eq!((settings.view.weight_threshold, settings.output.exposure), (0.25, -1.5));
    let (mesh, shading) = (settings.mesh, settings.shading);
    let (kernel, indirect_kernel) = (&shading.kernel, &shading.indirect.kernel);
    assert_eq!((shading.estimator, shading.resolve), (Estimator::Ratio, Resolve::Trace));
    assert_eq!(shading.tolerance, 0.25);
    assert_eq!(mesh.direct.layout, PointLayout::Jittered { seed: 9 });
    assert_eq!(mesh.direct.spacing, Spacing::Units(Vec3::new(1.0, 2.0, 3.0)));
    assert_eq!((kernel.radius, kernel.neighbourhood), (Radius::Units(4.0), Neighbourhood::Nearest));
    assert_eq!((kernel.hemisphere, kernel.leaks), (false, Leaks::Allow));
    assert_eq!(mesh.direct.regions.len(), 1);
    assert_eq!(mesh.direct.regions[0].spacing, Some(Vec3::splat(0.5)));
    let indirect = mesh.indirect.expect("its table is there");
    assert_eq!((indirect.emitter_samples, shading.indirect.at_surface), (0, true));
    assert_eq!((indirect.directions, indirect.bounces, indirect.tolerance), (64, 2, 0.125));
    assert_eq!(
        (indirect.form, shading.indirect.normalization),
        (IndirectForm::Scalar, Normalization::Integral)
    );
    assert_eq!(indirect.points.layout, PointLayout::BodyCentred);
    assert_eq!((indirect.points.spacing, indirect_kernel.radius), (Spacing::Auto, Radius::Spacings(3.0)));
    assert_eq!((indirect_kernel.hemisphere, indirect.points.regions.len()), (false, 1), "as the direct mesh");
}

#[test]
fn the_physical_preset_changes_defaults_only() {
    let scene = loaded("preset = \"physical\"\n[light_mesh]\nestimator = \"directional\"");
    assert_eq!(scene.scene.falloff, Falloff::InverseSquare);
    assert!(scene.settings.shading.lambertian && scene.settings.mesh.indirect.is_some());
    assert_eq!(scene.settings.shading.estimator, Estimator::Directional);
    assert_eq!(loaded("preset = \"physical\"\nfalloff = \"none\"").scene.falloff, Falloff::None);
}
