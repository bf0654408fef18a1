//! Instances are an economy of memory, not a different scene.

use std::sync::Arc;

use glam::{Affine3A, Mat3, Vec3};
use lightmesh::accel::{Backend, BackendChoice};
use lightmesh::image::Image;
use lightmesh::render::render;
use lightmesh::scene::{Falloff, Instance, Positions, Scene, TriangleMesh};
use lightmesh::settings::{Integrator, Resolve, Spacing};

use crate::common::failed::assert_images;
use crate::common::{Builder, backend_if_installed, camera, grey, light, settings_at};

/// Placements that are exact in single precision: a turn, a mirror image, scales of both kinds, and all at once.
fn placements() -> Vec<Affine3A> {
    let turn = Mat3::from_cols(Vec3::NEG_Z, Vec3::Y, Vec3::X);
    let part = |matrix: Mat3, x: f32, z: f32| Affine3A::from_mat3_translation(matrix, Vec3::new(x, 0.0, z));
    vec![
        part(turn, -3.0, 0.0),
        part(Mat3::from_diagonal(Vec3::new(-1.0, 1.0, 1.0)), 0.0, 0.0),
        part(Mat3::from_diagonal(Vec3::splat(2.0)), 3.5, -1.0),
        part(turn * Mat3::from_diagonal(Vec3::new(0.5, 1.5, -1.0)), -1.0, 2.5),
    ]
}

/// A floor, and a small building without symmetry on it, placed by `placements`.
fn instanced() -> Scene {
    let mut floor = Builder::default();
    floor.quad(Vec3::new(-8.0, 0.0, -8.0), Vec3::Z * 16.0, Vec3::X * 16.0, 0);
    let lights = vec![
        light(Vec3::new(3.25, 7.0, 4.5), Vec3::splat(9.0)),
        light(Vec3::new(-6.5, 3.0, 1.25), Vec3::ONE),
    ];
    let mut scene = floor.scene(vec![grey(0.8)], lights, Falloff::Linear { constant: 1.0 });
    let mut building = Builder::default();
    building.cuboid(Vec3::new(-0.5, 0.25, -0.25), Vec3::new(0.75, 1.0, 0.5), false, 0);
    building.cuboid(Vec3::new(-0.25, 1.0, -0.25), Vec3::new(0.0, 1.75, 0.25), false, 0);
    building.triangle([Vec3::new(0.75, 1.0, 0.5), Vec3::new(1.25, 1.5, 0.0), Vec3::new(0.0, 1.25, 1.0)], 0);
    scene.meshes.extend(building.scene(Vec::new(), Vec::new(), Falloff::None).meshes);
    scene.instances.extend(placements().into_iter().map(|place| Instance { mesh: 1, to_world: Some(place) }));
    scene
}

/// The same triangles, each in its place. A mirrored triangle's corners change their order: its front stays its front.
fn flattened(scene: &Scene) -> Scene {
    let flat = |instance: &Instance| {
        let mesh = &scene.meshes[instance.mesh as usize];
        let Some(place) = instance.to_world else { return mesh.clone() };
        let positions = mesh.positions.as_slice().iter();
        let positions = positions.map(|&p| place.transform_point3(p.into()).to_array()).collect();
        let mirrored = place.matrix3.determinant() < 0.0;
        let turned = |&[a, b, c]: &[u32; 3]| if mirrored { [a, c, b] } else { [a, b, c] };
        Arc::new(TriangleMesh {
            positions: Positions::new(positions),
            triangles: Arc::new(mesh.triangles.iter().map(turned).collect()),
            ..(**mesh).clone()
        })
    };
    let meshes: Vec<_> = scene.instances.iter().map(flat).collect();
    let instances = (0..meshes.len() as u32).map(|mesh| Instance { mesh, to_world: None }).collect();
    Scene { meshes, instances, ..scene.clone() }
}

/// Where a ray passes an edge nearer than rounding, it may fall to either side. Rounding is about 1e-5 of the scene,
/// a pixel is 1e-2 of it: that happens to one in a thousand of the pixels on edges, and those are not the half of all.
/// Everywhere else, values differ by the rounding of positions and normals.
fn assert_same(flat: &Image, instanced: &Image, what: &str) {
    let apart =
        |(a, b): (&[f32; 3], &[f32; 3])| (0..3).any(|c| (a[c] - b[c]).abs() > 1e-4 * a[c].max(b[c]).max(0.1));
    let differing = flat.pixels().iter().zip(instanced.pixels()).filter(|&pair| apart(pair)).count();
    let (few, all) = (2000 * differing <= flat.pixels().len(), flat.pixels().len());
    assert_images(few, instanced, flat, format_args!("{what}: {differing} of {all} pixels"));
}

/// With every backend, an instanced scene and its flattened copy give the same picture: placed by a turn, mirrored, scaled,
/// scaled differently along the axes. Shadow edges are traced, so that a mesh point on an edge, which may fall to
/// either side, does not spread to the pixels around it.
#[test]
fn instanced_and_flattened_give_the_same_picture_on_every_backend() {
    let scene = instanced();
    let flat = flattened(&scene);
    let camera = camera(Vec3::new(1.5, 5.0, 9.0), Vec3::new(0.0, 0.5, 0.0), 50.0);
    let mut settings = settings_at((96, 72));
    settings.mesh.direct.spacing = Spacing::Units(Vec3::splat(0.5));
    settings.shading.resolve = Resolve::Trace;
    for choice in [BackendChoice::Embree, BackendChoice::Bvh, BackendChoice::BruteForce] {
        let of = |scene: &Scene| backend_if_installed(choice, scene);
        let (Some(of_instanced), Some(of_flat)) = (of(&scene), of(&flat)) else { continue };
        for integrator in [Integrator::Conventional, Integrator::LightMesh] {
            settings.shading.integrator = integrator;
            let of = |backend: &Backend, scene: &Scene| render(backend, scene, &camera, &settings).unwrap().0;
            assert_same(
                &of(&of_flat, &flat),
                &of(&of_instanced, &scene),
                &format!("{choice:?}, {integrator:?}"),
            );
        }
    }
}
