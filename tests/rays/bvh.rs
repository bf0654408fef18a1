//! The pure-Rust ray queries return what a loop over all triangles returns, on every instruction set
//! level, for single rays and for packets, and whatever is thrown at them.
//!
//! Hits are compared to the last bit: the reference does the same arithmetic without boxes, trees and SIMD, so
//! that any difference is a hit that a box culled, a lane mixed up or a tie broken otherwise.

use std::sync::Arc;

use glam::{Affine3A, Mat3, Vec3};
use lightmesh::accel::{
    Accel, BruteForceAccel, BvhAccel, BvhError, Coherence, PacketLanes, RayHitPacket, RayPacket, SimdLevel,
    hit_of_lane,
};
use lightmesh::scene::{Hit, Ray, Scene, TriangleMaterials, TriangleMesh};

use crate::common::triangles::{self, HOLES, INVISIBLE, Random, mesh, scene};

fn single(mesh: Arc<TriangleMesh>) -> Scene {
    scene(vec![mesh], vec![(0, None)])
}

/// Triangles without shared vertices.
fn soup(triangles: impl IntoIterator<Item = [Vec3; 3]>) -> Arc<TriangleMesh> {
    let positions: Vec<_> = triangles.into_iter().flatten().map(|p| p.to_array()).collect();
    let count = positions.len() as u32 / 3;
    mesh(positions, (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(), None)
}

/// Sphere of `rings` × 2`rings` quads, closed at the poles.
fn sphere(rings: u32, radius: f32) -> Arc<TriangleMesh> {
    let segments = 2 * rings;
    let mut positions = vec![[0.0, radius, 0.0], [0.0, -radius, 0.0]];
    for ring in 1..rings {
        let polar = std::f32::consts::PI * ring as f32 / rings as f32;
        for segment in 0..segments {
            let angle = std::f32::consts::TAU * segment as f32 / segments as f32;
            positions.push([
                radius * polar.sin() * angle.cos(),
                radius * polar.cos(),
                radius * polar.sin() * angle.sin(),
            ]);
        }
    }
    let at = |ring: u32, segment: u32| 2 + (ring - 1) * segments + segment % segments;
    let mut triangles = Vec::new();
    for segment in 0..segments {
        triangles.push([0, at(1, segment), at(1, segment + 1)]);
        triangles.push([1, at(rings - 1, segment + 1), at(rings - 1, segment)]);
        for ring in 1..rings - 1 {
            let [a, b] = [at(ring, segment), at(ring, segment + 1)];
            let [c, d] = [at(ring + 1, segment), at(ring + 1, segment + 1)];
            triangles.extend([[a, c, b], [b, c, d]]);
        }
    }
    mesh(positions, triangles, None)
}

/// Cube from −1 to 1, each face of n × n quads.
fn cube(n: u32) -> Arc<TriangleMesh> {
    let mut triangles = Vec::new();
    for axis in 0..3 {
        for side in [-1.0f32, 1.0] {
            let at = |i: u32, j: u32| {
                let mut p = Vec3::splat(side);
                p[(axis + 1) % 3] = 2.0 * i as f32 / n as f32 - 1.0;
                p[(axis + 2) % 3] = 2.0 * j as f32 / n as f32 - 1.0;
                p
            };
            for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
                triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
    }
    soup(triangles)
}

fn levels() -> Vec<SimdLevel> {
    let (available, missing): (Vec<_>, Vec<_>) = SimdLevel::ALL.into_iter().partition(|l| l.is_available());
    for level in missing {
        println!("skipped: this processor has no {level:?}");
    }
    available
}

/// Compares all queries of all levels with the reference.
fn check(scene: &Scene, rays: &[Ray]) {
    let reference = BruteForceAccel::new(scene);
    let expected: Vec<_> = rays.iter().map(|ray| reference.intersect(ray)).collect();
    for level in levels() {
        let accel = BvhAccel::with_level(scene, level).expect("level is available");
        accel.validate().expect("sound tree");
        for (ray, expected) in rays.iter().zip(&expected) {
            let hit = accel.intersect(ray);
            assert_eq!(hit, *expected, "{level:?}, nearest, {ray:?}");
            assert_eq!(accel.occluded(ray), expected.is_some(), "{level:?}, any, {ray:?}");
        }
        check_packets::<4>(&accel, rays, &expected);
        check_packets::<8>(&accel, rays, &expected);
        check_packets::<16>(&accel, rays, &expected);
    }
}

/// Some lanes of each packet are switched off by a fixed pattern and must stay untouched.
fn check_packets<const N: usize>(accel: &BvhAccel, rays: &[Ray], expected: &[Option<Hit>]) {
    let context = |lane: usize| format!("{:?}, packet of {N}, lane {lane}", accel.level());
    for (number, (rays, expected)) in rays.chunks(N).zip(expected.chunks(N)).enumerate() {
        let present = (1u32 << rays.len()) - 1;
        let active =
            present & if number % 3 == 0 { u32::MAX } else { 0xb6db_6db6u32.rotate_left(number as u32) };
        let mut any = RayPacket::<N>::empty();
        let mut nearest = RayHitPacket::<N>::empty();
        for (lane, ray) in rays.iter().enumerate() {
            any.set_lane(lane, ray);
            nearest.set_lane(lane, ray);
        }
        let coherence = [Coherence::Coherent, Coherence::Incoherent][number % 2];
        let blocked = accel.occluded_packet(active, &mut any, coherence);
        accel.intersect_packet(active, &mut nearest, coherence);
        for lane in 0..N {
            let is_active = active >> lane & 1 != 0;
            let expected = if is_active { expected[lane] } else { None };
            assert_eq!(
                blocked >> lane & 1 != 0,
                expected.is_some(),
                "{}, any: {:?}",
                context(lane),
                rays.get(lane)
            );
            assert_eq!(hit_of_lane(&nearest, lane), expected, "{}: {:?}", context(lane), rays.get(lane));
            if let Some(ray) = rays.get(lane).filter(|_| expected.is_none()) {
                assert_eq!(nearest.ray.tfar[lane].to_bits(), ray.t_far.to_bits(), "{}: t_far", context(lane));
            }
        }
        assert_eq!(blocked & !active, 0);
    }
}

/// Rays of many kinds around a scene within [−1, 1]³: through it, inside it, towards vertices, along
/// edges and axes, in triangle planes, in coherent bundles, with short and empty intervals.
fn rays_for(random: &mut Random, target: &TriangleMesh, count: usize) -> Vec<Ray> {
    let mut rays = Vec::new();
    let triangles = target.triangles.len();
    while rays.len() < count {
        let corners = if triangles == 0 {
            [Vec3::X, Vec3::Y, Vec3::Z]
        } else {
            target.corners(random.below(triangles) as u32)
        };
        let origin = 1.5 * random.vec();
        rays.push(Ray::new(origin, random.vec()));
        rays.push(Ray::between(origin, random.vec()));
        rays.push(Ray::new(origin, corners[random.below(3)] - origin));
        rays.push(Ray::new(origin, corners[0].lerp(corners[1], 0.5) - origin));
        rays.push(Ray::new(corners[0], corners[1] - corners[0]));
        rays.push(Ray::new(corners[0] - (corners[2] - corners[1]), corners[2] - corners[1]));
        rays.push(Ray::between(corners[0].lerp(corners[1], 0.3), random.vec()));
        let mut axis = Vec3::ZERO;
        axis[random.below(3)] = if random.below(2) == 0 { 1.0 } else { -1.0 };
        rays.push(Ray::new(corners[0] - 2.0 * axis, axis));
        rays.push(Ray::new(origin, axis));
        let mut flat = random.vec();
        flat[random.below(3)] = [0.0, -0.0, 1e-40, -1e-30][random.below(4)];
        rays.push(Ray::new(origin, flat));
        rays.push(Ray { t_near: 0.3, t_far: 0.9, ..Ray::new(origin, random.vec()) });
        rays.push(Ray { t_near: 0.9, t_far: 0.3, ..Ray::new(origin, random.vec()) });
        rays.push(Ray::new(1e4 * random.vec().normalize(), Vec3::ZERO));
        let far = 1e4 * random.vec();
        rays.push(Ray::new(far, corners[0] - far));
        rays.push(Ray::between(far, corners[0]));
        let (target, scale) = (random.vec(), 10f32.powi(random.below(13) as i32 - 6));
        rays.extend((0..17).map(|_| {
            let origin = origin + 0.1 * random.vec();
            Ray { t_far: 1.0 / scale, ..Ray::new(origin, scale * (target - origin)) }
        }));
    }
    rays
}

#[test]
fn random_triangles_of_all_sizes_give_the_hits_of_the_reference() {
    let mut random = Random::new(1);
    for (count, size) in [(1, 0.5), (2, 0.5), (9, 0.5), (70, 0.3), (400, 0.1), (3000, 0.02), (300, 2.0)] {
        let mesh = triangles::soup(&mut random, count, size, None);
        let rays = rays_for(&mut random, &mesh, 1500);
        check(&single(mesh), &rays);
    }
}

#[test]
fn shared_edges_and_axis_parallel_faces_give_the_hits_of_the_reference() {
    let mut random = Random::new(2);
    for mesh in [sphere(12, 0.9), cube(5)] {
        let rays = rays_for(&mut random, &mesh, 3000);
        check(&single(mesh), &rays);
    }
}

/// A one-pixel leak shows as a bright dot in shadow, so no ray from inside a closed surface may escape; the
/// rays aim where leaks come from: at vertices and points of edges, with all roundings of the direction.
#[test]
fn no_ray_escapes_from_inside_closed_surfaces() {
    let mut random = Random::new(3);
    for mesh in [sphere(24, 1.0), cube(9)] {
        for (offset, scale) in [(Vec3::ZERO, 1.0), (Vec3::new(300.0, -7.0, 0.1), 1.0), (Vec3::ZERO, 1e-6)] {
            let positions = mesh.positions.as_slice().iter();
            let positions = positions.map(|&p| (scale * Vec3::from_array(p) + offset).to_array()).collect();
            let moved = self::mesh(positions, mesh.triangles.to_vec(), None);
            let mut rays = Vec::new();
            for _ in 0..20_000 {
                let origin = offset + scale * 0.5 * random.vec();
                let [a, b, _] = moved.corners(random.below(moved.triangles.len()) as u32);
                let aim = [a, a.lerp(b, random.signed().abs())][random.below(2)];
                rays.push(Ray::new(origin, aim - origin));
            }
            let scene = single(moved);
            for level in levels() {
                let accel = BvhAccel::with_level(&scene, level).unwrap();
                let mut escaped = rays.iter().filter(|ray| !accel.occluded(ray)).count();
                escaped += rays.iter().filter(|ray| accel.intersect(ray).is_none()).count();
                for rays in rays.chunks_exact(16) {
                    let mut packet = RayPacket::<16>::empty();
                    rays.iter().enumerate().for_each(|(lane, ray)| packet.set_lane(lane, ray));
                    let blocked = accel.occluded_packet(0xffff, &mut packet, Coherence::Coherent);
                    escaped += 16 - blocked.count_ones() as usize;
                }
                assert_eq!(escaped, 0, "{level:?}, offset {offset}, scale {scale}");
            }
        }
    }
}

#[test]
fn triangles_that_are_degenerate_huge_or_not_finite_do_no_harm() {
    let mut random = Random::new(4);
    let mut triangles: Vec<[Vec3; 3]> = (0..200).map(|_| [0; 3].map(|_| random.vec())).collect();
    for i in 0..60 {
        let p = random.vec();
        let q = random.vec();
        triangles.push(match i % 6 {
            0 => [p, p, p],
            1 => [p, p, q],
            2 => [p, p.lerp(q, 0.5), q],
            3 => [p, q, Vec3::new(f32::NAN, 0.0, 0.0)],
            4 => [p, Vec3::splat(f32::INFINITY), q],
            _ => [Vec3::splat(f32::NAN); 3],
        });
    }
    let left_out = triangles.iter().flatten().filter(|p| !p.is_finite()).count();
    assert!(left_out > 0);
    let mesh = soup(triangles);
    let rays = rays_for(&mut random, &mesh, 3000);
    let rays: Vec<_> = rays.into_iter().filter(|ray| ray.origin.is_finite()).collect();
    let scene = single(mesh);
    check(&scene, &rays);
    assert_eq!(BvhAccel::build(&scene).unwrap().triangle_count(), 230, "30 of 260 are not finite");
}

#[test]
fn coordinates_of_1e11_are_hit_like_those_of_1_and_those_beyond_the_limit_are_not() {
    let mut random = Random::new(5);
    let small: Vec<[Vec3; 3]> = (0..300).map(|_| [0; 3].map(|_| random.vec())).collect();
    // A power of two, so that scaling rounds nothing.
    let scale = 2f32.powi(36);
    let huge = soup(small.iter().map(|t| t.map(|p| p * scale)));
    let rays = rays_for(&mut random, &soup(small.iter().copied()), 2000);
    let (small, huge) = (single(soup(small)), single(huge));
    let large_rays: Vec<_> = rays
        .iter()
        .map(|ray| Ray { origin: ray.origin * scale, direction: ray.direction * scale, ..*ray })
        .collect();
    check(&huge, &large_rays);
    let (small, huge) = (BvhAccel::build(&small).unwrap(), BvhAccel::build(&huge).unwrap());
    let mut hits = 0;
    for _ in 0..2000 {
        let ray = Ray::new(2.0 * random.vec(), random.vec());
        let large = Ray { origin: ray.origin * scale, direction: ray.direction * scale, ..ray };
        let (Some(a), Some(b)) = (small.intersect(&ray), huge.intersect(&large)) else { continue };
        // On edges either triangle may be named, and hits at a slant lose digits.
        if a.u.min(a.v).min(1.0 - a.u - a.v) > 1e-3 {
            hits += 1;
            assert!((a.t - b.t).abs() <= 1e-4 * a.t.max(0.1), "{a:?} {b:?}");
        }
    }
    assert!(hits > 300, "{hits}");
    // Extents whose squares overflow in one scene with small ones; those of 3·10³⁸ are beyond the limit.
    let mixed: Vec<_> =
        (0..200).map(|i| [0; 3].map(|_| random.vec() * [1.0, 1e15, 1e-30, 3e38][i % 4])).collect();
    let mesh = soup(mixed);
    let rays = rays_for(&mut random, &mesh, 2000);
    let scene = single(mesh);
    check(&scene, &rays);
    assert_eq!(BvhAccel::build(&scene).unwrap().triangle_count(), 150);
}

#[test]
fn rays_that_are_not_finite_or_have_no_direction_hit_nothing() {
    let scene = single(sphere(8, 1.0));
    let bad = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
    let mut rays = vec![Ray::new(Vec3::ZERO, Vec3::ZERO)];
    for value in bad {
        for axis in 0..3 {
            let mut broken = Ray::new(Vec3::ZERO, Vec3::ONE);
            broken.origin[axis] = value;
            rays.push(broken);
            let mut broken = Ray::new(Vec3::ZERO, Vec3::ONE);
            broken.direction[axis] = value;
            rays.push(broken);
        }
        rays.push(Ray { t_near: f32::NAN, ..Ray::new(Vec3::ZERO, Vec3::X) });
        rays.push(Ray { t_far: f32::NAN, ..Ray::new(Vec3::ZERO, Vec3::X) });
        rays.push(Ray { t_near: f32::INFINITY, ..Ray::new(Vec3::ZERO, Vec3::X) });
    }
    let accel = BvhAccel::build(&scene).unwrap();
    for ray in &rays {
        assert_eq!(accel.intersect(ray), None, "{ray:?}");
    }
    check(&scene, &rays);
    // Directions of denormal length reach the sphere at a t beyond any float: no hit, no crash.
    assert!(!accel.occluded(&Ray::new(Vec3::ZERO, Vec3::splat(1e-42))));
    assert!(accel.occluded(&Ray::new(Vec3::ZERO, Vec3::splat(1e-9))));
    assert!(accel.occluded(&Ray::new(Vec3::ZERO, Vec3::splat(1e15))));
}

#[test]
fn empty_scenes_and_scenes_of_one_triangle_are_answered() {
    let mut random = Random::new(6);
    let empty = mesh(vec![], vec![], None);
    let rays = rays_for(&mut random, &empty, 200);
    check(&Scene::default(), &rays);
    check(&single(empty.clone()), &rays);
    check(&scene(vec![empty], vec![(0, Some(Affine3A::IDENTITY))]), &rays);
    let one = soup([[Vec3::new(-1.0, -1.0, 0.0), Vec3::new(1.0, -1.0, 0.0), Vec3::new(0.0, 1.0, 0.0)]]);
    let scene = single(one);
    check(&scene, &rays);
    let hit = BvhAccel::build(&scene)
        .unwrap()
        .intersect(&Ray::new(Vec3::new(0.0, -0.5, 4.0), -2.0 * Vec3::Z))
        .unwrap();
    // Depth 4 at two units per t; weights of the corners are 3/8, 3/8 and 1/4 at height −1/2.
    assert_eq!((hit.t, hit.u, hit.v, hit.instance, hit.triangle), (2.0, 0.375, 0.25, 0, 0));
}

#[test]
fn of_hits_at_the_same_distance_the_lowest_instance_and_triangle_is_reported() {
    let mut random = Random::new(7);
    let triangle = [Vec3::new(-1.0, -1.0, 0.0), Vec3::new(1.0, -1.0, 0.0), Vec3::new(0.0, 1.0, 0.0)];
    let copies = soup([triangle; 50]);
    let scene = scene(
        vec![copies],
        vec![(0, Some(Affine3A::IDENTITY)), (0, None), (0, Some(Affine3A::IDENTITY)), (0, None)],
    );
    let rays: Vec<_> = (0..64).map(|_| Ray::new(0.1 * random.vec() + Vec3::Z, -Vec3::Z)).collect();
    check(&scene, &rays);
    let hit = BvhAccel::build(&scene).unwrap().intersect(&rays[0]).unwrap();
    assert_eq!((hit.instance, hit.triangle), (0, 0));
}

fn placements(random: &mut Random) -> Vec<Affine3A> {
    (0..12)
        .map(|i| {
            let mut linear = Mat3::from_cols(random.vec(), random.vec(), random.vec()) + Mat3::IDENTITY;
            if i % 3 == 0 {
                linear *= Mat3::from_diagonal(Vec3::new(-1.0, 1.0, 1.0));
            }
            Affine3A::from_mat3_translation(0.4 * linear, random.vec())
        })
        .collect()
}

#[test]
fn instances_of_any_affine_or_singular_transform_give_the_hits_of_the_reference() {
    let mut random = Random::new(8);
    let meshes = vec![
        triangles::soup(&mut random, 60, 0.3, None),
        sphere(5, 0.6),
        triangles::soup(&mut random, 30, 0.3, None),
    ];
    let mut instances: Vec<_> =
        placements(&mut random).into_iter().enumerate().map(|(i, m)| (i as u32 % 2, Some(m))).collect();
    instances.insert(3, (2, None));
    instances.push((0, Some(Affine3A::ZERO)));
    instances.push((0, Some(Affine3A::from_scale(Vec3::new(1.0, 0.0, 1.0)))));
    instances.push((0, Some(Affine3A::from_scale(Vec3::splat(f32::NAN)))));
    let rays = rays_for(&mut random, &meshes[2], 3000);
    check(&scene(meshes, instances), &rays);
}

/// Rounding differs between the two, so only hits well inside their triangle are compared, by distance.
#[test]
fn instanced_and_flattened_geometry_agree() {
    let mut random = Random::new(9);
    let shape = sphere(6, 0.6);
    let placements = placements(&mut random);
    let flat: Vec<_> = placements
        .iter()
        .map(|m| {
            let positions = shape.positions.as_slice();
            let positions = positions.iter().map(|&p| m.transform_point3(p.into()).to_array()).collect();
            mesh(positions, shape.triangles.to_vec(), None)
        })
        .collect();
    let count = placements.len() as u32;
    let flattened = scene(flat, (0..count).map(|i| (i, None)).collect());
    let instanced = scene(vec![shape], placements.into_iter().map(|m| (0, Some(m))).collect());
    let flattened = BvhAccel::build(&flattened).unwrap();
    let instanced = BvhAccel::build(&instanced).unwrap();
    let mut compared = 0;
    for _ in 0..20_000 {
        let ray = Ray::new(2.0 * random.vec(), random.vec());
        let Some(hit) = flattened.intersect(&ray) else { continue };
        if hit.u.min(hit.v).min(1.0 - hit.u - hit.v) < 1e-3 {
            continue;
        }
        let other =
            instanced.intersect(&ray).unwrap_or_else(|| panic!("{ray:?} hits {hit:?} flattened only"));
        assert!((hit.t - other.t).abs() <= 1e-4 * hit.t.max(1.0), "{ray:?}: {hit:?} {other:?}");
        compared += 1;
    }
    assert!(compared > 2000, "{compared}");
}

#[test]
fn alpha_masks_let_rays_through_in_every_query() {
    let mut random = Random::new(10);
    let holes = TriangleMaterials::PerTriangle(
        (0..200).map(|i| if i % 2 == 0 { HOLES } else { INVISIBLE }).collect(),
    );
    let solid = triangles::soup(&mut random, 200, 0.5, None);
    let leaves = triangles::soup(&mut random, 200, 0.5, None);
    let leaves = mesh(leaves.positions.as_slice().to_vec(), leaves.triangles.to_vec(), Some(holes));
    let rays = rays_for(&mut random, &solid, 2000);
    let turned = Affine3A::from_rotation_y(0.7);
    check(&single(leaves.clone()), &rays);
    check(&scene(vec![solid, leaves], vec![(0, None), (1, None), (1, Some(turned))]), &rays);
    let nothing = TriangleMaterials::Uniform(INVISIBLE);
    let sphere = sphere(8, 1.0);
    let invisible = mesh(sphere.positions.as_slice().to_vec(), sphere.triangles.to_vec(), Some(nothing));
    let accel = BvhAccel::build(&single(invisible)).unwrap();
    assert!(rays.iter().all(|ray| !accel.occluded(ray) && accel.intersect(ray).is_none()));
}

/// Reproducible pictures need equal trees: ties at equal distance are settled without the tree, but box
/// culling and work counters are not.
#[test]
fn the_tree_is_the_same_for_any_number_of_threads() {
    let mut random = Random::new(11);
    // Above the size from which ranges are binned in parallel.
    let meshes = vec![
        triangles::soup(&mut random, 150_000, 0.01, None),
        triangles::soup(&mut random, 5000, 0.1, None),
    ];
    let scene = scene(meshes, vec![(0, None), (1, Some(Affine3A::from_translation(Vec3::X)))]);
    let digests = [1, 2, 7].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let accel = pool.install(|| BvhAccel::build(&scene)).unwrap();
        accel.validate().unwrap();
        assert_eq!(accel.triangle_count(), 155_000);
        accel.digest()
    });
    assert_eq!(digests[0], digests[1]);
    assert_eq!(digests[0], digests[2]);
}

/// Inputs that defeat the surface-area heuristic must not make a tree deeper than the stack.
#[test]
fn inputs_that_make_deep_trees_are_built_and_answered() {
    let mut random = Random::new(12);
    // Each triangle is 10 % larger than the one before: every split peels off a few.
    let nested = soup((0..800).map(|i| [Vec3::X, Vec3::Y, Vec3::Z].map(|p| p * 1e-12 * 1.1f32.powi(i))));
    let same = soup([[Vec3::X, Vec3::Y, Vec3::Z]; 3000]);
    let line = soup((0..2000).map(|i| [0.0, 1e-3, 2e-3].map(|x| Vec3::new(i as f32 * 1e-3 + x, x * x, 0.0))));
    for mesh in [nested, same, line] {
        let rays = rays_for(&mut random, &mesh, 600);
        check(&single(mesh), &rays);
    }
}

#[test]
fn an_instance_of_a_mesh_that_does_not_exist_is_an_error() {
    let broken = scene(vec![sphere(4, 1.0)], vec![(0, None), (7, None)]);
    assert_eq!(BvhAccel::build(&broken).err(), Some(BvhError::NoSuchMesh { instance: 1, mesh: 7 }));
}

#[test]
fn hits_name_their_instance_whether_it_is_placed_or_not() {
    let shape = sphere(4, 1.0);
    let away = Affine3A::from_translation(10.0 * Vec3::X);
    let accel = BvhAccel::build(&scene(vec![shape], vec![(0, Some(away)), (0, None)])).unwrap();
    let mut packet = RayHitPacket::<4>::empty();
    packet.set_lane(0, &Ray::new(Vec3::new(0.1, 0.2, 0.1), Vec3::Y));
    packet.set_lane(1, &Ray::new(Vec3::new(10.1, 0.2, 0.1), Vec3::Y));
    accel.intersect_packet(0b11, &mut packet, Coherence::Coherent);
    let instances = [0, 1].map(|lane| hit_of_lane(&packet, lane).map(|hit| hit.instance));
    assert_eq!(instances, [Some(1), Some(0)]);
}
