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
#[test]
fn hybrid_shadows_of_an_interior_take_a_third_of_the_rays() {
    let loaded = interior();
    let mut settings = Settings { resolution: (600, 400), ..Settings::default() };
    let mesh = &mut settings.light_mesh;
    mesh.resolve = Resolve::Trace;
    mesh.points.neighbourhood = Neighbourhood::Sphere;
    mesh.points.leaks = Leaks::Allow;
    mesh.points.spacing = Spacing::Units(Vec3::splat(0.25));
    mesh.points.radius = Radius::Spacings(1.5);
    let (reference, conventional) = conventional(&loaded.scene, &loaded.cameras[0], &settings);
    let (film, hybrid) = picture(&loaded.scene, &loaded.cameras[0], &settings);
    let rays = hybrid.rays.shadow as f64 / conventional.rays.shadow as f64;
    let error = relative_rmse(&film, &reference);
    assert!(rays <= 1.0 / 3.0, "{rays} of the rays");
    assert!(error <= 0.03, "RMSE {error} of the mean");
}
