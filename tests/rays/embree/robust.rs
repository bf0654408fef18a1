//! Whatever is damaged, empty or no number does no harm; and what a build may and may not change.

use super::*;

/// No mesh, no instance, or a mesh without triangles: nothing to hit, and no error.
#[test]
fn empty_scenes_are_missed() {
    let down = Ray::new(Vec3::new(0.2, 0.2, 1.0), Vec3::NEG_Z);
    let empty = || mesh(Vec::new(), Vec::new(), None);
    for scene in [
        Scene::default(),
        scene(vec![corner(0.0, 0.0, 1.0)], vec![]),
        scene(vec![empty()], vec![(0, None)]),
        scene(vec![empty()], vec![(0, Some(Affine3A::IDENTITY)), (0, None)]),
    ] {
        let Some(embree) = embree(&scene) else { return };
        assert_eq!(embree.intersect(&down), None);
        assert!(!embree.occluded(&down));
    }
}

/// A damaged file must cost no more than its damaged triangles.
#[test]
fn damaged_triangles_leave_the_others_as_they_are() {
    let mut positions = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let mut triangles = vec![[0, 1, 2], [0, 0, 0], [0, 1, 1]];
    for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let first = positions.len() as u32;
        positions.extend([[0.0, 0.0, 0.5], [1.0, 0.0, 0.5], [0.0, value, 0.5]]);
        triangles.push([first, first + 1, first + 2]);
    }
    let damaged = mesh(positions, triangles, None);
    let singular = Affine3A::from_scale(Vec3::new(1.0, 1.0, 0.0));
    for to_world in [None, Some(Affine3A::IDENTITY)] {
        let scene = scene(vec![damaged.clone()], vec![(0, Some(singular)), (0, to_world)]);
        let Some(embree) = embree(&scene) else { return };
        let hit = embree.intersect(&Ray::new(Vec3::new(0.2, 0.2, 1.0), Vec3::NEG_Z)).expect("triangle 0");
        let expected = Hit { t: 1.0, u: 0.2, v: 0.2, instance: 1, triangle: 0 };
        assert!(same(Some(hit), Some(expected)), "{hit:?}");
    }
}

/// Numbers that are none hit nothing, as in the other backends; Embree itself would abort on some.
#[test]
fn rays_that_are_not_finite_hit_nothing() {
    let scene = scene(vec![corner(-10.0, -10.0, 100.0)], vec![(0, None), (0, Some(Affine3A::IDENTITY))]);
    let Some(embree) = embree(&scene) else { return };
    let good = Ray::new(Vec3::Z, Vec3::NEG_Z);
    assert!(embree.occluded(&good));
    let mut bad = vec![
        Ray { t_near: f32::NAN, ..good },
        Ray { t_far: f32::NAN, ..good },
        Ray { t_far: -1.0, ..good },
        Ray { t_near: 2.0, t_far: 1.5, ..good },
        Ray { direction: Vec3::ZERO, ..good },
    ];
    for axis in 0..3 {
        for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let (mut origin, mut direction) = (good.origin, good.direction);
            origin[axis] = value;
            direction[axis] = value;
            bad.extend([Ray { origin, ..good }, Ray { direction, ..good }]);
        }
    }
    for ray in &bad {
        assert_eq!(embree.intersect(ray), None, "{ray:?}");
        assert!(!embree.occluded(ray), "{ray:?}");
    }
    for rays in bad.chunks(7) {
        let mut packet = RayHitPacket::<8>::empty();
        rays.iter().enumerate().for_each(|(lane, ray)| packet.set_lane(lane, ray));
        packet.set_lane(7, &good);
        let mut shadow = packet.ray;
        embree.intersect_packet(0xff, &mut packet, Coherence::Coherent);
        assert_eq!(embree.occluded_packet(0xff, &mut shadow, Coherence::Coherent), 0x80);
        assert!((0..7).all(|lane| hit_of_lane(&packet, lane).is_none()));
        assert_eq!(hit_of_lane(&packet, 7).map(|hit| hit.t), Some(1.0));
    }
    // An interval that starts behind the origin holds what lies in front of it.
    let behind = Ray { t_near: -5.0, ..good };
    assert_eq!(embree.intersect(&behind).map(|hit| hit.t), Some(1.0));
    let mut packet = RayHitPacket::<4>::empty();
    packet.set_lane(2, &behind);
    assert_eq!(embree.occluded_packet(0xf, &mut packet.ray, Coherence::Incoherent), 0b100);
}

/// The image must not depend on the number of threads that built the tree, not even where a ray hits an
/// edge and two triangles are equally near.
#[test]
fn hits_do_not_depend_on_the_threads_of_the_build() {
    // A lattice of two sheets in one place: every ray ties.
    let n = 150u32;
    let positions: Vec<_> =
        (0..=n).flat_map(|y| (0..=n).map(move |x| [x as f32, y as f32, ((x * y) % 7) as f32])).collect();
    let sheet: Vec<_> = (0..n)
        .flat_map(|y| (0..n).map(move |x| y * (n + 1) + x))
        .flat_map(|a| [[a, a + 1, a + n + 1], [a + 1, a + n + 2, a + n + 1]])
        .collect();
    let triangles = sheet.iter().chain(&sheet).copied().collect();
    let scene = scene(vec![mesh(positions, triangles, None)], vec![(0, None)]);
    let hits_with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let embree = pool.install(|| embree(&scene))?;
        let hits = (0..2 * n).flat_map(|y| (0..2 * n).map(move |x| (x, y))).map(|(x, y)| {
            let origin = Vec3::new(0.5 * x as f32, 0.5 * y as f32, 20.0);
            embree.intersect(&Ray::new(origin, Vec3::NEG_Z)).map(|hit| hit.triangle)
        });
        Some(hits.collect::<Vec<_>>())
    };
    let Some(one) = hits_with(1) else { return };
    for threads in [2, 7, 2] {
        let other = hits_with(threads).unwrap();
        let differing = one.iter().zip(&other).filter(|(a, b)| a != b).count();
        assert_eq!(differing, 0, "of {} rays, built by {threads} threads", one.len());
    }
}

/// The statistics report what Embree holds: something for 20,000 triangles, less for one.
#[test]
fn memory_follows_the_scene() {
    let mut random = Random::new(5);
    let large = scene(vec![soup(&mut random, 20_000, 0.1, None)], vec![(0, None)]);
    let small = scene(vec![corner(0.0, 0.0, 1.0)], vec![(0, None)]);
    let (Some(large), Some(small)) = (embree(&large), embree(&small)) else { return };
    // A triangle takes at least its three corners in the leaves.
    assert!(large.memory_bytes() > 20_000 * 36, "{}", large.memory_bytes());
    assert!(small.memory_bytes() < large.memory_bytes() / 4, "{}", small.memory_bytes());
    assert!(large.version().starts_with(['3', '4']), "{}", large.version());
}

/// Wrong indices would let Embree read anywhere; they are refused by mesh and triangle.
#[test]
fn wrong_indices_are_errors() {
    let Ok(library) = Library::load() else { return };
    let broken = mesh(vec![[0.0; 3]; 3], vec![[0, 1, 2], [0, 1, 3]], None);
    let error = EmbreeAccel::build_with(&library, &scene(vec![broken], vec![(0, None)])).err();
    let message = error.expect("vertex 3 does not exist").to_string();
    assert_eq!(message, "mesh `test`: triangle 1 names vertex 3, but there are 3");
    let missing = EmbreeAccel::build_with(&library, &scene(vec![], vec![(0, None)])).err();
    assert!(matches!(missing, Some(EmbreeError::NoSuchMesh { instance: 0, mesh: 0 })), "{missing:?}");
}
