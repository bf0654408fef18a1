//! The `embree` backend gives the hits of the brute-force reference, for single rays and for packets of every
//! width, on every kind of scene. Both versions of Embree must pass; `tests/debian13.sh` runs the other one.

use std::{io::Write, sync::Arc};

use embree_sys::Library;
use glam::{Affine3A, DMat3, DQuat, DVec3, Mat3, Vec3};
use lightmesh::{
    accel::{
        Accel, BruteForceAccel, BvhAccel, Coherence, EmbreeAccel, EmbreeError, PacketLanes, RayHitPacket,
        hit_of_lane,
    },
    crosscheck::{Judge, Subject, check_rays},
    scene::{Hit, Ray, Scene, TriangleMaterials, TriangleMesh},
};

use crate::common::triangles::{HOLES, INVISIBLE, Random, mesh, scene, soup};

/// The backend over a scene. Without Embree the test is skipped, aloud; where `REQUIRE_EMBREE` is set it fails,
/// as it does where that names another major version.
fn embree(scene: &Scene) -> Option<EmbreeAccel> {
    let required = std::env::var("REQUIRE_EMBREE").ok();
    match Library::load() {
        Ok(library) => {
            if let Some(major) =
                required.and_then(|value| value.parse::<u32>().ok()).filter(|major| *major > 1)
            {
                assert_eq!(library.version().major, major, "REQUIRE_EMBREE names the version");
            }
            Some(EmbreeAccel::build_with(&library, scene).unwrap())
        }
        Err(error) if required.is_some() => panic!("{error}"),
        Err(error) => {
            let test = std::thread::current();
            // Not eprintln!, which the test harness swallows.
            let _ = writeln!(std::io::stderr(), "SKIPPED {}: {error}", test.name().unwrap_or_default());
            None
        }
    }
}

/// A triangle of legs `size` at z = 0 with its right angle at (x, y).
fn corner(x: f32, y: f32, size: f32) -> Arc<TriangleMesh> {
    mesh(vec![[x, y, 0.0], [x + size, y, 0.0], [x, y + size, 0.0]], vec![[0, 1, 2]], None)
}

fn rays(random: &mut Random, count: usize) -> Vec<Ray> {
    (0..count)
        .map(|i| match i % 3 {
            0 => Ray::new(3.0 * random.vec(), random.vec()),
            1 => Ray::between(2.0 * random.vec(), 2.0 * random.vec()),
            _ => Ray { t_near: 0.3, t_far: 1.2, ..Ray::new(random.vec(), 2.0 * random.vec()) },
        })
        .collect()
}

/// Embree's arithmetic differs in the last bits, so that a ray within rounding of an edge, or of the end
/// of its interval, may go either way, and of two triangles at the same distance either may be first.
/// A thousandth is far more than rounding, and so rare that few rays in a thousand may need it.
fn near(a: f32, b: f32) -> bool {
    (a - b).abs() <= 1e-3 * a.abs().max(b.abs()).max(1.0)
}

fn grazes(hit: Hit, ray: &Ray) -> bool {
    let edge = hit.u.min(hit.v).min(1.0 - hit.u - hit.v) < 1e-3;
    edge || near(hit.t, ray.t_near) || near(hit.t, ray.t_far)
}

fn same(a: Option<Hit>, b: Option<Hit>) -> bool {
    match (a, b) {
        (None, None) => true,
        (Some(a), Some(b)) => {
            (a.instance, a.triangle) == (b.instance, b.triangle)
                && near(a.t, b.t)
                && near(a.u, b.u)
                && near(a.v, b.v)
        }
        _ => false,
    }
}

/// Compares all queries with the reference.
fn check(scene: &Scene, rays: &[Ray]) {
    let Some(embree) = embree(scene) else { return };
    let reference = BruteForceAccel::new(scene);
    let expected: Vec<_> = rays.iter().map(|ray| reference.intersect(ray)).collect();
    assert!(expected.iter().flatten().count() * 20 > rays.len(), "too few rays hit anything");

    let mut close = 0;
    for (ray, expected) in rays.iter().zip(&expected) {
        let hit = embree.intersect(ray);
        if same(hit, *expected) && embree.occluded(ray) == expected.is_some() {
            continue;
        }
        let excused = [hit, *expected].into_iter().flatten().any(|hit| grazes(hit, ray))
            || matches!((hit, expected), (Some(a), Some(b)) if near(a.t, b.t));
        assert!(excused, "{ray:?}: {hit:?}, expected {expected:?}");
        close += 1;
    }
    assert!(close * 100 <= rays.len(), "{close} of {} rays needed an excuse", rays.len());

    check_packets::<4>(&embree, rays);
    check_packets::<8>(&embree, rays);
    check_packets::<16>(&embree, rays);
}

/// Packets give what single rays give, with some lanes switched off.
fn check_packets<const N: usize>(embree: &EmbreeAccel, rays: &[Ray]) {
    for coherence in [Coherence::Coherent, Coherence::Incoherent] {
        let mut differing = 0;
        for (index, rays) in rays.chunks(N).enumerate() {
            let mut packet = RayHitPacket::<N>::empty();
            rays.iter().enumerate().for_each(|(lane, ray)| packet.set_lane(lane, ray));
            let mut shadow = packet.ray;
            let active = ((1 << rays.len()) - 1) & !(0x9249_2492u32 >> (index % 3));
            embree.intersect_packet(active, &mut packet, coherence);
            let blocked = embree.occluded_packet(active, &mut shadow, coherence);
            assert_eq!(blocked & !active, 0, "only active lanes are blocked");
            for (lane, ray) in rays.iter().enumerate() {
                let hit = hit_of_lane(&packet, lane);
                if active >> lane & 1 == 0 {
                    assert_eq!(hit, None, "inactive lanes hit nothing");
                    continue;
                }
                let single = embree.intersect(ray);
                differing +=
                    usize::from(!same(hit, single) || (blocked >> lane & 1 == 1) != single.is_some());
            }
        }
        assert!(differing * 100 <= rays.len(), "{differing} of {} rays differ in packets", rays.len());
    }
}

#[test]
fn meshes_in_world_space_are_hit_where_the_reference_says() {
    let mut random = Random::new(1);
    let meshes = vec![soup(&mut random, 150, 0.2, None), soup(&mut random, 100, 0.4, None)];
    let rays = rays(&mut random, 3000);
    check(&scene(meshes, vec![(0, None), (1, None)]), &rays);
}

/// Placed meshes, one of them several times, beside one in world space: the hit names the instance.
#[test]
fn instances_are_hit_where_the_reference_says() {
    let mut random = Random::new(2);
    let meshes = vec![soup(&mut random, 60, 0.3, None), soup(&mut random, 60, 0.3, None)];
    let place = |linear: Mat3, translation: Vec3| Some(Affine3A::from_mat3_translation(linear, translation));
    let shear =
        Mat3::from_cols(Vec3::new(0.5, 0.1, 0.0), Vec3::new(0.2, 0.7, 0.3), Vec3::new(0.0, 0.1, -0.4));
    let instances = vec![
        (0, place(Mat3::from_diagonal(Vec3::splat(0.5)), Vec3::X)),
        (1, None),
        (0, place(Mat3::from_rotation_y(1.0), Vec3::new(-1.0, 0.5, 0.0))),
        (1, place(Mat3::from_diagonal(Vec3::new(-0.5, 0.5, 2.0)), Vec3::Z)),
        (0, place(shear, Vec3::ZERO)),
        (0, None),
    ];
    let rays = rays(&mut random, 3000);
    check(&scene(meshes, instances), &rays);
}

/// Turns leave remains of rounding such as 6·10⁻¹⁷ where a matrix should have 0, and those make tiny components of
/// directions that have a 0. Embree's packets lost hits of all their lanes over them.
#[test]
fn packets_lose_no_hits_in_instances_that_are_turned_by_quarters() {
    use std::f64::consts::FRAC_PI_2;
    let mut random = Random::new(8);
    let quarters = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| DMat3::from_axis_angle(axis, FRAC_PI_2));
    let turns = (0..24).map(|i| {
        let turn = quarters[i % 3] * quarters[i / 3 % 3] * quarters[i / 9];
        // Quaternions of files are in single precision.
        let [x, y, z, w] = DQuat::from_mat3(&turn).to_array().map(|part| f64::from(part as f32));
        let turn = if i % 2 == 0 { turn } else { DMat3::from_quat(DQuat::from_xyzw(x, y, z, w).normalize()) };
        Some(Affine3A::from_mat3_translation(0.5 * turn.as_mat3(), random.vec()))
    });
    let scene = scene(vec![soup(&mut Random::new(9), 500, 0.2, None)], turns.map(|turn| (0, turn)).collect());
    let Some(embree) = embree(&scene) else { return };
    let rays: Vec<_> = (0..40_000)
        .map(|_| {
            let mut way = random.vec();
            for _ in 0..1 + random.below(2) {
                way[random.below(3)] = [0.0, -0.0, 1e-40, 1e-19, -1e-17, 1e-12][random.below(6)];
            }
            Ray::new(random.vec() - way, way)
        })
        .collect();
    let bvh = BvhAccel::build(&scene).unwrap();
    let subjects = [Subject { name: "bvh", accel: &bvh }, Subject { name: "embree", accel: &embree }];
    let checked = check_rays(&Judge::new(&scene), &subjects, &rays);
    let lost = checked.unexplained.first();
    assert!(lost.is_none(), "{} rays, such as {}", checked.counts[1].unexplained, lost.unwrap());
}

/// An alpha mask decides in nearest hits and in occlusion alike, also through instances.
#[test]
fn alpha_masks_let_rays_through() {
    let mut random = Random::new(3);
    let holes = TriangleMaterials::PerTriangle(
        (0..150).map(|i| if i % 3 == 0 { INVISIBLE } else { HOLES }).collect(),
    );
    let meshes = vec![soup(&mut random, 150, 0.5, Some(holes))];
    let to_world = Affine3A::from_scale(Vec3::new(0.7, -1.2, 1.0));
    let rays = rays(&mut random, 3000);
    check(&scene(meshes, vec![(0, None), (0, Some(to_world))]), &rays);
}

/// Many small geometries are as good as one large one: each of 900 is found, and only there.
#[test]
fn nine_hundred_small_geometries_are_found() {
    let meshes = (0..900).map(|i| corner(2.0 * i as f32, 0.0, 1.0)).collect();
    let scene = scene(meshes, (0..900).map(|i| (i, None)).collect());
    let Some(embree) = embree(&scene) else { return };
    for i in 0..900u32 {
        let above = Vec3::new(2.0 * i as f32 + 0.25, 0.25, 1.0);
        let hit = embree.intersect(&Ray::new(above, Vec3::NEG_Z)).expect("the geometry is there");
        // Embree's reciprocals are approximate in the last bit on some processors.
        let expected = Hit { t: 1.0, u: 0.25, v: 0.25, instance: i, triangle: 0 };
        assert!(same(Some(hit), Some(expected)), "{hit:?}");
        assert!(!embree.occluded(&Ray::new(above + Vec3::X, Vec3::NEG_Z)));
    }
}

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

/// A hole of one ray in a closed surface is a bright dot in shadow: no ray from inside a ball through a point
/// on one of its edges may escape.
///
/// Embree promises that for edges, not for vertices: all the edges that meet in a vertex are decided one
/// by one within rounding, and now and then every triangle loses. A ray within rounding of a vertex is rare,
/// so one in a hundred of those that are aimed at one is let pass.
#[test]
fn no_ray_escapes_through_the_edges_of_a_closed_ball() {
    let (rings, sectors) = (24u32, 48u32);
    let mut positions = vec![[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]];
    for ring in 1..rings {
        let theta = std::f32::consts::PI * ring as f32 / rings as f32;
        for sector in 0..sectors {
            let phi = std::f32::consts::TAU * sector as f32 / sectors as f32;
            positions.push([theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()]);
        }
    }
    let at = |ring: u32, sector: u32| 2 + (ring - 1) * sectors + sector % sectors;
    let mut triangles = Vec::new();
    for sector in 0..sectors {
        triangles.push([0, at(1, sector), at(1, sector + 1)]);
        triangles.push([1, at(rings - 1, sector + 1), at(rings - 1, sector)]);
        for ring in 1..rings - 1 {
            let [a, b, c, d] =
                [at(ring, sector), at(ring, sector + 1), at(ring + 1, sector), at(ring + 1, sector + 1)];
            triangles.extend([[a, c, b], [b, c, d]]);
        }
    }
    let ball = scene(vec![mesh(positions.clone(), triangles.clone(), None)], vec![(0, None)]);
    let Some(embree) = embree(&ball) else { return };
    let mut random = Random::new(4);
    let (mut at_vertices, mut escaped) = (0, 0);
    for _ in 0..30 {
        let origin = 0.5 * random.vec();
        for triangle in &triangles {
            let [a, b, c] = triangle.map(|i| Vec3::from_array(positions[i as usize]));
            let s = 0.5 + 0.5 * random.signed();
            // Three vertices, then points on edges, none of which is nearer to a vertex than rounding.
            let s = s.clamp(0.01, 0.99);
            let targets = [a, b, c, a.midpoint(b), b.midpoint(c), a.lerp(b, s), b.lerp(c, s), c.lerp(a, s)];
            let mut packet = RayHitPacket::<8>::empty();
            let mut open = 0u32;
            for (lane, target) in targets.into_iter().enumerate() {
                let ray = Ray::new(origin, target - origin);
                packet.ray.set_lane(lane, &ray);
                if embree.occluded(&ray) {
                    assert!(embree.intersect(&ray).is_some(), "{ray:?} escapes from the nearest-hit query");
                } else {
                    assert!(lane < 3, "{ray:?} escapes through an edge");
                    open |= 1 << lane;
                }
            }
            let blocked = embree.occluded_packet(0xff, &mut packet.ray, Coherence::Coherent);
            assert_eq!(blocked | 0b111, 0xff, "a ray from {origin} escapes through an edge from its packet");
            at_vertices += 3;
            escaped += open.max(!blocked & 0xff).count_ones();
        }
    }
    assert!(escaped * 100 < at_vertices, "{escaped} of {at_vertices} rays escape through vertices");
}

/// The picture must not depend on the number of threads that built the tree, not even where a ray hits an
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
