//! The integrator `auto` gives the picture of the one that it takes, and takes the same one however a render is cut up.

use lightmesh::render::Reason;
use lightmesh::scene::generate::interior::Interior;
use lightmesh::scene::load::load_scene_file;
use lightmesh::settings::{Integrator, Resolve};

use crate::common::{forest, picture};

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
