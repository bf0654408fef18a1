//! Hits are those of the reference, whatever the triangles, placements and alpha masks are.

use super::*;

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
