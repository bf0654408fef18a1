//! Triangles and rays of any numbers do no harm.

use super::*;

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
