//! The integrator `auto` gives the picture of the one that it takes, takes the same one however a render is cut up, and takes
//! no light mesh that it finds mistaken.

use glam::Vec3;
use lightmesh::render::Reason;
use lightmesh::sampling::SplitMix64;
use lightmesh::scene::generate::interior::Interior;
use lightmesh::scene::load::load_scene_file;
use lightmesh::scene::{Camera, Falloff, Scene};
use lightmesh::settings::{Integrator, Resolve, Settings, Spacing};

use crate::common::{Builder, camera, conventional, forest, grey, light, picture, settings_at};

/// What only a light mesh gives is never traced away.
#[test]
fn soft_shadows_have_their_light_mesh() {
    let loaded = forest(500, 2);
    let mut settings = loaded.settings.clone();
    settings.view.resolution = (64, 64);
    settings.shading.integrator = Integrator::Auto;
    let (_, stats) = picture(&loaded.scene, &loaded.cameras[0], &settings);
    let choice = stats.choice.expect("auto chose");
    assert_eq!((choice.integrator, choice.reason), (Integrator::LightMesh, Reason::Settings));
    assert_eq!(stats.integrator, Some(Integrator::LightMesh));
}

/// Forty lamps behind walls are sorted by a mesh; a choice by trial doesn't hang on the block size, and its picture is that
/// of the integrator by name, although the trial has evaluated some mesh points before.
#[test]
fn the_picture_is_that_of_what_was_taken() {
    let folder = tempfile::tempdir().unwrap();
    Interior { bays: 6, lamps: 40 }.write(folder.path()).unwrap();
    let loaded = load_scene_file(&folder.path().join("interior.toml")).unwrap();
    let mut settings = loaded.settings.clone();
    settings.view.resolution = (320, 320);
    settings.mesh.indirect = None;
    settings.shading.resolve = Resolve::Trace;
    settings.shading.integrator = Integrator::Auto;
    let (image, stats) = picture(&loaded.scene, &loaded.cameras[0], &settings);
    let choice = stats.choice.expect("auto chose");
    assert!(matches!(choice.reason, Reason::Trial(_)), "{choice}");
    settings.view.block_samples = Some(5_000);
    let (in_blocks, again) = picture(&loaded.scene, &loaded.cameras[0], &settings);
    assert_eq!(again.choice, Some(choice));
    assert_eq!(in_blocks.pixels(), image.pixels());
    settings.shading.integrator = choice.integrator;
    let (by_name, stats) = picture(&loaded.scene, &loaded.cameras[0], &settings);
    assert_eq!(stats.choice, None);
    assert_eq!(by_name.pixels(), image.pixels());
}

/// A crown of leaves with lamps in it, whose light reaches little of what it would without leaves, and mesh points so far apart
/// that what they see says nothing of what single leaves do.
fn crown() -> (Scene, Camera, Settings) {
    let mut random = SplitMix64::new(7);
    let mut vector = |size: f32| Vec3::from_array([(); 3].map(|()| random.between(-size, size)));
    let mut builder = Builder::default();
    for _ in 0..20_000 {
        builder.quad(vector(1.0), vector(0.1), vector(0.1), 0);
    }
    let lights = (0..24).map(|_| light(vector(1.0), Vec3::ONE)).collect();
    let scene = builder.scene(vec![grey(0.8)], lights, Falloff::default());
    let mut settings = settings_at((320, 320));
    settings.mesh.direct.spacing = Spacing::Units(Vec3::splat(0.5));
    settings.shading.resolve = Resolve::Trace;
    (scene, camera(Vec3::new(0.0, 0.0, 2.5), Vec3::ZERO, 45.0), settings)
}

/// The error that hybrid shadows estimate of themselves, from checks alone, is not below half the true one, the difference's share
/// of the image's light, and not above five times that.
#[test]
fn hybrid_shadows_know_their_error() {
    let (scene, camera, settings) = crown();
    let (reference, _) = conventional(&scene, &camera, &settings);
    let (hybrid, stats) = picture(&scene, &camera, &settings);
    let (of_hybrid, of_reference) = (hybrid.pixels().as_flattened(), reference.pixels().as_flattened());
    let difference: f32 = of_hybrid.iter().zip(of_reference).map(|(a, b)| (a - b).abs()).sum();
    let error = difference / of_reference.iter().sum::<f32>();
    let estimate = stats.hybrid_error.share().expect("hybrid shadows");
    assert!(0.5 * error < estimate && estimate < 5.0 * error, "estimated {estimate}, true {error}");
}

/// Where checks find the mesh mistaken about more of the light than the tolerance allows, `auto` traces every shadow.
#[test]
fn a_mistaken_light_mesh_is_not_taken() {
    let (scene, camera, mut settings) = crown();
    settings.shading.integrator = Integrator::Auto;
    let (image, stats) = picture(&scene, &camera, &settings);
    let choice = stats.choice.expect("auto chose");
    assert_eq!(choice.integrator, Integrator::Conventional);
    assert!(
        matches!(choice.reason, Reason::Mistaken(error) if error > settings.shading.tolerance),
        "{choice}"
    );
    assert_eq!(image.pixels(), conventional(&scene, &camera, &settings).0.pixels());
}
