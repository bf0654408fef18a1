//! Levels of mesh points (method §8): finer points trace the lights alone on which the coarser ones around them disagree.

use glam::Vec3;
use lightmesh::image::Image;
use lightmesh::image::metrics::{MetricsOptions, compare};
use lightmesh::scene::{Camera, Falloff, Light, Scene};
use lightmesh::settings::{Integrator, Leaks, PointLayout, Radius, Settings, Spacing};

use crate::common::{Builder, bits, forest, grey, picture, session, settings_at};

/// Two halls with a door between them, and lights in both: most of space sees all lights of its hall, and none of the other's. The wall between
/// them is a hundredth of the coarsest spacing thick that is tried here.
fn halls() -> (Scene, Camera) {
    let mut builder = Builder::default();
    builder.cuboid(Vec3::ZERO, Vec3::new(12.0, 3.0, 6.0), true, 0);
    builder.cuboid(Vec3::new(6.0, 0.0, 0.0), Vec3::new(6.003, 3.0, 2.5), false, 0);
    builder.cuboid(Vec3::new(6.0, 0.0, 3.5), Vec3::new(6.003, 3.0, 6.0), false, 0);
    let light = |number: u32| {
        let position = Vec3::new(0.6 + 1.2 * (number % 10) as f32, 2.7, 1.0 + 2.0 * (number / 10) as f32);
        Light::point(position, Vec3::ONE)
    };
    let scene = builder.scene(vec![grey(0.7)], (0..30).map(light).collect(), Falloff::InverseSquare);
    let camera = Camera::look_at(Vec3::new(0.5, 1.6, 5.5), Vec3::new(8.0, 1.2, 2.0));
    (scene, camera)
}

fn settings(spacing: f32, levels: u32) -> Settings {
    let mut settings = settings_at((64, 48));
    settings.shading.integrator = Integrator::LightMesh;
    settings.shading.kernel.leaks = Leaks::Allow;
    settings.shading.kernel.radius = Radius::Units(0.3);
    settings.mesh.direct.spacing = Spacing::Units(Vec3::splat(spacing));
    settings.mesh.direct.levels = levels;
    settings
}

fn difference(image: &Image, other: &Image) -> f64 {
    let metrics = compare(image, other, MetricsOptions::default()).expect("one size");
    metrics.relative_rmse.expect("light")
}

/// Where space is mostly lit or mostly dark, two levels spare more than half of the rays, for a picture that differs from the one of all rays
/// by less than a tenth of what a mesh of twice the spacing differs by. Both layouts that lie on coarser points do so.
#[test]
fn agreement_spares_rays_and_not_shadows() {
    let (scene, camera) = halls();
    for layout in [PointLayout::Regular, PointLayout::BodyCentred] {
        let render = |spacing, levels| {
            let mut settings = settings(spacing, levels);
            settings.mesh.direct.layout = layout.clone();
            let (image, stats) = picture(&scene, &camera, &settings);
            (image, stats.rays.shadow)
        };
        let (all, all_rays) = render(0.08, 0);
        let (refined, rays) = render(0.08, 2);
        let (coarse, _) = render(0.16, 0);
        assert!(2 * rays < all_rays, "{layout:?}: {rays} of {all_rays} rays");
        let (lost, scale) = (difference(&refined, &all), difference(&coarse, &all));
        assert!(lost < 0.1 * scale, "{layout:?}: {lost}, a coarse mesh {scale}");
    }
}

/// Coarser points that are known are not evaluated again: a mesh of half the spacing builds on them, and gives the picture of one that
/// knew nothing.
#[test]
fn coarse_values_are_kept() {
    let (scene, camera) = halls();
    let mut session = session(&scene);
    let (_, coarse) = session.render(&camera, &settings(0.3, 0)).expect("an image");
    let (image, finer) = session.render(&camera, &settings(0.15, 1)).expect("an image");
    let (alone, all) = picture(&scene, &camera, &settings(0.15, 1));
    assert!(bits(&image) == bits(&alone));
    let evaluated = |stats: &lightmesh::render::RenderStats| stats.mesh_points.direct.evaluated;
    assert!(evaluated(&finer) < evaluated(&all) && evaluated(&coarse) > 0);
    assert!(evaluated(&coarse) + evaluated(&finer) >= evaluated(&all), "points are counted once");
    let (_, again) = session.render(&camera, &settings(0.15, 1)).expect("an image");
    assert_eq!((again.rays.shadow, evaluated(&again)), (0, 0));
}

/// What finer points take over is no fact: a mesh in which all lights are traced doesn't believe it, whatever was rendered before.
#[test]
fn inferred_values_stay_among_themselves() {
    let loaded = forest(1_500, 20);
    let camera = &loaded.cameras[0];
    let mut session = session(&loaded.scene);
    session.render(camera, &settings(0.4, 2)).expect("an image");
    let (image, _) = session.render(camera, &settings(0.4, 0)).expect("an image");
    let (alone, _) = picture(&loaded.scene, camera, &settings(0.4, 0));
    assert!(bits(&image) == bits(&alone));
}
