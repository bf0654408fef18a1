//! Edges within pixels: of surfaces and of shadows.

use glam::{Vec2, Vec3};
use lightmesh::image::Image;
use lightmesh::scene::{Camera, CameraRays, Falloff, Light, Material, Scene};
use lightmesh::settings::{Integrator, Resolve, Settings, Spacing};

use crate::common::{Builder, camera, grey, light, picture, settings_at};

const SIDE: u32 = 96;

fn settings() -> Settings {
    let mut settings = settings_at((SIDE, SIDE));
    settings.view.samples_per_pixel = 16;
    settings
}

/// A view straight down from 10 above the floor y = 0.
fn above() -> Camera {
    camera(Vec3::Y * 10.0, Vec3::ZERO, 40.0).with_up(Vec3::NEG_Z)
}

/// The red of a pixel.
fn at(image: &Image, x: u32, y: u32) -> f32 {
    image.pixels()[(y * SIDE + x) as usize][0]
}

/// Share of a pixel's area where the floor lies beyond an edge, which leads along (cos, sin) in x and z through a point: by 64 × 64 samples where it crosses the
/// pixel.
fn coverage(camera: &Camera, x: u32, y: u32, height: f32, edge: (Vec2, f32)) -> f32 {
    const FINE: u32 = 64;
    let rays = CameraRays::new(camera, (SIDE * FINE, SIDE * FINE), 1);
    let (normal, distance) = edge;
    let beyond = |i: u32, j: u32| {
        let ray = rays.ray(x * FINE + i, y * FINE + j, 0);
        let at = ray.origin + ray.direction * ((height - ray.origin.y) / ray.direction.y);
        normal.dot(Vec2::new(at.x, at.z)) > distance
    };
    let last = FINE - 1;
    let corners = [(0, last), (last, 0), (last, last)];
    if corners.iter().all(|&(i, j)| beyond(i, j) == beyond(0, 0)) {
        return f32::from(u8::from(beyond(0, 0)));
    }
    let part = (0..FINE * FINE).filter(|i| beyond(i % FINE, i / FINE)).count();
    part as f32 / (FINE * FINE) as f32
}

/// A large floor, with a half plane of another material at a height above it, beyond an edge.
fn floor_and_half_plane(
    height: f32,
    edge: (Vec2, f32),
    materials: Vec<Material>,
    lights: Vec<Light>,
) -> Scene {
    let (normal, distance) = edge;
    let mut builder = Builder::default();
    builder.quad(Vec3::new(-20.0, 0.0, -20.0), Vec3::Z * 40.0, Vec3::X * 40.0, 0);
    let out = Vec3::new(normal.x, 0.0, normal.y);
    let along = Vec3::new(-normal.y, 0.0, normal.x);
    let corner = out * distance + along * 20.0 + Vec3::Y * height;
    builder.quad(corner, out * 40.0, along * -40.0, 1);
    builder.scene(materials, lights, Falloff::None)
}

/// A slanted edge between two brightnesses shows as the area on each side of it, to within a sixteenth, or
/// one and a half where that is all there is, whatever the contrast: it has no dots.
#[test]
fn slanted_edges_have_their_exact_coverage() {
    let shining = |radiance: f32| Material { emission: Vec3::splat(radiance), ..grey(0.0) };
    for (angle, distance) in [(0.1f32, 0.3), (0.6, -0.4), (1.5, 0.21), (2.3, 0.0)] {
        let edge = (Vec2::from_angle(angle), distance);
        for contrast in [2.0, 1000.0] {
            for height in [0.0001, 0.5] {
                let scene =
                    floor_and_half_plane(height, edge, vec![shining(1.0), shining(contrast)], Vec::new());
                let (image, _) = picture(&scene, &above(), &settings());
                for y in 0..SIDE {
                    for x in 0..SIDE {
                        let found = (at(&image, x, y) - 1.0) / (contrast - 1.0);
                        let exact = coverage(&above(), x, y, height, edge);
                        let error = (found - exact).abs();
                        // Where sixteen samples see one side only, there are no more.
                        let bound = if found > 0.0 && found < 1.0 { 0.064 } else { 1.5 / 16.0 };
                        assert!(error <= bound, "{found} for {exact} at {x},{y}: {angle}, {contrast}");
                    }
                }
            }
        }
    }
}

/// The edge of a shadow is as smooth as that of a surface, at the borders of tiles too, for a few rays more than pixels have lights.
#[test]
fn edges_of_shadows_are_smooth() {
    let lamp = Vec3::new(0.5, 30.0, 0.2);
    for (angle, distance) in [(0.05f32, 0.55), (0.6, -0.4), (1.54, 0.5)] {
        let edge = (Vec2::from_angle(angle), distance);
        // The occluder is a half plane close below the lamp, far above the camera: its edge's shadow is the line that rays from the lamp along it meet.
        let height = 15.0;
        let onto_floor = lamp.y / (lamp.y - height);
        let foot = Vec2::new(lamp.x, lamp.z);
        let shadow = (edge.0, edge.0.dot(foot) + (edge.1 - edge.0.dot(foot)) * onto_floor);
        let materials = || vec![grey(0.8), grey(0.8)];
        let lights = || vec![light(lamp, Vec3::ONE)];
        let scene = floor_and_half_plane(height, edge, materials(), lights());
        let open = floor_and_half_plane(height, (edge.0, 1e3), materials(), lights());
        for (integrator, resolve) in
            [(Integrator::Conventional, Resolve::Average), (Integrator::LightMesh, Resolve::Trace)]
        {
            let mut settings = settings();
            settings.shading.integrator = integrator;
            settings.shading.resolve = resolve;
            settings.mesh.direct.spacing = Spacing::Units(Vec3::splat(1.0));
            let (image, stats) = picture(&scene, &above(), &settings);
            let (lit, _) = picture(&open, &above(), &settings);
            let mut mixed = 0;
            for y in 0..SIDE {
                for x in 0..SIDE {
                    let found = at(&image, x, y) / at(&lit, x, y);
                    let exact = 1.0 - coverage(&above(), x, y, 0.0, shadow);
                    mixed += u32::from(exact > 0.1 && exact < 0.9);
                    let error = (found - exact).abs();
                    assert!(error <= 0.125, "{integrator}: {found} for {exact} at {x},{y}: {angle}");
                }
            }
            assert!(mixed > SIDE / 2, "{mixed} pixels of the edge");
            let rays = stats.rays.shadow;
            assert!(rays < u64::from(2 * SIDE * SIDE), "{integrator}: {rays} shadow rays");
        }
    }
}
