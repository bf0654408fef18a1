//! All backends give the same answers to inputs that no one means to give them: damaged geometry, placements that
//! can hardly be undone, numbers without bounds.

use std::sync::Arc;

use glam::{Affine3A, Mat3, Vec3};
use lightmesh::accel::{
    Accel, Backend, BackendChoice, Coherence, INVALID_ID, MAX_COORDINATE, MIN_DIRECTION, PacketLanes,
    RayHitPacket, hit_of_lane,
};
use lightmesh::crosscheck::{Options, Report, Subject, crosscheck};
use lightmesh::sampling::SplitMix64;
use lightmesh::scene::{Ray, Scene, TriangleMaterials, TriangleMesh};

use crate::common::backend_if_installed;
use crate::common::triangles::{HOLES, Random, mesh, scene, soup};

/// A right triangle at z = 0 with legs of length `size` along x and y.
fn corner(size: f32) -> Arc<TriangleMesh> {
    mesh(vec![[0.0; 3], [size, 0.0, 0.0], [0.0, size, 0.0]], vec![[0, 1, 2]], None)
}

/// Every backend that there is; where Embree is missing, that is said.
fn backends(scene: &Scene) -> Vec<Backend> {
    [BackendChoice::Embree, BackendChoice::Bvh, BackendChoice::BruteForce]
        .into_iter()
        .filter_map(|choice| backend_if_installed(choice, scene))
        .collect()
}

/// The cross-check of a scene with all backends.
fn report(scene: &Scene, rays: u64) -> Report {
    let backends = backends(scene);
    let subjects: Vec<_> =
        backends.iter().map(|backend| Subject { name: backend.name(), accel: backend }).collect();
    crosscheck(scene, &[], &subjects, &Options { rays, seed: 1 }, &|_| ())
}

fn assert_clean(name: &str, scene: &Scene) {
    let report = report(scene, 60_000);
    assert!(report.is_clean(), "{name}:\n{report}");
}

/// Nearest hit of a ray by every backend, single and in a packet, and occlusion beside it; all the same.
fn hit(scene: &Scene, ray: &Ray) -> Option<(u32, u32)> {
    let mut answers = Vec::new();
    for backend in backends(scene) {
        let single = backend.intersect(ray);
        let mut packet = RayHitPacket::<8>::empty();
        packet.set_lane(5, ray);
        let mut shadow = packet.ray;
        backend.intersect_packet(1 << 5, &mut packet, Coherence::Coherent);
        let blocked = backend.occluded_packet(1 << 5, &mut shadow, Coherence::Incoherent);
        let name = backend.name();
        assert_eq!(backend.occluded(ray), single.is_some(), "{name}, {ray:?}");
        assert_eq!(blocked != 0, single.is_some(), "{name}, packet, {ray:?}");
        assert_eq!(hit_of_lane(&packet, 5).map(|hit| hit.triangle), single.map(|hit| hit.triangle), "{name}");
        assert!(single.is_none_or(|hit| hit.t.is_finite() && hit.instance != INVALID_ID), "{name}, {ray:?}");
        answers.push(single.map(|hit| (hit.instance, hit.triangle)));
    }
    assert!(answers.windows(2).all(|pair| pair[0] == pair[1]), "{ray:?}: {answers:?}");
    answers[0]
}

#[test]
fn affine_and_mirrored_instances_are_answered_alike() {
    let mut random = SplitMix64::new(1);
    let mut instances = vec![(1, None)];
    for i in 0..12 {
        let mut axis = || random.in_box(Vec3::NEG_ONE, Vec3::ONE);
        let mut linear = Mat3::from_cols(axis(), axis(), axis()) + Mat3::IDENTITY;
        if i % 2 == 0 {
            linear *= Mat3::from_diagonal(Vec3::new(1.0, 1.0, -1.0));
        }
        instances.push((i % 2, Some(Affine3A::from_mat3_translation(0.5 * linear, 2.0 * axis()))));
    }
    assert_clean(
        "instances",
        &scene(
            vec![soup(&mut Random::new(2), 60, 0.3, None), soup(&mut Random::new(3), 40, 0.5, None)],
            instances,
        ),
    );
}

#[test]
fn alpha_masks_are_answered_alike() {
    let holes =
        TriangleMaterials::PerTriangle((0..150).map(|i| if i % 3 == 0 { 0 } else { HOLES }).collect());
    let meshes =
        vec![soup(&mut Random::new(4), 150, 0.5, Some(holes)), soup(&mut Random::new(5), 30, 0.3, None)];
    let mirrored = Affine3A::from_scale(Vec3::new(0.7, -1.2, 1.0));
    assert_clean("alpha masks", &scene(meshes, vec![(0, None), (1, None), (0, Some(mirrored))]));
}

/// From which flatness on an instance is left out is a rule that all backends share: 10⁻⁵ of a space, when three
/// perpendicular axes of equal length are 1.
#[test]
fn near_singular_placements_are_hit_by_all_backends_or_by_none() {
    let ray = Ray::new(Vec3::new(0.3, 0.3, 1.0), Vec3::NEG_Z);
    let leaning = |by: f32| {
        Affine3A::from_cols(Vec3::X.into(), Vec3::Y.into(), Vec3::new(1.0, 1.0, by).into(), Vec3::ZERO.into())
    };
    for (place, seen) in [
        (Affine3A::IDENTITY, true),
        // Thin, but perpendicular: nothing is lost in undoing that.
        (Affine3A::from_scale(Vec3::new(1.0, 1.0, 1e-6)), true),
        (leaning(1e-3), true),
        (leaning(1e-6), false),
        (leaning(0.0), false),
        (Affine3A::from_scale(Vec3::new(1.0, 1.0, 0.0)), false),
        (Affine3A::ZERO, false),
        (Affine3A::from_scale(Vec3::splat(1e-12)), false),
        (Affine3A::from_scale(Vec3::splat(f32::NAN)), false),
        (Affine3A::from_translation(Vec3::splat(f32::INFINITY)), false),
        (Affine3A::from_translation(Vec3::new(0.0, 0.0, 1e30)), false),
    ] {
        let scene = scene(vec![corner(1.0)], vec![(0, Some(place))]);
        assert_eq!(hit(&scene, &ray), seen.then_some((0, 0)), "{place:?}");
    }
    let places = [leaning(1e-3), Affine3A::from_scale(Vec3::new(1.0, 1e-3, -1.0)), leaning(1e-6)];
    let instances = places.map(|place| (0, Some(place))).into_iter().chain([(1, None)]).collect();
    assert_clean(
        "near-singular",
        &scene(
            vec![soup(&mut Random::new(6), 50, 0.4, None), soup(&mut Random::new(7), 50, 0.4, None)],
            instances,
        ),
    );
}

/// A coordinate that no ray tracer in single precision can work with costs its triangle, and no other.
#[test]
fn triangles_of_1e30_or_nan_are_left_out_by_all_backends() {
    let mut positions = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let mut triangles = vec![[0, 1, 2]];
    for value in [1e30, -1e30, f32::MAX, 1.01 * MAX_COORDINATE, f32::NAN, f32::INFINITY] {
        for axis in 0..3 {
            let first = positions.len() as u32;
            let mut far = [0.0, 1.0, 0.5];
            far[axis] = value;
            positions.extend([[0.0, 0.0, 0.5], [1.0, 0.0, 0.5], far]);
            triangles.push([first, first + 1, first + 2]);
        }
    }
    let damaged = mesh(positions, triangles, None);
    let down = Ray::new(Vec3::new(0.3, 0.3, 1.0), Vec3::NEG_Z);
    for to_world in [None, Some(Affine3A::IDENTITY), Some(Affine3A::from_scale(Vec3::new(-2.0, 2.0, 2.0)))] {
        let scene = scene(vec![damaged.clone()], vec![(0, to_world)]);
        let ray =
            Ray { origin: to_world.map_or(down.origin, |map| map.transform_point3(down.origin)), ..down };
        assert_eq!(hit(&scene, &ray), Some((0, 0)), "{to_world:?}");
        assert_eq!(hit(&scene, &Ray { t_far: 0.4, ..ray }), None, "{to_world:?}");
        let mut random = SplitMix64::new(8);
        for _ in 0..300 {
            let origin = random.in_box(Vec3::splat(-3.0), Vec3::splat(3.0));
            hit(&scene, &Ray::new(origin, random.in_box(Vec3::NEG_ONE, Vec3::ONE)));
        }
    }
}

/// NaN, infinite and zero-length rays hit nothing, and neither does what comes close to them; what is just short of
/// it does.
#[test]
fn rays_without_bounds_or_length_hit_nothing() {
    let scene =
        scene(vec![corner(100.0)], vec![(0, None), (0, Some(Affine3A::from_translation(Vec3::NEG_Z)))]);
    let good = Ray::new(Vec3::new(20.0, 30.0, 1.0), Vec3::NEG_Z);
    assert_eq!(hit(&scene, &good), Some((0, 0)));
    let mut bad = vec![
        Ray { direction: Vec3::ZERO, ..good },
        Ray { direction: -0.0 * Vec3::ONE, ..good },
        Ray { direction: Vec3::new(0.0, 0.0, -1e-42), ..good },
        Ray { direction: Vec3::new(0.0, 0.0, -0.9 * MIN_DIRECTION), ..good },
        Ray { t_near: f32::NAN, ..good },
        Ray { t_far: f32::NAN, ..good },
        Ray { t_far: -1.0, ..good },
        Ray { t_far: f32::NEG_INFINITY, ..good },
        Ray { t_near: 2.0, t_far: 1.5, ..good },
        Ray { t_near: f32::INFINITY, ..good },
        Ray::between(good.origin, good.origin),
    ];
    for axis in 0..3 {
        for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30, -f32::MAX] {
            let (mut origin, mut direction) = (good.origin, good.direction);
            origin[axis] = value;
            direction[axis] = value;
            bad.extend([Ray { origin, ..good }, Ray { direction, ..good }]);
        }
    }
    for ray in &bad {
        assert_eq!(hit(&scene, ray), None, "{ray:?}");
    }
    for ray in [
        Ray { direction: 2.0 * MIN_DIRECTION * Vec3::NEG_Z, ..good },
        Ray { direction: 1e15 * Vec3::NEG_Z, ..good },
        Ray { t_near: -5.0, ..good },
        Ray { t_near: f32::NEG_INFINITY, t_far: f32::MAX, ..good },
        // Components that are almost nothing beside one that is something.
        Ray { direction: Vec3::new(1e-45, -1e-30, -1.0), ..good },
    ] {
        assert_eq!(hit(&scene, &ray), Some((0, 0)), "{ray:?}");
    }
}

#[test]
fn scenes_of_nothing_one_triangle_or_degenerate_ones_are_answered_alike() {
    let point = [0.3; 3];
    let degenerate = mesh(
        vec![point, [0.1, 0.2, 0.3], [0.5, 0.6, 0.7], [0.9, 1.0, 1.1], [1e-42, 0.0, 0.0], [0.0, 1e-42, 0.0]],
        vec![[0, 0, 0], [0, 0, 1], [1, 2, 3], [4, 5, 4], [4, 5, 3]],
        None,
    );
    let nothing = mesh(vec![], vec![], None);
    let place = Some(Affine3A::from_rotation_y(0.5));
    for (name, scene) in [
        ("no mesh", Scene::default()),
        ("an empty mesh", scene(vec![nothing.clone()], vec![(0, None), (0, place)])),
        ("no instance", scene(vec![corner(1.0)], vec![])),
        ("one triangle", scene(vec![corner(1.0)], vec![(0, None)])),
        ("one placed triangle", scene(vec![corner(1.0)], vec![(0, place)])),
        ("degenerate triangles", scene(vec![degenerate.clone()], vec![(0, None)])),
        (
            "degenerate among others",
            scene(
                vec![degenerate, soup(&mut Random::new(9), 40, 0.4, None)],
                vec![(0, None), (1, None), (0, place)],
            ),
        ),
    ] {
        assert_clean(name, &scene);
    }
}
