//! Pictures on surfaces stand the right way up, whatever the format, and where they are transparent, sight and light pass.

use std::fs;
use std::path::Path;
use std::sync::Arc;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glam::Vec3;
use lightmesh::scene::load::load_model;
use lightmesh::scene::{Falloff, Scene};

use crate::common::{camera, conventional, light, settings_at};

/// Upper left red, upper right green; lower left blue, lower right nothing.
const TEXELS: [[u8; 4]; 4] = [[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255], [255, 255, 255, 0]];

fn png(texels: &[[u8; 4]; 4]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 2, 2);
    encoder.set_color(png::ColorType::Rgba);
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(texels.as_flattened()).unwrap();
    writer.finish().unwrap();
    bytes
}

/// A square with the picture, and a plain wall behind it. OBJ counts texture coordinates from below.
fn write_obj(folder: &Path) {
    let coverage = TEXELS.map(|[_, _, _, alpha]| [alpha, alpha, alpha, 255]);
    fs::write(folder.join("colors.png"), png(&TEXELS.map(|[r, g, b, _]| [r, g, b, 255]))).unwrap();
    fs::write(folder.join("coverage.png"), png(&coverage)).unwrap();
    fs::write(
        folder.join("a.mtl"),
        "newmtl picture\nKd 1 1 1\nmap_Kd colors.png\nmap_d coverage.png\nnewmtl wall\nKd 1 1 1\n",
    )
    .unwrap();
    let text = "mtllib a.mtl\nusemtl picture\nv -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
                f 1/1 2/2 3/3 4/4\nusemtl wall\nv -4 -4 -1\nv 4 -4 -1\nv 4 4 -1\nv -4 4 -1\nf 5 6 7 8\n";
    fs::write(folder.join("model.obj"), text).unwrap();
}

/// The same; glTF counts texture coordinates from above.
fn write_gltf(folder: &Path) {
    let square = |side: f32, z: f32| [-side, -side, z, side, -side, z, side, side, z, -side, side, z];
    let coordinates = [0.0f32, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0];
    let mut bytes: Vec<u8> = [&square(1.0, 0.0)[..], &square(4.0, -1.0), &coordinates]
        .into_iter()
        .flatten()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    bytes.extend([0u8, 1, 2, 0, 2, 3]);
    let uri = |kind: &str, bytes: &[u8]| format!("data:{kind};base64,{}", STANDARD.encode(bytes));
    let picture =
        serde_json::json!({ "baseColorTexture": { "index": 0 }, "roughnessFactor": 1, "metallicFactor": 0 });
    let wall = serde_json::json!({ "roughnessFactor": 1, "metallicFactor": 0 });
    let text = serde_json::json!({
        "asset": { "version": "2.0" },
        "buffers": [{ "byteLength": bytes.len(), "uri": uri("application/octet-stream", &bytes) }],
        "bufferViews": [
            { "buffer": 0, "byteLength": 48 },
            { "buffer": 0, "byteOffset": 48, "byteLength": 48 },
            { "buffer": 0, "byteOffset": 96, "byteLength": 32 },
            { "buffer": 0, "byteOffset": 128, "byteLength": 6 },
        ],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 4 },
            { "bufferView": 1, "componentType": 5126, "type": "VEC3", "count": 4 },
            { "bufferView": 2, "componentType": 5126, "type": "VEC2", "count": 4 },
            { "bufferView": 3, "componentType": 5121, "type": "SCALAR", "count": 6 },
        ],
        "images": [{ "uri": uri("image/png", &png(&TEXELS)) }],
        "textures": [{ "source": 0 }],
        "materials": [
            { "pbrMetallicRoughness": picture, "alphaMode": "MASK" },
            { "pbrMetallicRoughness": wall },
        ],
        "meshes": [{ "primitives": [
            { "attributes": { "POSITION": 0, "TEXCOORD_0": 2 }, "indices": 3, "material": 0 },
            { "attributes": { "POSITION": 1 }, "indices": 3, "material": 1 },
        ] }],
        "nodes": [{ "mesh": 0 }],
        "scenes": [{ "nodes": [0] }],
        "scene": 0,
    });
    fs::write(folder.join("model.gltf"), text.to_string()).unwrap();
}

/// Eye and lamp are in one place in front of the middle, so that what is seen is lit: the three colours where the picture
/// has them, and the wall through the transparent part.
#[test]
fn pictures_stand_upright_and_alpha_masks_let_sight_and_light_pass() {
    let folder = tempfile::tempdir().unwrap();
    write_obj(folder.path());
    write_gltf(folder.path());
    let settings = settings_at((80, 80));
    for name in ["model.obj", "model.gltf"] {
        let model = load_model(&folder.path().join(name)).unwrap();
        assert!(model.warnings.is_empty(), "{name}: {:?}", model.warnings);
        let eye = Vec3::new(0.0, 0.0, 4.0);
        let scene = Scene {
            meshes: model.meshes.into_iter().map(Arc::new).collect(),
            instances: model.instances,
            materials: model.materials,
            lights: vec![light(eye, Vec3::ONE)],
            falloff: Falloff::None,
            ..Scene::default()
        };
        // The square fills the middle half of the picture: its quarters' middles are 10 pixels from the centre.
        let camera = camera(eye, Vec3::ZERO, 2.0 * (2.0f32 / 4.0).atan().to_degrees());
        let (image, _) = conventional(&scene, &camera, &settings);
        let seen = |x: usize, y: usize| image.pixels()[y * 80 + x].map(|value| value > 0.5);
        assert_eq!(seen(30, 30), [true, false, false], "{name}: upper left");
        assert_eq!(seen(50, 30), [false, true, false], "{name}: upper right");
        assert_eq!(seen(30, 50), [false, false, true], "{name}: lower left");
        assert_eq!(seen(50, 50), [true; 3], "{name}: lower right");
    }
}
