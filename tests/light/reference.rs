//! The integrator `reference` gives the mean of eq. (3) that is known analytically, and light meshes converge to it.

use std::sync::Arc;

use glam::Vec3;
use lightmesh::accel::{Backend, BackendChoice};
use lightmesh::image::Image;
use lightmesh::render::render;
use lightmesh::scene::{
    Camera, Falloff, Instance, Light, Material, Positions, Scene, TriangleMaterials, TriangleMesh,
};
use lightmesh::settings::{
    Estimator, Integrator, KernelSettings, Leaks, Neighbourhood, Radius, Settings, Spacing,
};

use crate::common::{Builder, grey, light, mean};

const LIGHT: Vec3 = Vec3::new(0.0, 10.0, 0.0);
const EYE: Vec3 = Vec3::new(0.0, 4.0, 0.0);
const FIELD_OF_VIEW: f32 = 40.0;
const SIDE: u32 = 24;
const RADIUS: f32 = 1.0;

/// A rectangle at height `y`, facing up.
fn rectangle(y: f32, x: (f32, f32), z: (f32, f32)) -> Arc<TriangleMesh> {
    Arc::new(TriangleMesh {
        name: String::new(),
        positions: Positions::new(vec![[x.0, y, z.0], [x.0, y, z.1], [x.1, y, z.1], [x.1, y, z.0]]),
        triangles: Arc::new(vec![[0, 1, 2], [0, 2, 3]]),
        normals: None,
        uvs: None,
        colors: None,
        materials: TriangleMaterials::Uniform(0),
    })
}

/// White ground in the shadow of a half-plane at height 5 that ends at x = 0, under one light straight above the edge.
fn half_plane() -> Scene {
    Scene {
        meshes: vec![
            rectangle(0.0, (-30.0, 30.0), (-30.0, 30.0)),
            rectangle(5.0, (-40.0, 0.0), (-40.0, 40.0)),
        ],
        instances: vec![Instance { mesh: 0, to_world: None }, Instance { mesh: 1, to_world: None }],
        materials: vec![Material { diffuse: Vec3::ONE, ..Material::default() }],
        lights: vec![Light::point(LIGHT, Vec3::ONE)],
        falloff: Falloff::None,
        ..Scene::default()
    }
}

/// Looks straight down from below the half-plane.
fn camera() -> Camera {
    Camera {
        name: String::new(),
        position: EYE,
        look_at: Vec3::ZERO,
        up: Vec3::Z,
        vertical_fov: FIELD_OF_VIEW,
    }
}

fn settings(integrator: Integrator, neighbourhood: Neighbourhood, spacing: f32) -> Settings {
    let mut settings = Settings::default();
    settings.view.resolution = (SIDE, SIDE);
    settings.mesh.direct.spacing = Spacing::Units(Vec3::splat(spacing));
    settings.shading.integrator = integrator;
    settings.shading.reference_samples = 1024;
    settings.shading.kernel = KernelSettings {
        radius: Radius::Units(RADIUS),
        neighbourhood,
        leaks: Leaks::Allow,
        ..KernelSettings::default()
    };
    settings
}

fn picture(settings: &Settings) -> Image {
    let scene = half_plane();
    let backend = Backend::build(BackendChoice::BruteForce, &scene).expect("a small scene").backend;
    render(&backend, &scene, &camera(), settings).expect("a modest mesh").0
}

/// Ground point of a pixel's centre: the view's right is −x, its down −z.
fn ground(column: usize, row: usize) -> Vec3 {
    let pixel = 2.0 * EYE.y * (FIELD_OF_VIEW / 2.0).to_radians().tan() / SIDE as f32;
    let middle = SIDE as f32 / 2.0;
    Vec3::new(middle - (column as f32 + 0.5), 0.0, middle - (row as f32 + 0.5)) * pixel
}

/// The shadow's plane is vertical, so that the visible share of the half ball over a ground point at distance s of the
/// edge is that of the whole ball: (2 + 3t − t³)/4 with t = s/R (method §13), whatever the height of the occluder.
#[test]
fn the_penumbra_of_an_edge_has_its_analytic_profile() {
    let image = picture(&settings(Integrator::Reference, Neighbourhood::Sphere, 0.5));
    let mut penumbra = 0;
    for (index, pixel) in image.pixels().iter().enumerate() {
        let y = ground(index % SIDE as usize, index / SIDE as usize);
        let t = (y.x / RADIUS).clamp(-1.0, 1.0);
        penumbra += u32::from(t.abs() < 1.0);
        let visible = (2.0 + 3.0 * t - t.powi(3)) / 4.0;
        let cosine = LIGHT.y / (LIGHT - y).length();
        assert!(
            (pixel[0] - visible * cosine).abs() < 0.03,
            "{} at {y} instead of {}",
            pixel[0],
            visible * cosine
        );
    }
    assert!(penumbra > SIDE * SIDE / 2, "most of the picture is penumbra");
}

/// With R fixed, the light mesh's own error falls with every finer spacing, at the least by half over two
/// halvings: more points make a better mean.
#[test]
fn light_meshes_converge_to_the_reference() {
    let reference = picture(&settings(Integrator::Reference, Neighbourhood::SmoothSphere, 0.5));
    let errors = [0.6, 0.3, 0.15].map(|spacing| {
        let image = picture(&settings(Integrator::LightMesh, Neighbourhood::SmoothSphere, spacing));
        let squares = image.pixels().iter().zip(reference.pixels()).map(|(a, b)| (a[0] - b[0]).powi(2));
        (squares.sum::<f32>() / image.pixels().len() as f32).sqrt()
    });
    assert!(errors[0] > errors[1] && errors[1] > errors[2], "{errors:?}");
    assert!(errors[2] < 0.5 * errors[0], "{errors:?}");
}

/// At infinite density the nearest mesh point is the surface point itself: hard shadows.
#[test]
fn the_nearest_point_of_an_infinite_mesh_is_the_surface_point() {
    let reference = picture(&settings(Integrator::Reference, Neighbourhood::Nearest, 0.5));
    let conventional = picture(&settings(Integrator::Conventional, Neighbourhood::Nearest, 0.5));
    assert_eq!(reference, conventional);
}

/// Two closed rooms with a thin wall between them, lamps in the left one, seen at the foot of the wall from either side: mesh
/// points on one side of it know nothing of the other.
fn rooms() -> (Scene, [Camera; 2]) {
    let mut builder = Builder::default();
    builder.cuboid(Vec3::ZERO, Vec3::new(8.1, 3.0, 4.0), true, 0);
    builder.cuboid(Vec3::new(4.0, 0.0, 0.0), Vec3::new(4.1, 3.0, 4.0), false, 0);
    let lights = vec![
        light(Vec3::new(1.5, 2.4, 2.0), Vec3::splat(10.0)),
        light(Vec3::new(2.4, 2.2, 3.2), Vec3::splat(6.0)),
    ];
    let scene = builder.scene(vec![grey(0.7)], lights, Falloff::InverseSquare);
    let bright = Camera::look_at(Vec3::new(2.2, 1.6, 2.4), Vec3::new(3.8, 0.0, 2.0)).with_fov(60.0);
    let dark = Camera::look_at(Vec3::new(5.6, 1.4, 2.0), Vec3::new(4.3, 0.0, 2.0)).with_fov(60.0);
    (scene, [bright, dark])
}

/// A screen without thickness on the ground. Twelve lamps stand in its plane and are seen from both of its sides, three strong ones on one side
/// only: the points of both sides share four fifths of their lamps, so that no rule asks which of them a surface point sees,
/// and light leaks around the foot of the screen, in the mesh as in the reference.
fn screen() -> (Scene, [Camera; 2]) {
    let mut builder = Builder::default();
    builder.quad(Vec3::new(-4.0, 0.0, -4.0), Vec3::Z * 8.0, Vec3::X * 8.0, 0);
    builder.quad(Vec3::new(0.0, 0.0, -3.0), Vec3::Z * 6.0, Vec3::Y * 1.5, 0);
    let in_plane = (0..12).map(|i| light(Vec3::new(0.0, 3.0, i as f32 / 4.0 - 1.375), Vec3::splat(0.5)));
    let beside = (0..3).map(|i| light(Vec3::new(3.0, 1.0, i as f32 - 1.0), Vec3::splat(40.0)));
    let scene = builder.scene(vec![grey(0.7)], in_plane.chain(beside).collect(), Falloff::InverseSquare);
    let lit = Camera::look_at(Vec3::new(1.2, 1.2, 0.3), Vec3::new(0.2, 0.0, 0.0)).with_fov(40.0);
    let shaded = Camera::look_at(Vec3::new(-1.2, 1.2, 0.3), Vec3::new(-0.2, 0.0, 0.0)).with_fov(40.0);
    (scene, [lit, shaded])
}

/// The reference is the limit of the light mesh whatever keeps light from leaking: with the same rule, a mesh of four hundred
/// points per neighbourhood is within a per cent of the lit view's mean. A rule of its own would show: one that drops what a surface point
/// doesn't see wherever any two points differ is off by twice the bound on the lit side of the screen.
#[test]
fn reference_and_dense_mesh_agree_under_every_leak_rule() {
    for (name, (scene, cameras)) in [("rooms", rooms()), ("screen", screen())] {
        let backend = Backend::build(BackendChoice::Bvh, &scene).expect("a small scene").backend;
        for estimator in [Estimator::PerLight, Estimator::Directional] {
            for leaks in [Leaks::Allow, Leaks::Invalidate, Leaks::Visibility] {
                let views = [0, 1].map(|view| {
                    [Integrator::LightMesh, Integrator::Reference].map(|integrator| {
                        let mut settings = settings(integrator, Neighbourhood::SmoothSphere, 0.08);
                        settings.shading.kernel.radius = Radius::Units(0.45);
                        settings.shading.kernel.leaks = leaks;
                        settings.shading.estimator = estimator;
                        settings.shading.reference_samples = 512;
                        render(&backend, &scene, &cameras[view], &settings).expect("a modest mesh").0
                    })
                });
                let scale = mean(&views[0][1]);
                for (view, [mesh, reference]) in views.iter().enumerate() {
                    let off = mean_difference(mesh, reference) / scale;
                    println!("{name}, view {view}, {estimator}, {leaks}: {off:.4}");
                    assert!(
                        off < 0.01,
                        "{name}, view {view}, {estimator}, {leaks}: off by {off} of the lit view's mean"
                    );
                }
            }
        }
    }
}

fn mean_difference(a: &Image, b: &Image) -> f64 {
    let pairs = a.pixels().iter().zip(b.pixels());
    pairs.map(|(a, b)| f64::from(a[0] - b[0]).abs()).sum::<f64>() / a.pixels().len() as f64
}
