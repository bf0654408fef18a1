//! What moves in glTF files and scene files is where analysis has it, and damaged animations are errors.

use std::f32::consts::FRAC_1_SQRT_2;
use std::fs;
use std::path::{Path, PathBuf};

use glam::Vec3;
use lightmesh::Bounds;
use lightmesh::scene::Scene;
use lightmesh::scene::load::scene_file::load_scene_text;
use lightmesh::scene::load::{LoadError, LoadedScene, open_scene};
use serde_json::{Value, json};
use tempfile::TempDir;

/// A glTF file in the making: JSON, and the buffer that its accessors lie in.
struct Writer {
    json: Value,
    buffer: Vec<u8>,
}

impl Writer {
    /// Adds an accessor; its index.
    fn floats(&mut self, kind: &str, values: &[f32]) -> usize {
        let components = match kind {
            "SCALAR" => 1,
            "VEC3" => 3,
            _ => 4,
        };
        let offset = self.buffer.len();
        self.buffer.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        let list = |json: &mut Value, name: &str, item: Value| {
            let list = json[name].as_array_mut().expect("a list");
            list.push(item);
            list.len() - 1
        };
        let view = json!({ "buffer": 0, "byteOffset": offset, "byteLength": 4 * values.len() });
        let view = list(&mut self.json, "bufferViews", view);
        let count = values.len() / components;
        let accessor = json!({ "bufferView": view, "componentType": 5126, "count": count, "type": kind });
        list(&mut self.json, "accessors", accessor)
    }

    /// Adds a channel of the first animation.
    fn channel(&mut self, node: usize, path: &str, mode: &str, times: &[f32], values: &[f32]) {
        let input = self.floats("SCALAR", times);
        let output = self.floats(if path == "rotation" { "VEC4" } else { "VEC3" }, values);
        let animation = &mut self.json["animations"][0];
        let samplers = animation["samplers"].as_array_mut().expect("a list");
        samplers.push(json!({ "input": input, "interpolation": mode, "output": output }));
        let sampler = samplers.len() - 1;
        let channel = json!({ "sampler": sampler, "target": { "node": node, "path": path } });
        animation["channels"].as_array_mut().expect("a list").push(channel);
    }

    fn write(mut self, folder: &TempDir) -> PathBuf {
        self.json["buffers"] = json!([{ "uri": "arm.bin", "byteLength": self.buffer.len() }]);
        fs::write(folder.path().join("arm.bin"), &self.buffer).expect("writable");
        let path = folder.path().join("arm.gltf");
        fs::write(&path, self.json.to_string()).expect("writable");
        path
    }
}

/// An arm at (1, 0, 0) that turns about z by a quarter a second for two seconds; a triangle at its end, a lamp that jumps along it after a
/// second, and a camera whose x is t³. Beside it a triangle that stands still and one, of the same mesh, that grows to the double.
fn arm() -> Writer {
    let json = json!({
        "asset": { "version": "2.0" },
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": { "KHR_lights_punctual": { "lights": [{ "type": "point", "intensity": 5 }] } },
        "scene": 0,
        "scenes": [{ "nodes": [0, 4, 5] }],
        "nodes": [
            { "name": "arm", "translation": [1, 0, 0], "children": [1, 2, 3] },
            { "name": "hand", "translation": [2, 0, 0], "mesh": 0 },
            { "name": "lamp", "translation": [0, 1, 0],
              "extensions": { "KHR_lights_punctual": { "light": 0 } } },
            { "name": "eye", "camera": 0 },
            { "name": "still", "translation": [0, 0, 7], "mesh": 1 },
            { "name": "growing", "translation": [0, 0, 8], "mesh": 1 }
        ],
        "cameras": [{ "type": "perspective", "perspective": { "yfov": 1, "znear": 0.1 } }],
        "meshes": [
            { "primitives": [{ "attributes": { "POSITION": 0 } }] },
            { "primitives": [{ "attributes": { "POSITION": 0 } }] }
        ],
        "animations": [{ "samplers": [], "channels": [] }],
        "accessors": [],
        "bufferViews": []
    });
    let mut writer = Writer { json, buffer: Vec::new() };
    writer.floats("VEC3", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    let half = FRAC_1_SQRT_2;
    let turns = [[0.0, 0.0, 0.0, 1.0], [0.0, 0.0, half, half], [0.0, 0.0, 1.0, 0.0]];
    writer.channel(0, "rotation", "LINEAR", &[0.0, 1.0, 2.0], turns.as_flattened());
    writer.channel(2, "translation", "STEP", &[0.0, 1.0], &[0.0, 1.0, 0.0, 0.0, 3.0, 0.0]);
    // Slope into, value and slope out of each keyframe.
    let cubic = [[0.0; 3], [0.0; 3], [0.0; 3], [12.0, 0.0, 0.0], [8.0, 0.0, 0.0], [0.0; 3]];
    writer.channel(3, "translation", "CUBICSPLINE", &[0.0, 2.0], cubic.as_flattened());
    writer.channel(5, "scale", "LINEAR", &[0.0, 2.0], &[1.0, 1.0, 1.0, 2.0, 2.0, 2.0]);
    writer
}

/// Corners of the first triangle of an instance.
fn corners(scene: &Scene, instance: usize) -> [Vec3; 3] {
    let instance = &scene.instances[instance];
    let corners = scene.meshes[instance.mesh as usize].corners(0);
    corners.map(|corner| instance.to_world.map_or(corner, |to_world| to_world.transform_point3(corner)))
}

fn assert_near(found: Vec3, expected: Vec3) {
    assert!(found.abs_diff_eq(expected, 1e-5), "{found} for {expected}");
}

fn opened(path: &Path) -> LoadedScene {
    open_scene(path).unwrap_or_else(|error| panic!("{error}")).loaded
}

/// All modes of interpolation, of parents and children, of meshes in one place (which are kept where they stand) and in several, of lights and
/// cameras: rotation, jump, cubic and growth, each at times at which they are known. 24 frames are a second.
#[test]
fn gltf_nodes_are_where_their_channels_put_them() {
    let folder = tempfile::tempdir().expect("a folder");
    let LoadedScene { scene, cameras, animation, .. } = opened(&arm().write(&folder));
    assert_eq!(animation.range(), Some((0, 48)));
    let at = |number| {
        let frame = animation.frame(number);
        let mut moved = scene.clone();
        frame.apply(&mut moved);
        (moved, frame.camera(0, &cameras[0]))
    };
    assert_eq!(at(0), (scene.clone(), cameras[0].clone()), "the still image is that of the first frame");
    assert_eq!(at(-5), at(0), "nothing moves before the first keyframe");
    assert_eq!(at(100), at(48), "nor after the last one");

    // The arm after 0.5, 1 and 2 seconds: turned by an eighth, a quarter and a half.
    let (half, arm) = (FRAC_1_SQRT_2, Vec3::X);
    let turned = [(12, Vec3::new(half, half, 0.0)), (24, Vec3::Y), (48, Vec3::NEG_X)];
    for (number, along) in turned {
        let across = Vec3::new(-along.y, along.x, 0.0);
        let (moved, camera) = at(number);
        let [origin, x, y] = corners(&moved, 0);
        assert_near(origin, arm + along * 2.0);
        assert_near(x, arm + along * 3.0);
        assert_near(y, arm + along * 2.0 + across);
        let out = if number < 24 { 1.0 } else { 3.0 };
        assert_near(moved.lights[0].position, arm + across * out);
        assert_eq!(moved.lights[0].intensity, scene.lights[0].intensity);
        let seconds = number as f32 / 24.0;
        assert_near(camera.position, arm + along * seconds.powi(3));
        assert_near(camera.up, across);
        assert_near((camera.look_at - camera.position).normalize(), Vec3::NEG_Z);
        assert_eq!(corners(&moved, 1), corners(&scene, 1), "what has no channel stands still");
        assert_near(corners(&moved, 2)[1], Vec3::new(1.0 + 0.5 * seconds, 0.0, 8.0));
    }
}

/// What all frames reach is in the extent, and not much more is: the hand goes around (1, 0, 0) at distances up to √(3²+1²) (the corner beside its
/// end, at the start, is 2 along and 1 across).
#[test]
fn the_extent_holds_all_frames() {
    let folder = tempfile::tempdir().expect("a folder");
    let LoadedScene { scene, animation, .. } = opened(&arm().write(&folder));
    let extent = animation.extent(&scene);
    for number in -3..60 {
        let mut moved = scene.clone();
        animation.frame(number).apply(&mut moved);
        for instance in [0, 2] {
            assert!(corners(&moved, instance).iter().all(|&corner| extent.contains(corner)), "{number}");
        }
    }
    let generous = Bounds { min: Vec3::new(-2.5, -1.5, -0.5), max: Vec3::new(4.5, 3.6, 8.5) };
    assert!(generous.contains(extent.min) && generous.contains(extent.max), "{extent:?}");
}

fn text(folder: &TempDir, text: &str) -> Result<LoadedScene, LoadError> {
    load_scene_text(text, &folder.path().join("scene.toml"))
}

/// A model that moves along keyframes of the scene file carries its own motion, lights and cameras along: here by 4 a second along z, under the
/// turning arm. A second placement stands still and turns its arm all the same. Frames are ten a second.
#[test]
fn geometry_moves_with_what_moves_in_it() {
    let folder = tempfile::tempdir().expect("a folder");
    arm().write(&folder);
    let loaded = text(
        &folder,
        "
[animation]
frames_per_second = 10
[[geometry]]
file = \"arm.gltf\"
translate = [0, 0, 1]
keyframes = [{ time = 0, translate = [0, 0, 1] }, { time = 2, translate = [0, 0, 9] }]
[[geometry]]
file = \"arm.gltf\"
translate = [0, 50, 0]
",
    );
    let LoadedScene { scene, cameras, animation, .. } = loaded.unwrap_or_else(|error| panic!("{error}"));
    let frame = animation.frame(10);
    let mut moved = scene.clone();
    frame.apply(&mut moved);
    let up = Vec3::new(1.0, 2.0, 0.0);
    assert_near(corners(&moved, 0)[0], up + Vec3::Z * 5.0);
    assert_near(corners(&moved, 1)[0], Vec3::new(0.0, 0.0, 7.0 + 5.0));
    assert_near(corners(&moved, 3)[0], up + Vec3::Y * 50.0);
    assert_eq!(moved.instances[4], scene.instances[4]);
    assert_near(moved.lights[0].position, Vec3::new(-2.0, 0.0, 5.0));
    assert_near(moved.lights[1].position, Vec3::new(-2.0, 50.0, 0.0));
    assert_near(frame.camera(0, &cameras[0]).position, Vec3::new(1.0, 1.0, 5.0));
    assert_near(frame.camera(1, &cameras[1]).position, Vec3::new(1.0, 51.0, 0.0));
}

/// Rotations follow as they are written: from 0° to 360° is a full turn, about one axis or by three angles. At a quarter of the time x has
/// become −z, in either form.
#[test]
fn a_full_turn_is_one() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("model.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").expect("writable");
    for [from, to] in [
        ["{ axis = [0, 2, 0], degrees = 0 }", "{ axis = [0, 2, 0], degrees = 360 }"],
        ["[0, 0, 0]", "[0, 360, 0]"],
    ] {
        let keyframes = format!(
            "keyframes = [{{ time = 0, rotate = {from} }}, {{ time = 4, rotate = {to}, scale = 5 }}]"
        );
        let camera = "[camera]\nposition = [0, 0, 5]\nlook_at = [0, 0, 0]\n";
        let loaded =
            text(&folder, &format!("{camera}[[geometry]]\nfile = \"model.obj\"\nscale = 2\n{keyframes}"));
        let LoadedScene { scene, animation, .. } = loaded.unwrap_or_else(|error| panic!("{error}"));
        let mut moved = scene.clone();
        animation.frame(24).apply(&mut moved);
        // The only keyframe that has a scale, has it at all times.
        assert_near(corners(&moved, 0)[1], Vec3::new(0.0, 0.0, -5.0));
    }
}

/// Cameras along keyframes, at and between them: evenly, along a smooth curve (at a Catmull-Rom spline's middle, with slopes 1 and 3 of values 0, 1,
/// 4, 9 at whole seconds: (1 + 4)/2 + (2 − 4)/8), and in steps. What keyframes leave out stays; a second camera turns around what it looks at.
#[test]
fn cameras_follow_their_keyframes() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("model.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").expect("writable");
    for (interpolation, middle) in [("linear", 2.5), ("smooth", 2.25), ("step", 1.0)] {
        let loaded = text(
            &folder,
            &format!(
                "
[[camera]]
name = \"walk\"
position = [7, 7, 7]
look_at = [0, 0, -100]
interpolation = \"{interpolation}\"
keyframes = [
  {{ time = 0, position = [0, 0, 0], vertical_fov = 20 }},
  {{ time = 1, position = [1, 0, 0] }},
  {{ time = 2, position = [4, 0, 0] }},
  {{ time = 3, position = [9, 0, 0], vertical_fov = 50 }},
]
[[camera]]
position = [0, 1, 5]
look_at = [0, 1, 0]
turntable = {{ frames = 40 }}
[[geometry]]
file = \"model.obj\"
"
            ),
        );
        let LoadedScene { cameras, animation, .. } = loaded.unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(
            (cameras.len(), cameras[0].position),
            (2, Vec3::splat(7.0)),
            "a still image stays what it is"
        );
        let camera = |number: i64, index: usize| animation.frame(number).camera(index, &cameras[index]);
        assert_near(camera(48, 0).position, Vec3::new(4.0, 0.0, 0.0));
        assert_near(camera(36, 0).position, Vec3::new(middle, 0.0, 0.0));
        assert_eq!((camera(36, 0).look_at, camera(36, 0).name), (cameras[0].look_at, "walk".to_owned()));
        if interpolation != "step" {
            assert!((camera(36, 0).vertical_fov - 35.0).abs() < 1e-4);
        }
        assert_near(camera(10, 1).position, Vec3::new(5.0, 1.0, 0.0));
        assert_eq!(animation.range(), Some((0, 72)));
    }
}

/// Whatever is wrong with an animation is one error that names the file and the channel.
#[test]
fn damaged_animations_are_errors() {
    type Damage = fn(&mut Writer);
    fn sampler(writer: &mut Writer) -> &mut Value {
        &mut writer.json["animations"][0]["samplers"][0]
    }
    fn times(writer: &mut Writer, times: &[f32]) {
        let input = writer.floats("SCALAR", times);
        sampler(writer)["input"] = json!(input);
    }
    let cases: [(&str, Damage); 11] = [
        ("accessors[99] does not exist", |w| sampler(w)["input"] = json!(99)),
        ("accessors[99] does not exist", |w| sampler(w)["output"] = json!(99)),
        ("3 components instead of 4", |w| sampler(w)["output"] = json!(0)),
        ("values for 2 times", |w| times(w, &[0.0, 1.0])),
        ("is not finite", |w| times(w, &[0.0, f32::NAN, 1.0])),
        ("times must not fall", |w| times(w, &[0.0, 2.0, 1.0])),
        ("no keyframes", |w| times(w, &[])),
        ("3 values for 3 times, 9 needed", |w| sampler(w)["interpolation"] = json!("CUBICSPLINE")),
        ("interpolation is unknown", |w| sampler(w)["interpolation"] = json!("BEZIER")),
        ("nodes[99] does not exist", |w| {
            w.json["animations"][0]["channels"][0]["target"]["node"] = json!(99)
        }),
        ("samplers[99] does not exist", |w| w.json["animations"][0]["channels"][0]["sampler"] = json!(99)),
    ];
    let folder = tempfile::tempdir().expect("a folder");
    for (expected, damage) in cases {
        let mut writer = arm();
        damage(&mut writer);
        let error = open_scene(&writer.write(&folder)).err().expect("damaged").to_string();
        assert!(error.contains("arm.gltf: animations[0].channels[0]: "), "{error}");
        assert!(error.contains(expected), "{error}");
    }
    // Beyond the end of the buffer, as a cut file has it.
    let path = arm().write(&folder);
    let cut = fs::read(folder.path().join("arm.bin")).expect("the buffer");
    fs::write(folder.path().join("arm.bin"), &cut[..cut.len() - 4]).expect("writable");
    assert!(open_scene(&path).is_err());
}
