//! Hybrid shadows are close to the conventional tracer's for a fraction of its rays (spec §4).

mod common;

use common::{conventional, picture, relative_rmse};
use glam::Vec3;
use lightmesh::scene::generate::interior::Interior;
use lightmesh::scene::load::{LoadedScene, load_scene_file};
use lightmesh::settings::{Leaks, Neighbourhood, Radius, Resolve, Settings, Spacing};

fn interior() -> LoadedScene {
    let folder = tempfile::tempdir().unwrap();
    Interior { bays: 6, lamps: 40 }.write(folder.path()).unwrap();
    load_scene_file(&folder.path().join("interior.toml")).unwrap()
}

/// An interior with many lights: most surface points agree with their mesh points about most lights, and the remaining
/// rays are enough for a picture that differs from the conventional one by a few hundredths of its mean.
/// Asking the lights where mesh points disagree, rather than averaging, at least halves the distance to the conventional
/// picture, and leaves most shadow rays untraced: where mesh points agree there is nothing to ask.
#[test]
fn hybrid_shadows_are_closer_to_the_conventional_ones_for_a_part_of_their_rays() {
    let loaded = interior();
    let mut settings = Settings { resolution: (600, 400), ..Settings::default() };
    let mesh = &mut settings.light_mesh;
    mesh.points.neighbourhood = Neighbourhood::Sphere;
    mesh.points.leaks = Leaks::Allow;
    mesh.points.spacing = Spacing::Units(Vec3::splat(0.25));
    mesh.points.radius = Radius::Spacings(1.5);
    let (reference, conventional) = conventional(&loaded.scene, &loaded.cameras[0], &settings);
    let (averaged, _) = picture(&loaded.scene, &loaded.cameras[0], &settings);
    settings.light_mesh.resolve = Resolve::Trace;
    let (traced, hybrid) = picture(&loaded.scene, &loaded.cameras[0], &settings);
    let (error, soft) = (relative_rmse(&traced, &reference), relative_rmse(&averaged, &reference));
    assert!(error < 0.5 * soft, "{error} against {soft} for averages");
    assert!(hybrid.rays.shadow < conventional.rays.shadow / 2, "{} rays", hybrid.rays.shadow);
}
