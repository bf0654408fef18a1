//! Light meshes in files: what one session found is another one's, to the bit, and nothing else is (docs/light-mesh-files.md).

use std::fs;
use std::path::Path;
use std::sync::Arc;

use glam::Vec3;
use lightmesh::image::Window;
use lightmesh::light_mesh::file::MeshFileError;
use lightmesh::render::{RenderStats, Session, StopToken};
use lightmesh::scene::load::LoadedScene;
use lightmesh::scene::{Camera, Scene};
use lightmesh::settings::{
    IndirectForm, IndirectSettings, Integrator, Leaks, PointLayout, Radius, Region, Resolve, Settings,
    Spacing,
};

use crate::common::{bits, forest, picture, session, settings_at};

const LIGHTS: u32 = 20;

fn loaded() -> LoadedScene {
    forest(1_500, LIGHTS)
}

fn settings() -> Settings {
    let mut settings = settings_at((64, 48));
    settings.mesh.direct.spacing = Spacing::Units(Vec3::splat(1.0));
    settings.shading.kernel.radius = Radius::Spacings(1.5);
    // Nothing but mesh points asks for occlusion then.
    settings.shading.kernel.leaks = Leaks::Allow;
    settings
}

/// The preset that most people have: shadow edges traced, light from surfaces, the error measured.
fn physical() -> Settings {
    let mut settings = settings_at((96, 64));
    settings.shading.integrator = Integrator::Auto;
    settings.shading.lambertian = true;
    settings.shading.resolve = Resolve::Trace;
    settings.shading.kernel.leaks = Leaks::Invalidate;
    settings.derive_indirect().bounces = 4;
    settings.mesh.indirect.iter_mut().for_each(|indirect| indirect.directions = 64);
    settings.limits.max_error = Some(0.02);
    settings
}

fn render(session: &mut Session, camera: &Camera, settings: &Settings) -> (Vec<u32>, RenderStats) {
    let (image, stats) = session.render(camera, settings).expect("an image");
    (bits(&image), stats)
}

/// A session that has read a file.
fn reading(scene: &Scene, path: &Path, settings: &Settings) -> Session {
    let mut session = session(scene);
    session.read_light_meshes(path, settings).expect("a file of this scene");
    session
}

/// Whatever the points and the form of indirect light: an image with a file is the one without, and no mesh point costs a ray.
#[test]
fn a_file_gives_the_same_bits_without_the_rays() {
    let loaded = loaded();
    let (scene, camera) = (&loaded.scene, &loaded.cameras[0]);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("field.lmesh");
    type Change = fn(&mut Settings);
    let kinds: [(&str, Change); 7] = [
        ("regular", |_| {}),
        ("blue noise", |s| s.mesh.direct.layout = PointLayout::BlueNoise { seed: 3 }),
        ("levels", |s| s.mesh.direct.levels = 2),
        ("inside", |s| s.shading.kernel.leaks = Leaks::Invalidate),
        ("list", |s| {
            let position =
                |i: i32| Vec3::new((i % 7 - 3) as f32, (i / 49) as f32, (i / 7 % 7 - 3) as f32) * 1.5;
            s.mesh.direct.layout = PointLayout::List(Arc::new((0..343).map(position).collect()));
            s.shading.kernel.radius = Radius::Units(3.0);
        }),
        ("region", |s| {
            let bounds = lightmesh::Bounds { min: Vec3::splat(-3.0), max: Vec3::splat(3.0) };
            s.mesh.direct.regions.push(Region { bounds, spacing: Some(Vec3::splat(0.7)), radius: None });
        }),
        ("gathered in space", |s| {
            let indirect = IndirectSettings {
                form: IndirectForm::Directional,
                directions: 32,
                bounces: 2,
                ..IndirectSettings::default()
            };
            s.mesh.indirect = Some(indirect);
            s.mesh.indirect.iter_mut().for_each(|i| i.points.spacing = Spacing::Units(Vec3::splat(2.5)));
            s.shading.indirect.kernel.leaks = Leaks::Allow;
        }),
    ];
    for (name, change) in kinds {
        let mut settings = settings();
        change(&mut settings);
        let mut first = session(scene);
        let (image, found) = render(&mut first, camera, &settings);
        assert!(found.mesh_points.direct.evaluated > 0, "{name}");
        let _ = fs::remove_file(&path);
        first.update_light_meshes(&path, &settings).expect("a file");
        let (again, stats) = render(&mut reading(scene, &path, &settings), camera, &settings);
        assert!(again == image, "{name}");
        assert_eq!((stats.rays.shadow, stats.rays.indirect, stats.rays.inside), (0, 0, 0), "{name}");
    }
}

/// With light from surfaces, an error that is measured and an integrator to be chosen, all of that is in the file: a part of the image is rendered
/// without the rest of it, and is part of the whole.
#[test]
fn parts_of_an_image_need_no_more_than_the_file() {
    let loaded = loaded();
    let (scene, camera, settings) = (&loaded.scene, &loaded.cameras[0], physical());
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("field.lmesh");
    let mut first = session(scene);
    let (whole, found) = first.render(camera, &settings).expect("an image");
    first.update_light_meshes(&path, &settings).expect("a file");
    for number in 1..=3 {
        let window = Window::part((96, 64), 32, number, 3).expect("a part");
        let mut part = settings.clone();
        part.view.crop = Some(window);
        let (with_file, stats) = reading(scene, &path, &settings).render(camera, &part).expect("an image");
        assert_eq!(stats.mesh_points.direct.evaluated + stats.mesh_points.indirect.evaluated, 0);
        assert_eq!((stats.rays.indirect, stats.accuracy), (0, found.accuracy));
        // Camera rays of that part alone.
        assert!(stats.rays.camera < found.rays.camera / 2, "{} of {}", stats.rays.camera, found.rays.camera);
        let (without, _) = session(scene).render(camera, &part).expect("an image");
        for image in [with_file, without] {
            assert_eq!(image.crop(window), whole.crop(window), "part {number}");
        }
    }
}

/// Sessions that looked elsewhere add to one file: who reads it knows what both found, and values are those that each would have found alone.
#[test]
fn a_file_grows_by_what_others_add() {
    let loaded = loaded();
    let (scene, here) = (&loaded.scene, &loaded.cameras[0]);
    let there =
        Camera { position: Vec3::new(-here.position.z, here.position.y, here.position.x), ..here.clone() };
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("field.lmesh");
    for settings in [settings(), physical()] {
        let _ = fs::remove_file(&path);
        let mut evaluated = 0;
        for (camera, spacing) in [(here, 1.0), (&there, 1.0), (here, 0.5)] {
            let mut settings = settings.clone();
            if settings.mesh.indirect.is_none() {
                settings.mesh.direct.spacing = Spacing::Units(Vec3::splat(spacing));
            }
            let mut alone = session(scene);
            let (_, stats) = render(&mut alone, camera, &settings);
            evaluated += stats.mesh_points.direct.evaluated;
            alone.update_light_meshes(&path, &settings).expect("a file");
        }
        let mut both = session(scene);
        let restored = both.read_light_meshes(&path, &settings).expect("a file of this scene");
        // Points that several of them evaluated are there once.
        assert!(restored.direct > 0 && restored.direct <= evaluated, "{restored:?}");
        for camera in [here, &there] {
            let (image, stats) = render(&mut both, camera, &settings);
            assert_eq!(stats.mesh_points.direct.evaluated + stats.mesh_points.indirect.evaluated, 0);
            if settings.mesh.indirect.is_none() {
                assert!(image == bits(&picture(scene, camera, &settings).0));
            }
        }
    }
}

/// Brightness of lights and colours of surfaces don't change what mesh points see: that stays, and what surfaces send on is found anew. Other
/// triangles and places of lights are another scene.
#[test]
fn a_file_is_of_a_scene() {
    let loaded = loaded();
    let (scene, camera, settings) = (&loaded.scene, &loaded.cameras[0], physical());
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("field.lmesh");
    let mut first = session(scene);
    render(&mut first, camera, &settings);
    first.update_light_meshes(&path, &settings).expect("a file");

    type Change = fn(&mut Scene);
    let harmless: [Change; 2] =
        [|s| s.lights[3].intensity *= 2.0, |s| s.materials.iter_mut().for_each(|m| m.diffuse *= 0.5)];
    for change in harmless {
        let mut changed = scene.clone();
        change(&mut changed);
        let mut again = session(&changed);
        assert!(again.read_light_meshes(&path, &settings).expect("points stay").without_indirect);
        let (image, _) = render(&mut again, camera, &settings);
        assert!(image == bits(&picture(&changed, camera, &settings).0));
    }
    let another: [Change; 3] = [
        |s| s.lights[3].position.x += 0.01,
        |s| s.lights.truncate(LIGHTS as usize - 1),
        |s| s.place(0, glam::Affine3A::from_translation(Vec3::Y)),
    ];
    for change in another {
        let mut changed = scene.clone();
        change(&mut changed);
        let refused = session(&changed).read_light_meshes(&path, &settings);
        assert!(refused.as_ref().is_err_and(MeshFileError::is_mismatch), "{refused:?}");
        // Nor is the file lost to the other scene.
        let mut other = session(&changed);
        render(&mut other, camera, &settings);
        assert!(other.update_light_meshes(&path, &settings).is_err());
    }
    let mut finer = settings.clone();
    finer.mesh.indirect.iter_mut().for_each(|indirect| indirect.directions = 128);
    let refused = session(scene).read_light_meshes(&path, &finer);
    assert!(matches!(refused, Err(MeshFileError::OtherSettings)), "{refused:?}");
    // Who does without light from surfaces leaves it there for others.
    let mut direct = settings.clone();
    direct.mesh.indirect = None;
    reading(scene, &path, &direct).update_light_meshes(&path, &direct).expect("a file");
    let (_, stats) = render(&mut reading(scene, &path, &settings), camera, &settings);
    assert_eq!(stats.mesh_points.indirect.evaluated, 0);
}

/// A box holds all points that surfaces in it need: a view from within costs no ray for direct light.
#[test]
fn a_baked_box_serves_every_view() {
    let loaded = loaded();
    let (scene, camera, settings) = (&loaded.scene, &loaded.cameras[0], settings());
    let mut session = session(scene);
    let mut bounds = scene.bounds();
    let reach = 1.5;
    (bounds.min, bounds.max) = (bounds.min - reach, bounds.max + reach);
    let evaluation = session.prepare_box(bounds, camera, &settings, &StopToken::default()).expect("a box");
    assert_eq!(evaluation.shadow, evaluation.evaluated * u64::from(LIGHTS));
    let (image, stats) = render(&mut session, camera, &settings);
    assert_eq!(stats.rays.shadow, 0);
    assert!(image == bits(&picture(scene, camera, &settings).0));
}

/// A file with right checksums whose contents contradict each other, as none of ours, is an error and no panic: every section of a sound file is
/// taken for every other one, and cut.
#[test]
fn contents_that_contradict_each_other_are_refused() {
    let loaded = loaded();
    let (scene, camera, settings) = (&loaded.scene, &loaded.cameras[0], physical());
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("field.lmesh");
    let mut first = session(scene);
    render(&mut first, camera, &settings);
    first.update_light_meshes(&path, &settings).expect("a file");
    let names = ["identity", "direct.layers", "direct.points", "direct.bits", "surface", "views"];
    let file = lightmesh::light_mesh::file::MeshFile::open(&path).expect("a file");
    let bytes = |name: &str| file.section(name).map(|section| section.bytes().to_vec()).unwrap_or_default();
    let (mut refused, mut session) = (0, session(scene));
    for name in names {
        let own = bytes(name);
        let others = names.iter().filter(|other| **other != name).map(|other| bytes(other));
        let cut = [own.len() / 2, own.len().saturating_sub(1), 0].map(|length| own[..length].to_vec());
        for contents in others.chain(cut) {
            let mut writer = lightmesh::light_mesh::file::SectionsWriter::default();
            for section in names {
                writer.bytes(section, if section == name { contents.clone() } else { bytes(section) });
            }
            for section in ["direct.inside", "lights"] {
                writer.bytes(section, bytes(section));
            }
            // Not in place: the sound one is mapped.
            let broken = folder.path().join("broken.lmesh");
            fs::write(&broken, writer.finish()).expect("writable");
            refused += u32::from(session.read_light_meshes(&broken, &settings).is_err());
        }
    }
    assert_eq!(refused, 6 * 8);
}
