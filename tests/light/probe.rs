//! What probes measure is what formulas say, and what the renderer lights surfaces with.

use std::f32::consts::PI;

use glam::{UVec3, Vec3};
use lightmesh::Bounds;
use lightmesh::probe::{
    COSINE_FACTORS, Plane, Probe, ProbeGrid, ProbeSettings, Unit, basis, line, measure, measure_harmonics,
};
use lightmesh::scene::{Camera, Falloff, Light, LightKind, Material, Scene};
use lightmesh::settings::{IndirectForm, IndirectSettings, Integrator, Settings};

use crate::common::{Builder, grey, light, picture, session, settings_at};

/// Lambertian reflectors and no light from surfaces.
fn direct() -> Settings {
    let mut settings = settings_at((8, 8));
    settings.shading.lambertian = true;
    settings
}

/// The same with light from surfaces over so many bounces.
fn with_bounces(bounces: u32) -> Settings {
    let form = IndirectForm::Surface;
    let indirect = IndirectSettings { bounces, tolerance: 1e-4, form, ..IndirectSettings::default() };
    let mut settings = direct();
    settings.mesh.indirect = Some(indirect);
    settings
}

fn probe(scene: &Scene, probes: &[Probe], settings: &Settings) -> Vec<Vec3> {
    measure(&session(scene), probes, settings, &ProbeSettings::default(), &|_| {}).expect("measured")
}

/// A plane of 4 by 4 at height 0 in the middle, facing up.
fn desk() -> Plane {
    let edges = [Vec3::X * 4.0, Vec3::NEG_Z * 4.0];
    Plane::new(Vec3::new(-2.0, 0.0, 2.0), edges, (16, 12)).expect("a plane")
}

/// Nothing but lights, and tiny triangles that give the scene a size.
fn free(lights: Vec<Light>) -> Scene {
    let mut builder = Builder::default();
    builder.stretch_bounds(Vec3::splat(-5.0), Vec3::splat(5.0));
    builder.scene(vec![grey(0.0)], lights, Falloff::InverseSquare)
}

fn assert_within(found: f32, expected: f32, share: f32, what: impl std::fmt::Debug) {
    assert!((found - expected).abs() <= share * expected.abs(), "{what:?}: {found} for {expected}");
}

/// A point gives I cos/r², and so does a ball that is above the horizon as a whole, wherever the plane is measured.
#[test]
fn a_plane_under_a_lamp_follows_the_inverse_square_of_the_distance() {
    let at = Vec3::new(0.7, 1.5, -0.4);
    let intensity = Vec3::new(5.0, 3.0, 1.0);
    let mut ball = free(vec![Light::ball(at, 0.3, intensity)]);
    ball.add_ball(at, 0.3, intensity);
    for scene in [free(vec![light(at, intensity)]), ball] {
        let probes = desk().probes();
        assert_eq!(probes.len(), 16 * 12);
        for (probe, light) in probes.iter().zip(probe(&scene, &probes, &direct())) {
            let way = at - probe.position;
            let expected = intensity * way.y / way.length().powi(3);
            (0..3).for_each(|channel| assert_within(light[channel], expected[channel], 0.01, probe.position));
            let lux = 683.0 * (0.2126 * expected.x + 0.7152 * expected.y + 0.0722 * expected.z);
            assert_within(Unit::WATT.lux(light), lux, 0.01, "lux");
        }
    }
}

/// A disc of radiance L and radius r at height h, parallel to the plane, gives πL/2 · (1 − (d² + h² − r²)/√((d² + h² + r²)² − 4 d² r²)) at a distance of d
/// from below its middle (the configuration factor of a disc).
#[test]
fn a_plane_under_a_disc_follows_its_configuration_factor() {
    // At three times its radius above the plane, and at half of it.
    for height in [1.5, 0.25] {
        disc_at(Vec3::new(0.2, height, 0.1));
    }
}

fn disc_at(at: Vec3) {
    let (radius, intensity) = (0.5f32, 4.0);
    let mut scene = free(Vec::new());
    scene.add_disc(at, Vec3::NEG_Y, radius, Vec3::splat(intensity));
    let probes = desk().probes();
    for (probe, light) in probes.iter().zip(probe(&scene, &probes, &direct())) {
        let way = at - probe.position;
        let (h2, d2, r2) = (way.y * way.y, way.x * way.x + way.z * way.z, radius * radius);
        let root = ((d2 + h2 + r2).powi(2) - 4.0 * d2 * r2).sqrt();
        let expected = 0.5 * intensity / r2 * (1.0 - (d2 + h2 - r2) / root);
        assert_within(light.x, expected, 0.01, probe.position);
    }
}

/// Behind an occluder it is dark; at the edge of the shadow of a half plane a ball is half hidden; and what lies on a floor is no more hidden by
/// that than what lies above it.
#[test]
fn occluders_cast_shadows() {
    let lamp = Vec3::new(0.0, 2.0, 0.0);
    for radius in [None, Some(0.1)] {
        let mut builder = Builder::default();
        // A half plane at height 1, from x = 0 on, and a floor.
        builder.quad(Vec3::new(0.0, 1.0, -10.0), Vec3::Z * 20.0, Vec3::X * 10.0, 0);
        builder.quad(Vec3::new(-5.0, 0.0, -5.0), Vec3::Z * 10.0, Vec3::X * 10.0, 0);
        let light = radius.map_or(light(lamp, Vec3::ONE), |radius| Light::ball(lamp, radius, Vec3::ONE));
        let scene = builder.scene(vec![grey(0.5)], vec![light], Falloff::InverseSquare);
        let at = |x: f32| Probe { position: Vec3::new(x, 0.0, 0.3), normal: Some(Vec3::Y) };
        let found = probe(&scene, &[at(1.0), at(-1.0), at(0.0)], &direct());
        let unoccluded = |x: f32| 2.0 / (x * x + 4.0 + 0.09f32).powf(1.5);
        assert_eq!(found[0], Vec3::ZERO);
        assert_within(found[1].x, unoccluded(1.0), 0.01, "in the light");
        if radius.is_some() {
            assert_within(found[2].x, 0.5 * unoccluded(0.0), 0.02, "at the edge");
        }
    }
}

/// Without a normal light counts alike from wherever it comes: Σ I/r², the direct light of eq. (1).
#[test]
fn fluence_is_the_direct_light_of_the_paper() {
    let lamps = [Vec3::new(0.0, 2.0, 0.0), Vec3::new(1.0, -3.0, 0.5), Vec3::new(-2.0, 0.0, 1.0)];
    let scene = free(lamps.iter().map(|&at| light(at, Vec3::new(1.0, 2.0, 3.0))).collect());
    let probes = line(Vec3::new(-1.0, 0.2, 0.1), Vec3::new(1.0, 0.4, 0.3), 5, None);
    let positions: Vec<Vec3> = probes.iter().map(|probe| probe.position).collect();
    assert!(positions[4].abs_diff_eq(Vec3::new(1.0, 0.4, 0.3), 1e-6));
    let found = probe(&scene, &probes, &direct());
    for ((found, by_session), x) in found.iter().zip(session(&scene).direct_light(&positions)).zip(positions)
    {
        let expected: f32 = lamps.iter().map(|at| 1.0 / at.distance_squared(x)).sum();
        assert_within(found.x, expected, 1e-4, x);
        assert!(found.abs_diff_eq(by_session, 1e-4 * found.x), "{found} and {by_session}");
    }
}

/// In a closed box whose walls emit e and reflect ρ, radiance is e/(1 − ρ) from everywhere: irradiance is π times that for every normal, fluence 4π
/// times, and harmonics are √4π times and eight times 0. The first bounce brings what surfaces emit, or where emissive surfaces are lights themselves
/// what they reflect of that.
#[test]
fn a_furnace_is_as_bright_in_all_directions() {
    let mut builder = Builder::default();
    builder.cuboid(Vec3::new(-1.0, -1.0, -1.0), Vec3::new(1.0, 1.5, 1.2), true, 0);
    let walls = Material { emission: Vec3::splat(0.7), ..grey(0.5) };
    let scene = builder.scene(vec![walls], Vec::new(), Falloff::InverseSquare);
    let position = Vec3::new(0.2, 0.1, -0.3);
    let probes =
        [None, Some(Vec3::Y), Some(Vec3::new(0.6, 0.0, -0.8))].map(|normal| Probe { position, normal });
    // Emissive walls are no lights where surfaces are not Lambertian: light from everywhere is gathered. It is over π then (method §12).
    for (lambertian, unit, orders) in [(true, PI, 1), (false, 1.0, 0)] {
        // Emissive walls are clusters of small lamps, and near (method §4).
        let tolerance = if lambertian { 0.03 } else { 0.02 };
        for bounces in [1, 2, 60] {
            let expected = 0.7 * (0..bounces + orders).map(|order| 0.5f32.powi(order as i32)).sum::<f32>();
            let mut settings = with_bounces(bounces);
            settings.shading.lambertian = lambertian;
            let found = probe(&scene, &probes, &settings);
            for (light, share) in found.iter().zip([4.0, 1.0, 1.0]) {
                assert_within(light.x, share * unit * expected, tolerance, (lambertian, bounces));
            }
            let how = ProbeSettings::default();
            let harmonics =
                measure_harmonics(&session(&scene), &[position], &settings, &how, &|_| {}).expect("measured");
            let constant = unit / PI * (4.0 * PI).sqrt() * expected;
            assert_within(harmonics[0][0].x, constant, tolerance, "harmonics");
            let others = harmonics[0][1..].iter().map(|value| value.x.abs()).fold(0.0, f32::max);
            assert!(others < 0.04 * constant, "{others} beside {constant}");
        }
    }
}

/// The background is a surface at infinity.
#[test]
fn the_background_is_gathered() {
    let mut scene = free(Vec::new());
    scene.background = Vec3::new(0.5, 1.0, 2.0);
    let up = Probe { position: Vec3::ZERO, normal: Some(Vec3::Y) };
    let all = Probe { normal: None, ..up };
    let found = probe(&scene, &[up, all], &with_bounces(16));
    assert_within(found[0].y, PI, 0.01, "irradiance");
    assert_within(found[1].z, 8.0 * PI, 0.01, "fluence");
    assert_eq!(probe(&scene, &[up], &direct()), [Vec3::ZERO], "none without light from surfaces");
}

/// A room with a box in it, a lamp below the ceiling, and coloured walls.
fn room() -> Scene {
    let mut builder = Builder::default();
    builder.cuboid(Vec3::ZERO, Vec3::new(3.0, 2.5, 3.0), true, 0);
    builder.quad(Vec3::new(0.01, 0.01, 0.01), Vec3::Y * 2.4, Vec3::Z * 2.9, 1);
    builder.cuboid(Vec3::new(2.1, 0.0, 0.6), Vec3::new(2.7, 1.0, 1.4), false, 0);
    let red = Material { diffuse: Vec3::new(0.7, 0.1, 0.1), ..Material::default() };
    let lamp = Light::point(Vec3::new(1.5, 2.2, 1.5), Vec3::new(4.0, 4.0, 3.0));
    builder.scene(vec![grey(0.6), red], vec![lamp], Falloff::InverseSquare)
}

/// A camera ray to a floor of albedo ρ brings ρ/π times what a probe there measures, all bounces included.
#[test]
fn the_renderer_lights_a_floor_with_what_a_probe_measures() {
    let scene = room();
    let mut settings = with_bounces(16);
    settings.shading.integrator = Integrator::Conventional;
    settings.view.resolution = (12, 12);
    // Straight down from below the ceiling: 2.4 · tan 22.5° are 0.994.
    let (eye, half) = (Vec3::new(1.0, 2.4, 1.7), 2.4 * 22.5f32.to_radians().tan());
    let camera: Camera = Camera::look_at(eye, eye - Vec3::Y).with_up(Vec3::NEG_Z).with_fov(45.0);
    let (image, _) = picture(&scene, &camera, &settings);
    let edges = [Vec3::X * 2.0 * half, Vec3::NEG_Z * 2.0 * half];
    let corner = Vec3::new(eye.x - half, 0.0, eye.z + half);
    let plane = Plane::new(corner, edges, (12, 12)).expect("a plane");
    let found = plane.image_order(&probe(&scene, &plane.probes(), &settings));
    let (mut sum, mut differences) = (Vec3::ZERO, Vec3::ZERO);
    for (pixel, irradiance) in image.pixels().iter().zip(found) {
        let (pixel, irradiance) = (Vec3::from(*pixel) * PI / 0.6, irradiance);
        assert!(((irradiance - pixel) / pixel).abs().max_element() < 0.1, "{irradiance} for {pixel}");
        sum += pixel;
        differences += irradiance - pixel;
    }
    assert!((differences / sum).abs().max_element() < 0.01, "{differences} of {sum}");
}

/// Readings are a function of place and settings: neither the threads nor the other probes leave a trace.
#[test]
fn threads_leave_no_trace() {
    let scene = room();
    let probes = Plane::new(Vec3::new(0.2, 0.5, 2.6), [Vec3::X * 2.0, Vec3::NEG_Z * 2.0], (9, 7));
    let probes = probes.expect("a plane").probes();
    let measured = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| probe(&scene, &probes, &with_bounces(4)))
    };
    let one = measured(1);
    let same_bits = |a: &[Vec3], b: &[Vec3]| {
        a.iter().zip(b).all(|(a, b)| a.to_array().map(f32::to_bits) == b.to_array().map(f32::to_bits))
    };
    assert!(same_bits(&one, &measured(3)));
    let alone = probe(&scene, &probes[..1], &direct());
    assert!(same_bits(&alone, &probe(&scene, &probes, &direct())));
}

/// Harmonics of a light at infinity are its irradiance times the basis at its direction, and they give a surface of any normal what the second-order
/// expansion of the cosine does.
#[test]
fn harmonics_of_a_distant_light_are_the_basis() {
    let direction = Vec3::new(2.0, -6.0, 3.0) / 7.0;
    let sun = Light {
        position: Vec3::ZERO,
        intensity: Vec3::new(1.0, 2.0, 3.0),
        kind: LightKind::Directional { direction },
    };
    let grid = ProbeGrid::in_box(Bounds { min: Vec3::ZERO, max: Vec3::ONE }, UVec3::new(2, 1, 3));
    let positions = grid.positions();
    assert_eq!(positions.len(), 6);
    assert!(positions[1].abs_diff_eq(Vec3::new(0.75, 0.5, 1.0 / 6.0), 1e-6), "x changes fastest");
    let session = session(&free(vec![sun]));
    let found = measure_harmonics(&session, &positions, &direct(), &ProbeSettings::default(), &|_| {})
        .expect("measured");
    // Y_lm at the direction that the light comes from, (x, y, z) = (−2, 6, −3)/7, from the table of real harmonics.
    let (x, y, z) = (-2.0 / 7.0, 6.0 / 7.0, -3.0 / 7.0f32);
    let expected = [
        0.5 * (1.0 / PI).sqrt(),
        (0.75 / PI).sqrt() * y,
        (0.75 / PI).sqrt() * z,
        (0.75 / PI).sqrt() * x,
        0.5 * (15.0 / PI).sqrt() * x * y,
        0.5 * (15.0 / PI).sqrt() * y * z,
        0.25 * (5.0 / PI).sqrt() * (3.0 * z * z - 1.0),
        0.5 * (15.0 / PI).sqrt() * x * z,
        0.25 * (15.0 / PI).sqrt() * (x * x - y * y),
    ];
    for coefficients in &found {
        for (value, expected) in coefficients.iter().zip(expected) {
            assert!(value.abs_diff_eq(Vec3::new(1.0, 2.0, 3.0) * expected, 1e-5), "{value} for {expected}");
        }
    }
    for normal in [Vec3::Y, Vec3::X, Vec3::new(-0.6, 0.8, 0.0)] {
        let weights = basis(normal);
        let irradiance: f32 = (0..9).map(|i| COSINE_FACTORS[i] * found[0][i].x * weights[i]).sum();
        let cosine = normal.dot(-direction);
        let expansion = 0.25 + 0.5 * cosine + 5.0 / 32.0 * (3.0 * cosine * cosine - 1.0);
        assert!((irradiance - expansion).abs() < 1e-5, "{irradiance} for {expansion}");
    }
}
