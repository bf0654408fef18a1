//! `per-light` converges to the conventional picture as R and the spacing go to 0 (method §13).

use glam::Vec3;
use lightmesh::scene::Falloff;
use lightmesh::settings::{Neighbourhood, Radius, Settings, Spacing};

use crate::common::{
    Builder, camera, conventional, forest, grey, light, picture, relative_rmse, settings_at,
};

/// RMSE against the conventional picture over its mean, for R and a spacing of R/`density`, halved `steps` times.
fn errors(
    scene: &lightmesh::scene::Scene,
    camera: &lightmesh::scene::Camera,
    settings: &Settings,
    radius: f32,
    density: f32,
    steps: i32,
) -> Vec<f64> {
    let (reference, _) = conventional(scene, camera, settings);
    (0..=steps)
        .map(|step| {
            let radius = radius * 0.5f32.powi(step);
            let mut settings = settings.clone();
            settings.shading.kernel.radius = Radius::Units(radius);
            settings.mesh.direct.spacing = Spacing::Units(Vec3::splat(radius / density));
            relative_rmse(&picture(scene, camera, &settings).0, &reference)
        })
        .collect()
}

/// One light, one straight edge: the error sits in a band of width O(R) along it, so that the RMSE is O(√R), and each
/// halving multiplies it by √½ = 0.71. The edge runs along the image's
/// rows: its profile needs their number, and columns only repeat it.
#[test]
fn the_error_of_one_shadow_edge_falls_with_the_root_of_the_radius() {
    let mut builder = Builder::default();
    builder.quad(Vec3::new(-5.0, 0.0, -5.0), Vec3::Z * 10.0, Vec3::X * 10.0, 0);
    builder.quad(Vec3::new(-5.0, 3.0, -5.0), Vec3::Z * 10.0, Vec3::X * 5.2, 0);
    let scene =
        builder.scene(vec![grey(0.8)], vec![light(Vec3::new(0.4, 9.0, 0.3), Vec3::ONE)], Falloff::None);
    let camera = camera(Vec3::new(4.5, 2.5, 0.2), Vec3::new(0.2, 0.0, 0.0), 50.0);
    for neighbourhood in [Neighbourhood::Sphere, Neighbourhood::SmoothSphere] {
        let mut settings = settings_at((40, 120));
        settings.shading.kernel.neighbourhood = neighbourhood;
        let errors = errors(&scene, &camera, &settings, 0.8, 4.0, 3);
        for pair in errors.windows(2) {
            let ratio = pair[1] / pair[0];
            assert!((0.6..=0.85).contains(&ratio), "{neighbourhood:?}: {errors:?}");
        }
    }
}

/// The same holds for thousands of leaves and many lights, once R is below the size of the gaps between leaves. Each of
/// the 5,625 pixels samples the edges of 100 lights, and time goes with the pixels.
#[test]
fn the_error_of_the_forest_falls_with_the_root_of_the_radius() {
    let loaded = forest(23_542, 100);
    let settings = settings_at((75, 75));
    let errors = errors(&loaded.scene, &loaded.cameras[0], &settings, 0.4, 2.0, 3);
    for pair in errors.windows(2) {
        let ratio = pair[1] / pair[0];
        assert!((0.6..=0.85).contains(&ratio), "{errors:?}");
    }
}
