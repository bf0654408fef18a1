//! Lamps with a size: their light is that of formulas, and so are their shadows.

use std::f32::consts::{FRAC_1_PI, FRAC_PI_2};

use glam::Vec3;
use lightmesh::image::Image;
use lightmesh::scene::{Camera, Falloff, Light, Material, Scene};
use lightmesh::settings::{IndirectForm, IndirectSettings, Integrator, Resolve, Settings};

use crate::common::{Builder, grey, light, picture, session, settings_at};

const SIDE: u32 = 64;

/// Lambertian reflectors, traced shadows, 16 samples, no light from surface to surface.
fn settings(integrator: Integrator) -> Settings {
    let mut settings = settings_at((SIDE, SIDE));
    settings.view.samples_per_pixel = 16;
    settings.shading.lambertian = true;
    settings.shading.integrator = integrator;
    settings.shading.resolve = Resolve::Trace;
    settings
}

const BOTH: [Integrator; 2] = [Integrator::Conventional, Integrator::LightMesh];

/// A view straight down at a place on the floor from 2 above it, that shows so much of it along each axis.
fn above(place: Vec3, width: f32) -> Camera {
    let angle = 2.0 * (0.5 * width / 2.0f32).atan().to_degrees();
    Camera::look_at(place + Vec3::Y * 2.0, place).with_up(Vec3::NEG_Z).with_fov(angle)
}

/// Place on the floor of a pixel's middle.
fn ground(place: Vec3, width: f32, index: usize) -> Vec3 {
    let at = |pixel: usize| width * ((pixel as f32 + 0.5) / SIDE as f32 - 0.5);
    place + Vec3::new(at(index % SIDE as usize), 0.0, at(index / SIDE as usize))
}

/// White floor, and whatever else.
fn floor(builder: Builder, lights: Vec<Light>) -> Scene {
    let mut builder = builder;
    builder.quad(Vec3::new(-20.0, 0.0, -20.0), Vec3::Z * 40.0, Vec3::X * 40.0, 0);
    builder.scene(
        vec![grey(1.0), Material { emission: Vec3::ONE, ..grey(0.0) }],
        lights,
        Falloff::InverseSquare,
    )
}

/// A ball gives what a point gives, I cos/(π d²), as long as all of it is seen.
#[test]
fn a_ball_lights_like_a_point() {
    let at = Vec3::new(1.0, 1.5, -0.5);
    let mut scene = floor(Builder::default(), vec![Light::ball(at, 0.4, Vec3::splat(5.0))]);
    let camera = above(Vec3::ZERO, 1.0);
    for visible in [false, true] {
        if visible {
            scene.add_ball(at, 0.4, Vec3::splat(5.0));
        }
        for integrator in BOTH {
            let (image, _) = picture(&scene, &camera, &settings(integrator));
            for (index, pixel) in image.pixels().iter().enumerate() {
                let way = at - ground(Vec3::ZERO, 1.0, index);
                let expected = 5.0 * FRAC_1_PI * way.y / way.length().powi(3);
                // Light is computed at the sample that is nearest to the middle.
                assert!(
                    (pixel[0] / expected - 1.0).abs() < 5e-3,
                    "{integrator}: {} for {expected}",
                    pixel[0]
                );
            }
        }
    }
}

/// Part of a disc of radius 1 beyond a line at a distance of its middle, from −1, all of it, to 1.
fn beyond(distance: f32) -> f32 {
    let t = distance.clamp(-1.0, 1.0);
    (FRAC_PI_2 - t.asin() - t * (1.0 - t * t).sqrt()) * FRAC_1_PI
}

/// Where the part that is seen, by a coordinate, comes to a share: found between the steps on either side.
fn crossing(profile: &[(f32, f32)], share: f32) -> f32 {
    let pair = profile.windows(2).find(|pair| pair[0].1 < share && pair[1].1 >= share);
    let &[(x0, v0), (x1, v1)] = pair.expect("the profile comes to the share") else { unreachable!() };
    x0 + (x1 - x0) * (share - v0) / (v1 - v0)
}

/// The penumbra of an upright edge under a ball of radius r, at a horizontal distance of D before it, is r·s/D wide on either side at a distance of s behind
/// it, and has the profile of a disc: its width between tenth and nine tenths is within a tenth of that at the edge's foot and three times as far from it.
#[test]
fn the_penumbra_of_a_post_widens_with_the_distance_from_its_foot() {
    let (lamp, radius, distance) = (Vec3::new(0.0, 3.0, -4.0), 0.3, 4.0);
    let mut builder = Builder::default();
    // The left half of the plane z = 0.
    builder.quad(Vec3::new(-15.0, 0.0, 0.0), Vec3::X * 15.0, Vec3::Y * 15.0, 0);
    let scene = floor(builder, vec![Light::ball(lamp, radius, Vec3::splat(40.0))]);
    for behind in [0.5f32, 1.5] {
        let half = radius * behind / distance;
        let (place, width) = (Vec3::Z * behind, 4.0 * half);
        for integrator in BOTH {
            let (image, _) = picture(&scene, &above(place, width), &settings(integrator));
            let mut steps = vec![(0.0, 0u32); 64];
            let mut error = 0.0;
            for (index, pixel) in image.pixels().iter().enumerate() {
                let y = ground(place, width, index);
                let way = lamp - y;
                let seen = pixel[0] / (40.0 * FRAC_1_PI * way.y / way.length().powi(3));
                // Beyond the edge there is more of the lamp the further to the right.
                let t = y.x * distance / (radius * y.z);
                error += (seen - beyond(-t)).abs() / (SIDE * SIDE) as f32;
                let step = &mut steps[((t + 2.0) * 16.0).clamp(0.0, 63.0) as usize];
                *step = (step.0 + seen, step.1 + 1);
            }
            let profile: Vec<_> = (0..64)
                .filter(|&i| steps[i].1 > 0)
                .map(|i| ((i as f32 + 0.5) / 16.0 - 2.0, steps[i].0 / steps[i].1 as f32))
                .collect();
            let found = crossing(&profile, 0.9) - crossing(&profile, 0.1);
            let exact: Vec<_> = (0..64).map(|i| i as f32 / 16.0 - 2.0).map(|t| (t, beyond(-t))).collect();
            let expected = crossing(&exact, 0.9) - crossing(&exact, 0.1);
            println!("{integrator}, {behind}: width {found} for {expected}, mean error {error}");
            assert!((found / expected - 1.0).abs() < 0.1, "{integrator}, {behind}: {found} for {expected}");
            assert!(error < 0.02, "{integrator}, {behind}: off by {error} on average");
        }
    }
}

/// Irradiance under the corner of a rectangle of radiance 1, parallel to the floor, of sides a and b times its height (Howell's catalogue of configuration
/// factors, B-3), times π.
fn under_corner(a: f32, b: f32) -> f32 {
    let (p, q) = ((1.0 + a * a).sqrt(), (1.0 + b * b).sqrt());
    0.5 * (a / p * (b / p).atan() + b / q * (a / q).atan())
}

/// Emissive triangles light surfaces directly, and as much as radiometry says: near a lamp and far from it.
#[test]
fn an_emissive_rectangle_gives_its_configuration_factor() {
    for height in [0.5f32, 1.0, 4.0] {
        let mut builder = Builder::default();
        // Facing down, of 1 × 2.
        builder.quad(Vec3::new(0.0, height, 0.0), Vec3::X, Vec3::Z * 2.0, 1);
        let scene = floor(builder, Vec::new());
        // Beside the lamp, so that the camera doesn't look through it.
        let place = Vec3::new(-0.8, 0.0, 1.0);
        for integrator in BOTH {
            let mut camera = above(place, 0.8);
            camera.position.y = camera.position.y.min(height * 4.0);
            let (image, _) = picture(&scene, &camera, &settings(integrator));
            for (index, pixel) in image.pixels().iter().enumerate() {
                let y = ground(place, 0.8 * camera.position.y / 2.0, index);
                // The rectangle from x = 0 to 1 is that from y.x to 1 less that from y.x to 0.
                let strip = |x: f32| {
                    let (x, z) = (x / height, [y.z / height, (2.0 - y.z) / height]);
                    under_corner(x, z[0]) + under_corner(x, z[1])
                };
                let expected = (strip(1.0 - y.x) - strip(-y.x)) * FRAC_1_PI;
                assert!(
                    (pixel[0] / expected - 1.0).abs() < 0.03,
                    "{integrator}, height {height}: {} for {expected} at {y}",
                    pixel[0]
                );
            }
        }
    }
}

/// The light of emissive triangles comes once: in a white furnace, whose walls shine with e and reflect ρ, all is e/(1 − ρ), with light from surfaces in whatever
/// form.
#[test]
fn no_light_is_counted_twice() {
    let mut builder = Builder::default();
    builder.cuboid(Vec3::ZERO, Vec3::ONE, true, 0);
    let walls = Material { emission: Vec3::splat(0.5), ..grey(0.5) };
    let mut scene = builder.scene(vec![walls], Vec::new(), Falloff::InverseSquare);
    let camera = Camera::look_at(Vec3::new(0.5, 0.5, 0.9), Vec3::new(0.4, 0.45, 0.0)).with_fov(60.0);
    for form in [IndirectForm::Surface, IndirectForm::Directional] {
        let mut settings = settings(Integrator::LightMesh);
        settings.mesh.indirect = Some(IndirectSettings { bounces: 32, form, ..IndirectSettings::default() });
        let (image, _) = picture(&scene, &camera, &settings);
        let mean = crate::common::mean(&image);
        assert!((mean - 1.0).abs() < 0.03, "{form}: {mean}");
    }
    // What a ball shows is not gathered either, for its light is the lamp's: the room is as bright with the ball's geometry as without.
    scene.materials[0] = grey(0.5);
    let lamp = Light::ball(Vec3::new(0.5, 0.8, 0.4), 0.05, Vec3::splat(0.2));
    scene.lights.push(lamp);
    let mut settings = settings(Integrator::Conventional);
    settings.mesh.indirect =
        Some(IndirectSettings { bounces: 16, form: IndirectForm::Surface, ..IndirectSettings::default() });
    let [without, with] = [false, true].map(|seen| {
        if seen {
            scene.add_ball(lamp.position, 0.05, lamp.intensity);
        }
        let camera = Camera::look_at(Vec3::new(0.5, 0.5, 0.9), Vec3::new(0.5, 0.0, 0.3)).with_fov(40.0);
        crate::common::mean(&picture(&scene, &camera, &settings).0)
    });
    assert!((with / without - 1.0).abs() < 0.03, "{with} with the ball, {without} without");
}

/// A ball whose middle is level with an edge's top, seen by mesh points through random places on it: the light mesh's picture is that of the
/// conventional tracer, whose rays it saves.
#[test]
fn light_meshes_know_how_much_of_a_lamp_is_seen() {
    let mut builder = Builder::default();
    builder.cuboid(Vec3::new(-0.6, 0.4, -0.6), Vec3::new(0.6, 0.6, 0.6), false, 0);
    let lamps = [(-1.5, 0.3), (0.2, 0.15), (1.4, 0.6)];
    let lights = lamps.map(|(x, radius)| Light::ball(Vec3::new(x, 2.5, 0.7), radius, Vec3::splat(4.0)));
    let scene = floor(builder, lights.to_vec());
    let camera = Camera::look_at(Vec3::new(0.0, 2.2, 4.0), Vec3::new(0.0, 0.2, 0.0)).with_fov(45.0);
    let [(exact, all), (mesh, some)] = BOTH.map(|integrator| picture(&scene, &camera, &settings(integrator)));
    let difference = |a: &Image, b: &Image| {
        let pairs = a.pixels().iter().zip(b.pixels());
        pairs.map(|(a, b)| f64::from((a[0] - b[0]).abs())).sum::<f64>() / f64::from(SIDE * SIDE)
    };
    let off = difference(&mesh, &exact) / crate::common::mean(&exact);
    assert!(off < 0.01, "off by {off} of the mean");
    assert!(some.rays.shadow < all.rays.shadow, "{} of {} rays", some.rays.shadow, all.rays.shadow);
}

/// A session whose settings take emissive triangles for lights, or leave their light to the mesh of indirect light, starts its direct mesh anew.
#[test]
fn a_session_knows_which_lights_its_mesh_has_seen() {
    let mut builder = Builder::default();
    builder.quad(Vec3::new(-0.5, 2.0, -0.5), Vec3::X, Vec3::Z, 1);
    let scene = floor(builder, vec![light(Vec3::new(1.0, 1.0, 1.0), Vec3::ONE)]);
    let camera = Camera::look_at(Vec3::new(0.0, 2.0, 4.0), Vec3::ZERO);
    let mut session = session(&scene);
    for lambertian in [true, false, true] {
        let mut settings = settings(Integrator::LightMesh);
        settings.shading.lambertian = lambertian;
        let (image, _) = session.render(&camera, &settings).expect("a picture");
        assert_eq!(image, picture(&scene, &camera, &settings).0, "lambertian {lambertian}");
    }
}
