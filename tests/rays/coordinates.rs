//! Coordinates far from the origin, and details in huge scenes: no acne, no gaps.

use std::ops::Range;

use glam::Vec3;
use lightmesh::accel::{Backend, BackendChoice};
use lightmesh::image::Image;
use lightmesh::render::render;
use lightmesh::scene::{Camera, Falloff, Scene};
use lightmesh::settings::{Integrator, Resolve, Spacing};

use crate::common::failed::assert_images;
use crate::common::{Builder, backend_if_installed, camera, grey, light, settings_at};

const RESOLUTION: (u32, u32) = (96, 72);

/// Blocks and a slanted roof on a floor, 64 units wide, moved by `shift`. All coordinates are multiples of 1/64: exact
/// up to 131,072 units from the origin.
fn yard(shift: Vec3, floor: f32) -> (Scene, Camera) {
    let mut builder = Builder::default();
    let at = |x: f32, y: f32, z: f32| Vec3::new(x, y, z) + shift;
    builder.quad(at(-floor / 2.0, 0.0, -floor / 2.0), Vec3::Z * floor, Vec3::X * floor, 0);
    builder.cuboid(at(-20.0, 0.0, -8.0), at(-8.0, 10.0, 4.0), false, 0);
    builder.cuboid(at(4.0, 0.0, -16.0), at(12.0, 6.0, -4.0), false, 0);
    builder.cuboid(at(6.0, 6.0, -12.0), at(9.0, 12.0, -8.0), false, 0);
    builder.quad(at(8.0, 8.0, 4.0), Vec3::new(12.0, 4.0, 0.0), Vec3::new(0.0, 2.0, -10.0), 0);
    let lights = vec![light(at(24.0, 40.0, 30.0), Vec3::splat(40.0))];
    let scene = builder.scene(vec![grey(0.8)], lights, Falloff::Linear { constant: 1.0 });
    let camera = camera(at(10.0, 28.0, 56.0), at(0.0, 2.0, -2.0), 45.0);
    (scene, camera)
}

fn backends(scene: &Scene) -> Vec<Backend> {
    [BackendChoice::Embree, BackendChoice::Bvh]
        .into_iter()
        .filter_map(|choice| backend_if_installed(choice, scene))
        .collect()
}

/// The largest relative difference at pixels around which, `margin` pixels wide, the reference has no edge: no value that
/// is off by more than a quarter from the middle's, within some rows. There is one light, so that shadows are black: among those pixels are
/// black ones, where any light counts as a difference of 1. Also how many such pixels there are, lit and black.
fn largest_difference(image: &Image, reference: &Image, margin: u32, rows: Range<u32>) -> (f32, [usize; 2]) {
    let width = reference.width();
    let at = |image: &Image, x: u32, y: u32| image.pixels()[(y * width + x) as usize][0];
    let (mut largest, mut count) = (0.0f32, [0; 2]);
    for (x, y) in rows.flat_map(|y| (margin..width - margin).map(move |x| (x, y))) {
        let middle = at(reference, x, y);
        let mut around =
            (y - margin..=y + margin).flat_map(|y| (x - margin..=x + margin).map(move |x| (x, y)));
        if around.all(|(x, y)| (at(reference, x, y) - middle).abs() <= 0.25 * middle) {
            let value = at(image, x, y);
            largest = largest.max((value - middle).abs() / value.max(middle).max(f32::MIN_POSITIVE));
            count[usize::from(middle == 0.0)] += 1;
        }
    }
    (largest, count)
}

/// Rays leave a surface at the hit's error bound, 32 ε times the coordinates: 0.04 and 0.4 units at distances of 10⁴ and
/// 10⁵, up to half a pixel. So shadow edges and the feet of the blocks may move by a pixel, but away from edges the
/// picture is that at the origin, to within the change of distances and cosines by that offset (0.4 of at least 25 units).
/// Acne would show as dark pixels in the lit ones, gaps as light in the shadows.
#[test]
fn a_scene_far_from_the_origin_looks_as_it_does_there() {
    let mut settings = settings_at(RESOLUTION);
    settings.mesh.direct.spacing = Spacing::Units(Vec3::splat(2.0));
    settings.shading.resolve = Resolve::Trace;
    for integrator in [Integrator::Conventional, Integrator::LightMesh] {
        settings.shading.integrator = integrator;
        let (scene, camera) = yard(Vec3::ZERO, 64.0);
        for (number, backend) in backends(&scene).iter().enumerate() {
            let reference = render(backend, &scene, &camera, &settings).unwrap().0;
            for distance in [1e4f32, 1e5] {
                // Whole multiples of the spacing: the mesh points move along.
                let (scene, camera) = yard(Vec3::new(distance, 0.5 * distance, -distance), 64.0);
                let backend = &backends(&scene)[number];
                let far = render(backend, &scene, &camera, &settings).unwrap().0;
                let (difference, count) = largest_difference(&far, &reference, 2, 2..RESOLUTION.1 - 2);
                assert!(count[0] > 1500 && count[1] > 50, "only {count:?} pixels are away from edges");
                let allowed = 2.0 * 32.0 * f32::EPSILON * distance / 25.0 + 1e-3;
                let name = backend.name();
                let problem = format!("{name}, {integrator:?}, {distance}: {difference} > {allowed}");
                assert_images(difference <= allowed, &far, &reference, problem);
            }
        }
    }
}

/// A floor of 4,300 units under blocks of 6 to 12 units: the offset of rays grows with the floor's triangles to
/// 32 ε · (64 + 4,300) = 0.02 units, a thirtieth of a pixel. The picture is that with a small floor, up to single pixels
/// on edges; the upper third, in which the small floor ends, is left out.
#[test]
fn details_of_a_huge_scene_look_as_in_a_small_one() {
    let mut settings = settings_at(RESOLUTION);
    settings.shading.integrator = Integrator::Conventional;
    let (small, camera) = yard(Vec3::ZERO, 256.0);
    let (huge, _) = yard(Vec3::ZERO, 4300.0);
    for (of_small, of_huge) in backends(&small).iter().zip(&backends(&huge)) {
        let reference = render(of_small, &small, &camera, &settings).unwrap().0;
        let image = render(of_huge, &huge, &camera, &settings).unwrap().0;
        let (difference, count) =
            largest_difference(&image, &reference, 1, RESOLUTION.1 / 3..RESOLUTION.1 - 1);
        assert!(count[0] > 1500 && count[1] > 50, "only {count:?} pixels are away from edges");
        let problem = format!("{}: {difference}", of_huge.name());
        assert_images(difference <= 1e-3, &image, &reference, problem);
    }
}
