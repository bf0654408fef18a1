//! Generated scenes have exactly what was asked for, load without a warning, and are the same every time.

use std::fs;
use std::path::Path;

use lightmesh::scene::generate::GenerateError;
use lightmesh::scene::generate::forest::Forest;
use lightmesh::scene::load::load_scene_file;

const FILES: [&str; 3] = ["forest.mtl", "forest.obj", "forest.toml"];

#[test]
fn forests_have_exactly_the_triangles_and_lights_asked_for() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (triangles, lights) in
        [(64, 1), (65, 2), (999, 3), (2_299, 10), (2_300, 10), (23_542, 100), (60_001, 1_000)]
    {
        Forest { triangles, lights, seed: triangles }.write(folder.path()).expect("writable");
        let loaded = load_scene_file(&folder.path().join("forest.toml")).expect("well formed");
        let count: usize = loaded.scene.meshes.iter().map(|mesh| mesh.triangles.len()).sum();
        assert_eq!(count, triangles as usize);
        assert_eq!(loaded.scene.lights.len(), lights as usize);
        assert!(loaded.warnings.is_empty() && loaded.skipped.is_empty(), "{:?}", loaded.warnings);
        assert_eq!(loaded.settings.view.resolution, (600, 600));
    }
}

/// "Just above the trees": higher than all of them, by less than a crown's height.
#[test]
fn forest_lights_hang_just_above_the_trees() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    Forest { triangles: 100_000, lights: 500, seed: 2 }.write(folder.path()).expect("writable");
    let scene = load_scene_file(&folder.path().join("forest.toml")).expect("well formed").scene;
    let top = scene.meshes[0].positions.as_slice().iter().map(|p| p[1]).fold(f32::MIN, f32::max);
    for light in &scene.lights {
        assert!(light.position.y > top && light.position.y < top + 3.0, "{} over {top}", light.position.y);
    }
}

#[test]
fn the_committed_forest_is_what_the_generator_writes() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    Forest { triangles: 23_542, lights: 100, seed: 1 }.write(folder.path()).expect("writable");
    let committed = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/forest");
    for name in FILES {
        let read = |folder: &Path| fs::read(folder.join(name)).expect("readable");
        assert!(read(folder.path()) == read(&committed), "{name} differs");
    }
    let three = committed.with_file_name("forest-three-lights").join("forest-three-lights.toml");
    let three = load_scene_file(&three).expect("well formed").scene;
    assert_eq!((three.lights.len(), three.meshes[0].triangles.len()), (3, 23_542));
}

#[test]
fn nothing_is_left_behind_after_an_error() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let parameters = Forest { triangles: 500, lights: 3, seed: 0 };
    // A directory in the place of a file that is to be written.
    fs::create_dir(folder.path().join("forest.toml")).expect("writable");
    let error = parameters.write(folder.path()).expect_err("a directory is in the way");
    assert!(error.to_string().contains("forest.toml: cannot be written"), "{error}");
    let names: Vec<_> =
        fs::read_dir(folder.path()).expect("readable").flatten().map(|e| e.file_name()).collect();
    assert_eq!(names, ["forest.toml"]);
    let file = folder.path().join("file");
    fs::write(&file, "").expect("writable");
    assert!(matches!(parameters.write(&file), Err(GenerateError::Write { .. })));
    let out_of_range = Forest { triangles: 3, ..parameters }.write(folder.path());
    assert!(matches!(out_of_range, Err(GenerateError::OutOfRange { name: "triangles", .. })));
}
