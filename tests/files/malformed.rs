//! Malformed models end in one clear error that names file and line, or are rendered with what is wrong counted;
//! never in a panic.

use std::fs;
use std::path::{Path, PathBuf};

use lightmesh::sampling::SplitMix64;
use lightmesh::scene::load::obj::{ChunkSizes, read_obj};
use lightmesh::scene::load::{LoadError, Model, load_model, load_scene_file};

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

fn read(text: &[u8]) -> Result<Model, LoadError> {
    read_obj(text, Path::new("model.obj"), ChunkSizes { block: 64, chunk: 16 })
}

#[test]
fn broken_lines_are_errors_that_name_them() {
    for (line, expected) in [
        ("v 1 2", "3 numbers expected, found 2"),
        ("v", "3 numbers expected, found 0"),
        ("v nan 0 0", "not a finite"),
        ("v 0 -inf 0", "not a finite"),
        ("v 0 0 1e39", "not a finite"),
        ("v 1.#IND 0 0", "'1.#IND' is not a number"),
        ("v 1 2 x", "'x' is not a number"),
        ("vn 1 0", "3 numbers expected, found 2"),
        ("vt", "1 numbers expected, found 0"),
        ("f 1 2 0", "index 0"),
        ("f 1 2 4", "out of range: there are 3 vertices"),
        ("f 1 2 -4", "out of range: there are 3 vertices"),
        ("f 1 2 99999999999999999999", "out of range"),
        ("f 1 2 -99999999999999999999", "out of range"),
        ("f 1 2 2147483647", "out of range"),
        ("f 1 2 3.5", "'3.5' is not a corner"),
        ("f 1 2 3/1/1/1", "'3/1/1/1' is not a corner"),
        ("f 1 2 /3", "'/3' is not a corner"),
        ("f 1 2 -", "'-' is not a corner"),
        ("f a b c", "'a' is not a corner"),
    ] {
        let text = format!("{TRIANGLE}f 1 2 3\n{line}\n");
        let error = read(text.as_bytes()).err().unwrap_or_else(|| panic!("{line} loads")).to_string();
        assert!(error.starts_with("model.obj:5: ") && error.contains(expected), "{line}: {error}");
    }
}

#[test]
fn files_without_triangles_are_errors_that_count_what_they_have() {
    for (text, told) in [
        ("", "model.obj: holds no triangles"),
        (TRIANGLE, "model.obj: holds no triangles"),
        ("v 0 0 0\nl 1 1\np 1\n", "(skipped: 1 line elements, 1 point elements)"),
        ("v 0 0 0\nv 1 0 0\nf 1 2\n", "1 faces with fewer than three corners"),
        ("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", "1 triangles of zero area"),
        ("\0\x01\x02 binary", "holds no triangles"),
    ] {
        let error = read(text.as_bytes()).err().unwrap_or_else(|| panic!("{text} loads")).to_string();
        assert!(error.contains(told) && !error.contains('\n'), "{error}");
    }
}

#[test]
fn what_is_left_out_is_counted() {
    let text = format!(
        "{TRIANGLE}vn nan 0 0\nvt inf 0\nf 1/1/1 2/1/1 3/1/1\nf 1 1 2\nf 1 2\nl 1 2\np 1\ncurv 0 1\nf 1//7 2//7 3//7\nwhatever\n"
    );
    let model = read(text.as_bytes()).expect("has triangles");
    let skipped = model.skipped;
    assert_eq!(model.meshes[0].triangles.len(), 2);
    assert_eq!((skipped.bad_normals, skipped.bad_uvs, skipped.zero_area_triangles), (1, 1, 1));
    assert_eq!((skipped.short_faces, skipped.lines, skipped.points, skipped.free_form), (1, 1, 1, 1));
    let lines: Vec<Option<usize>> = model.warnings.iter().map(|warning| warning.line).collect();
    for line in [8, 12, 13] {
        assert!(
            lines.contains(&Some(line)),
            "short face, normal index, unknown statement: {:?}",
            model.warnings
        );
    }
    assert!(model.meshes[0].normals.is_none(), "no normal has a direction");
}

#[test]
fn broken_materials_are_errors_that_name_their_line() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let obj = folder.path().join("model.obj");
    fs::write(&obj, format!("mtllib model.mtl\n{TRIANGLE}f 1 2 3\n")).expect("writable");
    for line in ["Kd x 0 0", "Kd nan 0 0", "Kd -1 0 0", "Ke 1 2", "Ks"] {
        fs::write(folder.path().join("model.mtl"), format!("newmtl a\n{line}\n")).expect("writable");
        let error = load_model(&obj).err().unwrap_or_else(|| panic!("{line} loads")).to_string();
        assert!(error.contains("model.mtl:2: "), "{line}: {error}");
    }
}

#[test]
fn files_that_cannot_be_read_are_errors_that_name_them() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let directory = folder.path().join("folder.obj");
    fs::create_dir(&directory).expect("writable");
    for (path, told) in [
        (directory, "folder.obj: cannot be read: "),
        (folder.path().join("none.obj"), "none.obj: cannot be read: no such file"),
        (folder.path().join("model.xyz"), "model.xyz: not a known model format"),
    ] {
        let error = load_model(&path).err().expect("unreadable").to_string();
        assert!(error.contains(told) && !error.contains("os error"), "{error}");
    }
}

/// A model's error keeps the model's own file and line when a scene file names it.
#[test]
fn a_broken_model_is_named_through_the_scene_file() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::write(folder.path().join("model.obj"), "v 0 0 nan\n").expect("writable");
    let scene = folder.path().join("scene.toml");
    fs::write(
        &scene,
        "[camera]\nposition = [0, 0, 1]\nlook_at = [0, 0, 0]\n[[geometry]]\nfile = \"model.obj\"\n",
    )
    .expect("writable");
    let error = load_scene_file(&scene).err().expect("malformed").to_string();
    assert!(error.contains("model.obj:1: "), "{error}");
}

/// Bytes changed at random in a valid file: whatever comes out, it is no panic, and what loads is in range.
#[test]
fn damaged_files_never_panic() {
    let valid = format!(
        "mtllib a.mtl\no a\n{TRIANGLE}v 1 1 0.5 1 0 0\nvn 0 0 1\nvt 0 1\nusemtl m\nf 1/1/1 2/1/1 4/1/1 3/1/1\nf -1 -2 -3\n"
    );
    let mut random = SplitMix64::new(3);
    let replacements = b"0123456789-+./ \n\r#\\eEvfnt\0\xff";
    for _ in 0..20_000 {
        let mut text = valid.clone().into_bytes();
        for _ in 0..1 + random.next() % 6 {
            let at = (random.next() % text.len() as u64) as usize;
            text[at] = replacements[(random.next() % replacements.len() as u64) as usize];
        }
        if let Ok(model) = read(&text) {
            let mesh = &model.meshes[0];
            let vertices = mesh.positions.as_slice().len();
            assert!(mesh.triangles.iter().flatten().all(|&vertex| (vertex as usize) < vertices));
            assert!(mesh.positions.as_slice().iter().flatten().all(|x| x.is_finite()));
            assert!(mesh.normals.iter().flatten().flatten().all(|x| x.is_finite()));
            let materials = model.materials.len() as u32;
            assert!((0..mesh.triangles.len() as u32).all(|triangle| mesh.materials.of(triangle) < materials));
        } else {
            let error = read(&text).err().expect("as before").to_string();
            assert!(error.starts_with("model.obj:") && !error.contains('\n'), "{error}");
        }
    }
}

/// Walks the models of the folder that `LIGHTMESH_MODELS` names.
#[test]
fn models_of_others_load_or_end_in_one_line() {
    let Some(folder) = std::env::var_os("LIGHTMESH_MODELS") else {
        println!("skipped: LIGHTMESH_MODELS names no folder of models");
        return;
    };
    let mut folders = vec![PathBuf::from(folder)];
    let mut files = 0;
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).expect("a readable folder").flatten() {
            let path = entry.path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "obj") {
                files += 1;
                match load_model(&path) {
                    Ok(model) => assert!(!model.meshes[0].triangles.is_empty(), "{}", path.display()),
                    Err(error) => assert!(!error.to_string().contains('\n'), "{error}"),
                }
            }
        }
    }
    assert!(files > 0, "no .obj files there");
}
