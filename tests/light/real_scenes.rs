//! Real scenes with many lights: `per-light` errs only where the spacing explains it.
//!
//! Needs the folder of test scenes beside the project.

use std::f32::consts::PI;

use glam::Vec3;
use lightmesh::accel::{Accel, Backend};
use lightmesh::image::Image;
use lightmesh::image::tone::auto_exposure;
use lightmesh::light_mesh::direct::DirectMesh;
use lightmesh::light_mesh::points::{AutoSpacing, Neighbours};
use lightmesh::scene::load::{LoadedScene, open_scene};
use lightmesh::scene::{CameraRays, Interaction, Light, Ray, Scene};
use lightmesh::settings::{Resolve, Settings, Spacing};

use crate::common::data::shared;
use crate::common::{backend, conventional, picture};

const RESOLUTION: (u32, u32) = (96, 72);

/// The scene as it is opened, with plain `per-light` at the spacing that is chosen for it; `None`, and said so, where it
/// isn't there.
fn opened(model: &str) -> Option<LoadedScene> {
    let file = shared(&format!("scenes/{model}"))?;
    let mut loaded = open_scene(&file).unwrap().loaded;
    loaded.settings.view.resolution = RESOLUTION;
    loaded.settings.shading.resolve = Resolve::Average;
    // Reflections would bring in surfaces that the test doesn't look at.
    loaded.settings.view.max_depth = 1;
    // Bounds are those of the surface points in the pixels' centres.
    loaded.settings.view.samples_per_pixel = 1;
    Some(loaded)
}

/// The surface points in the pixels' centres.
fn visible<A: Accel>(accel: &A, loaded: &LoadedScene) -> Vec<Option<Interaction>> {
    let rays = CameraRays::new(&loaded.cameras[0], RESOLUTION, 1);
    let pixels = (0..RESOLUTION.1).flat_map(|y| (0..RESOLUTION.0).map(move |x| (x, y)));
    let hit = |(x, y)| {
        let ray = rays.ray(x, y, 0);
        Some(loaded.scene.interaction(&accel.intersect(&ray)?, ray.direction))
    };
    pixels.map(hit).collect()
}

/// k_d/π · φ2 · E/φ1: what a light adds to a pixel if it is seen.
fn share(scene: &Scene, light: &Light, surface: &Interaction) -> Vec3 {
    let y = &surface.point;
    let offset = light.position - y.position;
    let cosine = y.shading_normal.dot(offset.normalize_or_zero()).max(0.0);
    surface.diffuse / PI * light.intensity * (cosine * scene.falloff.reciprocal(offset.length()))
}

/// Ṽ_i is a mean of V_i(x) over mesh points x of D_y, whichever of them count. So it can differ from V_i(y) only if some
/// x of D_y sees light i and y doesn't, or the other way round, and then by 1 at most. The sum of what those lights
/// would add is a bound of the pixel's error: there is none where all of D_y agrees with y.
///
/// At half the spacing the bands along shadow edges in which D_y disagrees are half as wide, so that the mean error is
/// halved too (method §13: L1 = O(R)) once D_y is smaller than what casts the shadows, and falls more slowly before. Beside a
/// lamp the inverse square has no bound: values count up to the white of the picture.
fn errs_only_where_the_spacing_explains_it(model: &str, lights: usize, coarsest: f32) {
    let Some(loaded) = opened(model) else { return };
    let LoadedScene { scene, cameras, settings, .. } = &loaded;
    assert_eq!(scene.lights.len(), lights);
    let backend = backend(scene);
    let (exact, _) = conventional(scene, &cameras[0], settings);
    let spacing = Vec3::splat(scene.bounds().extent().length() / 120.0 * coarsest);
    let errors = [1.0f32, 0.5, 0.25].map(|part| {
        let mut settings = settings.clone();
        settings.mesh.direct.spacing = Spacing::Units(spacing * part);
        let (image, _) = picture(scene, &cameras[0], &settings);
        check_bounds(&backend, &loaded, &settings, image.pixels(), exact.pixels());
        mean_error(&image, &exact)
    });
    println!("{model}: mean error / mean {errors:?} at spacings of {}, 1/2 and 1/4 of it", spacing.x);
    assert!(errors.windows(2).all(|pair| pair[1] <= 0.85 * pair[0]), "{errors:?}");
}

/// Mean difference over the mean, of values up to the white of a tone-mapped picture.
fn mean_error(image: &Image, exact: &Image) -> f64 {
    let white = auto_exposure(exact.pixels()).exp2().recip();
    let values = |image: &Image| -> Vec<f64> {
        image.pixels().iter().flatten().map(|&value| f64::from(value.min(white))).collect()
    };
    let (values, expected) = (values(image), values(exact));
    let difference: f64 = values.iter().zip(&expected).map(|(a, b)| (a - b).abs()).sum();
    difference / expected.iter().sum::<f64>()
}

fn check_bounds(
    backend: &Backend,
    loaded: &LoadedScene,
    settings: &Settings,
    image: &[[f32; 3]],
    exact: &[[f32; 3]],
) {
    let scene = &loaded.scene;
    let mut mesh = DirectMesh::new(scene.bounds());
    let shading = &settings.shading;
    let shading = mesh
        .interpolation(&settings.mesh.direct, &shading.kernel, shading.estimator, AutoSpacing::AVERAGED)
        .unwrap();
    let points = &mesh.store().points;
    let mut neighbours = Neighbours::default();
    let (mut checked, mut agreeing) = (0, 0);
    let surfaces = visible(backend, loaded);
    // Every seventh pixel: no divisor of the width, so that all columns have their turn.
    for (pixel, seen) in surfaces.iter().enumerate().step_by(7) {
        let Some(seen) = seen else { continue };
        let y = &seen.point;
        shading.neighbourhoods.find(points, y, &mut neighbours);
        let sees = |from: Vec3, light: &Light| !backend.occluded(&Ray::between(from, light.position));
        let disagrees = |light: &&Light| {
            let truth = sees(y.ray_origin(), light);
            neighbours.ids().iter().any(|&id| sees(points.position(id), light) != truth)
        };
        let facing = scene.lights.iter().filter(|light| share(scene, light, seen) != Vec3::ZERO);
        let bound: Vec3 = facing.filter(disagrees).map(|light| share(scene, light, seen)).sum();
        checked += 1;
        agreeing += usize::from(bound == Vec3::ZERO);
        for channel in 0..3 {
            let (value, expected) = (image[pixel][channel], exact[pixel][channel]);
            // The sums over up to hundreds of lights run in different orders.
            let rounding = 1e-4 * expected.max(value) + 1e-7;
            assert!(
                (value - expected).abs() <= bound[channel] + rounding,
                "pixel {pixel}: {value} for {expected}, of which the spacing explains {}",
                bound[channel]
            );
        }
    }
    println!("{checked} pixels, in {agreeing} of them all of D_y agrees with y about all lights");
}

#[test]
fn quake_start_with_its_267_lights() {
    errs_only_where_the_spacing_explains_it("quake_start/quake_start.glb", 267, 1.0);
}

/// A quarter of the spacing that is chosen: with D_y of 26 units, wider than street lamps and flowerbeds, nearly every light
/// is disagreed about somewhere.
#[test]
fn candela_city_at_its_street_lamps() {
    errs_only_where_the_spacing_explains_it("stk_candela_city/candela_city.glb", 72, 0.25);
}
