//! An OBJ model becomes the triangles, normals and materials that its file states.

use std::fs;
use std::path::Path;

use glam::Vec3;
use lightmesh::sampling::SplitMix64;
use lightmesh::scene::load::obj::{ChunkSizes, load_obj, read_obj};
use lightmesh::scene::load::{LoadError, Model};
use lightmesh::scene::{TriangleMaterials, TriangleMesh};

fn try_read(text: impl AsRef<[u8]>) -> Result<Model, LoadError> {
    read_obj(text.as_ref(), Path::new("model.obj"), ChunkSizes::default())
}

fn read(text: impl AsRef<[u8]>) -> Model {
    try_read(text).unwrap_or_else(|error| panic!("{error}"))
}

/// Twice the area vectors' sum, and twice the sum of the areas.
fn areas(mesh: &TriangleMesh) -> (Vec3, f32) {
    (0..mesh.triangles.len() as u32).fold((Vec3::ZERO, 0.0), |(vector, sum), triangle| {
        let [a, b, c] = mesh.corners(triangle);
        let area = (b - a).cross(c - a);
        (vector + area, sum + area.length())
    })
}

/// Triangles of a flat polygon that cover it exactly have its signed area, and as much unsigned: no
/// triangle sticks out of it, overlaps another, or is wound the other way.
fn assert_covers(outline: &[[f32; 2]], name: &str) {
    let signed: f32 = (0..outline.len())
        .map(|i| {
            let ([ax, ay], [bx, by]) = (outline[i], outline[(i + 1) % outline.len()]);
            ax * by - ay * bx
        })
        .sum();
    for turn in 0..outline.len() {
        // In a tilted plane, y up to x + y.
        let mut text = String::new();
        for [x, y] in outline.iter().cycle().skip(turn).take(outline.len()) {
            text.push_str(&format!("v {x} {y} {}\n", x + y));
        }
        let corners: Vec<String> = (1..=outline.len()).map(|i| i.to_string()).collect();
        text.push_str(&format!("f {}\n", corners.join(" ")));
        let model = read(&text);
        let (vector, sum) = areas(&model.meshes[0]);
        assert!((vector.z - signed).abs() < 1e-4, "{name} from corner {turn}: {} for {signed}", vector.z);
        assert!((vector.length() - sum).abs() < 1e-4, "{name} from corner {turn}: triangles overlap");
    }
}

#[test]
fn polygons_are_covered_exactly() {
    assert_covers(&[[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]], "rectangle");
    assert_covers(&[[0.0, 0.0], [3.0, 0.0], [0.5, 0.5], [0.0, 3.0]], "dart");
    assert_covers(&[[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]], "L");
    assert_covers(
        &[[0.0, 0.0], [5.0, 0.0], [5.0, 4.0], [4.0, 4.0], [4.0, 1.0], [1.0, 1.0], [1.0, 4.0], [0.0, 4.0]],
        "U",
    );
    let star: Vec<[f32; 2]> = (0..14)
        .map(|i| {
            let (angle, radius) =
                (i as f32 * std::f32::consts::TAU / 14.0, if i % 2 == 0 { 2.0 } else { 0.6 });
            [angle.cos() * radius, angle.sin() * radius]
        })
        .collect();
    assert_covers(&star, "star");
    let clockwise: Vec<[f32; 2]> = star.into_iter().rev().collect();
    assert_covers(&clockwise, "star, clockwise");
}

#[test]
fn negative_indices_count_backwards_from_their_line() {
    let model = read("v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 0 0 1\nf -1 -4 -3\n");
    let mesh = &model.meshes[0];
    assert_eq!(mesh.corners(0), [Vec3::ZERO, Vec3::X, Vec3::Y]);
    assert_eq!(mesh.corners(1), [Vec3::Z, Vec3::ZERO, Vec3::X]);
}

/// Random text with everything that makes chunks depend on those before them.
fn random_text() -> String {
    let mut random = SplitMix64::new(5);
    let mut text = String::from("v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nvt 0 0\n");
    let (mut vertices, mut normals) = (3, 1);
    for _ in 0..4_000 {
        match random.next() % 9 {
            0..4 => {
                let p = random.in_box(Vec3::NEG_ONE, Vec3::ONE);
                text.push_str(&format!("v {} {} {}\r\n", p.x, p.y, p.z));
                vertices += 1;
            }
            4 => {
                let n = random.in_box(Vec3::NEG_ONE, Vec3::ONE);
                text.push_str(&format!("vn {} {} {}\n", n.x, n.y, n.z));
                normals += 1;
            }
            5 => text.push_str(&format!("usemtl m{}\n", random.next() % 5)),
            6 => text.push_str(&format!("o part{}\n# a remark\n\nl 1 2\n", random.next() % 50)),
            7 => {
                let v = random.next() % vertices + 1;
                let n = random.next() % normals + 1;
                text.push_str(&format!("f {v}//{n} \\\n -1//-1 1//{n} -2/1\n"));
            }
            _ => text.push_str(&format!("f -1 -2 -3 {}\n", random.next() % vertices + 1)),
        }
    }
    text
}

#[test]
fn the_model_does_not_depend_on_how_the_file_is_cut() {
    let text = random_text();
    let read = |block, chunk| {
        read_obj(text.as_bytes(), Path::new("model.obj"), ChunkSizes { block, chunk }).expect("well formed")
    };
    let whole = read(usize::MAX >> 1, usize::MAX >> 1);
    assert!(whole.meshes[0].triangles.len() > 500 && whole.parts.len() > 100);
    for (block, chunk) in [(1, 1), (7, 3), (100, 10), (1_000, 64), (10_000, 999), (1 << 20, 1 << 10)] {
        let cut = read(block, chunk);
        let (a, b) = (&whole.meshes[0], &cut.meshes[0]);
        let bits =
            |list: &[[f32; 3]]| -> Vec<[u32; 3]> { list.iter().map(|v| v.map(f32::to_bits)).collect() };
        assert_eq!(bits(a.positions.as_slice()), bits(b.positions.as_slice()), "{block}/{chunk}");
        assert_eq!(a.normals.as_deref().map(bits), b.normals.as_deref().map(bits));
        assert_eq!((&a.triangles, &a.materials, &a.uvs), (&b.triangles, &b.materials, &b.uvs));
        assert_eq!((&whole.parts, whole.skipped, &whole.warnings), (&cut.parts, cut.skipped, &cut.warnings));
        assert_eq!(whole.materials, cut.materials);
    }
}

#[test]
fn errors_name_the_same_line_however_the_file_is_cut() {
    let good = "v 0 0 0 # a remark\n".repeat(500);
    for bad in ["v 1 2 nan", "v 1 x 2", "f 1 2 0", "f 1 2 3/a", "f 1 2 9000"] {
        let text = format!("{good}{bad}\n{good}");
        for (block, chunk) in [(1 << 20, 1 << 20), (200, 20), (64, 64)] {
            let sizes = ChunkSizes { block, chunk };
            let error = read_obj(text.as_bytes(), Path::new("model.obj"), sizes).err().expect("malformed");
            assert!(error.to_string().starts_with("model.obj:501: "), "{error}");
        }
    }
}

#[test]
fn normals_are_unit_length_and_missing_ones_are_the_faces_own() {
    let model = read(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 3 4\nvn 0 0 0\nvn 1e-30 0 0\n\
         f 1//1 2//1 3//1\nf 1//1 2//2 3\nf 1//3 2//3 3//3\n",
    );
    let mesh = &model.meshes[0];
    let normals = mesh.normals.as_ref().expect("given");
    let of = |triangle: usize| mesh.triangles[triangle].map(|vertex| normals[vertex as usize]);
    assert_eq!(of(0), [[0.0, 0.6, 0.8]; 3]);
    assert_eq!(of(1), [[0.0, 0.6, 0.8], [0.0, 0.0, 1.0], [0.0, 0.0, 1.0]]);
    assert_eq!(of(2), [[1.0, 0.0, 0.0]; 3], "short, but it has a direction");
    assert_eq!(model.skipped.bad_normals, 1);
}

#[test]
fn vertices_are_shared_where_all_their_attributes_agree() {
    let model = read(
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 9 9 9\nvt 0 0\nvt 1 1\nvt 0 0\n\
         f 1/1 2/1 3/1\nf 1/3 3/1 4/1\nf 1/2 3/1 4/1\n",
    );
    let mesh = &model.meshes[0];
    assert_eq!(mesh.positions.as_slice().len(), 5, "four corners, one of them twice; the fifth is not used");
    assert_eq!(mesh.uvs.as_ref().map(Vec::len), Some(5));
    assert_eq!(mesh.triangles[0][0], mesh.triangles[1][0]);
    assert_ne!(mesh.triangles[0][0], mesh.triangles[2][0]);
}

#[test]
fn numbers_are_read_in_all_their_forms() {
    let model = read("v .5 -.25e+001 +3\nv 1. 0e-5 1E2 0.5\n\tv  0\t1 0 # remark\r\nf 1 2 3");
    let [a, b, c] = model.meshes[0].corners(0);
    assert_eq!((a, b, c), (Vec3::new(0.5, -2.5, 3.0), Vec3::new(1.0, 0.0, 100.0), Vec3::Y));
    let old_mac = read("v 0 0 0\rv 1 0 0\rv 0 1 0\rf 1 2 3\r");
    assert_eq!(old_mac.meshes[0].triangles.len(), 1);
    let marked = read("\u{feff}v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    assert_eq!(marked.meshes[0].triangles.len(), 1);
}

/// sRGB 0.5 is 0.21404 in linear light (IEC 61966-2-1).
#[test]
fn vertex_colors_are_srgb() {
    let model = read("v 0 0 0 1 0.5 0\nv 1 0 0\nv 0 1 0 0 0 0\nf 1 2 3\n");
    let colors = model.meshes[0].colors.as_ref().expect("given");
    assert!((colors[0][1] - 0.214_04).abs() < 1e-4 && colors[0][0] == 1.0);
    assert_eq!((colors[1], colors[2]), ([1.0; 3], [0.0; 3]));
}

#[test]
fn materials_come_from_all_mtl_files_even_with_spaces_and_foreign_bytes() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let write = |name: &str, text: &[u8]| fs::write(folder.path().join(name), text).expect("writable");
    write("one two.mtl", b"newmtl a b\nKd 0.1 0.2 0.3 # remark\n Ks 0.5\nKe 1 2 3\n");
    write("three.mtl", b"newmtl gr\xfcn\nKd 0 1 0\nKs 0.5 0.5 0.5\nillum 2\nnewmtl a b\nKd 1 1 1\n");
    write(
        "model.obj",
        b"mtllib one two.mtl three.mtl missing.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nusemtl  a b \nf 1 2 3\n\
          usemtl gr\xfcn\nf 1 2 3\nusemtl gr\xf6n\nf 1 2 3\n",
    );
    let model = load_obj(&folder.path().join("model.obj")).expect("well formed");
    let TriangleMaterials::PerTriangle(indices) = &model.meshes[0].materials else { panic!("several") };
    let material = |triangle: usize| &model.materials[indices[triangle] as usize];
    assert_eq!(material(0).diffuse, Vec3::splat(0.8), "before any usemtl: the default");
    assert_eq!(material(1).diffuse, Vec3::new(0.1, 0.2, 0.3), "the first definition counts");
    assert_eq!((material(1).specular, material(1).emission), (Vec3::splat(0.5), Vec3::new(1.0, 2.0, 3.0)));
    assert_eq!(
        (material(2).diffuse, material(2).specular),
        (Vec3::Y, Vec3::ZERO),
        "a highlight is no mirror"
    );
    assert_eq!(material(3).diffuse, Vec3::splat(0.8), "another name, though equal in UTF-8's eyes");
    let warnings: Vec<String> = model.warnings.iter().map(ToString::to_string).collect();
    for told in ["'missing.mtl' not found", "Ks dropped", "'grön' is not defined"] {
        assert!(warnings.iter().any(|warning| warning.contains(told)), "{told}: {warnings:?}");
    }
    assert_eq!(warnings.len(), 3);
}

#[test]
fn objects_and_groups_keep_their_triangles() {
    let model = read("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\no a\nf 1 2 3\nf 1 1 2\ng g h\nf 1 2 3 1\no b\n");
    let parts: Vec<_> =
        model.parts.iter().map(|p| (p.object.as_str(), p.group.as_str(), p.triangles.clone())).collect();
    assert_eq!(parts, [("a", "", 1..2), ("a", "g h", 2..3)]);
}
