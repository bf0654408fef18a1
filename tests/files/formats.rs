//! A picture does not depend on the format that its model came in.

use std::fs;

use glam::Vec3;
use lightmesh::accel::{Backend, BackendChoice};
use lightmesh::framing::choose_view;
use lightmesh::image::Image;
use lightmesh::render::render;
use lightmesh::sampling::SplitMix64;
use lightmesh::scene::load::open_scene;

use crate::common::failed::assert_same_bits;
use crate::common::soup::Soup;

/// Hilly ground with two hundred random triangles above it; coordinates with all the digits that single precision has.
fn model() -> Soup {
    const SIDE: u32 = 12;
    let mut random = SplitMix64::new(5);
    let mut soup = Soup { positions: Vec::new(), triangles: Vec::new() };
    for (z, x) in (0..SIDE).flat_map(|z| (0..SIDE).map(move |x| (z, x))) {
        soup.positions.push([x as f32 / 3.0, 0.3 * random.unit(), z as f32 / 3.0]);
        if x > 0 && z > 0 {
            let here = z * SIDE + x;
            soup.triangles.push([here - SIDE - 1, here - 1, here]);
            soup.triangles.push([here - SIDE - 1, here, here - SIDE]);
        }
    }
    for _ in 0..200 {
        let first = soup.positions.len() as u32;
        let at = random.in_box(Vec3::new(0.0, 0.5, 0.0), Vec3::new(3.6, 2.0, 3.6));
        for _ in 0..3 {
            soup.positions.push((at + random.in_box(Vec3::splat(-0.2), Vec3::splat(0.2))).to_array());
        }
        soup.triangles.push([first, first + 1, first + 2]);
    }
    soup
}

/// The same vertices and triangles make the same scene, whatever file they come from: the same camera and lights are
/// chosen for it, and every pixel is the same to the last bit.
#[test]
fn obj_ply_and_gltf_give_the_same_picture() {
    let soup = model();
    let folder = tempfile::tempdir().unwrap();
    let picture = |name: &str, content: &[u8]| -> Image {
        let file = folder.path().join(name);
        fs::write(&file, content).unwrap();
        let mut opened = open_scene(&file).unwrap();
        opened.loaded.settings.view.resolution = (120, 90);
        let backend = Backend::build(BackendChoice::Auto, &opened.loaded.scene).unwrap().backend;
        let loaded = choose_view(&opened, &backend).complete(opened).loaded;
        render(&backend, &loaded.scene, &loaded.cameras[0], &loaded.settings).unwrap().0
    };
    let obj = picture("model.obj", soup.obj().as_bytes());
    let lit = obj.pixels().iter().filter(|pixel| pixel[0] > 0.0).count();
    assert!(lit * 10 > obj.pixels().len(), "{lit} of {} pixels show something", obj.pixels().len());
    for (name, content) in [
        ("ascii.ply", soup.ply("ascii")),
        ("little.ply", soup.ply("binary_little_endian")),
        ("big.ply", soup.ply("binary_big_endian")),
        ("model.gltf", soup.gltf().into_bytes()),
    ] {
        assert_same_bits(&picture(name, &content), &obj, format_args!("{name} differs from model.obj"));
    }
}
