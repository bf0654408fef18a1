//! The cross-check tells rays that ray tracers may disagree about from rays that one of them gets wrong, and misses
//! no wrong one.

use std::sync::atomic::{AtomicU64, Ordering};

use glam::{Affine3A, Vec3};
use lightmesh::accel::{Accel, BruteForceAccel, BvhAccel, Coherence, LaneMask, RayHitPacket, RayPacket};
use lightmesh::crosscheck::{
    Checked, Counts, Judge, Options, Subject, check_rays, crosscheck, watertightness,
};
use lightmesh::scene::{Hit, Ray, Scene, TriangleMaterials};

use crate::common::triangles::{RIM, mesh, scene};

/// A square of two triangles at z = 0, from (0, 0) to (1, 1), whose diagonal runs from (0, 0) to (1, 1).
fn square(materials: Option<TriangleMaterials>) -> Scene {
    let corners = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    scene(vec![mesh(corners, vec![[0, 1, 2], [0, 2, 3]], materials)], vec![(0, None)])
}

/// A wavy sheet of `n` × `n` squares over [0, 1]².
fn sheet(n: u32) -> Scene {
    let height = |x: u32, y: u32| 0.05 * ((x * 7 + y * 3) % 5) as f32;
    let positions = (0..=n)
        .flat_map(|y| (0..=n).map(move |x| [x as f32 / n as f32, y as f32 / n as f32, height(x, y)]))
        .collect();
    let triangles = (0..n)
        .flat_map(|y| (0..n).map(move |x| y * (n + 1) + x))
        .flat_map(|a| [[a, a + 1, a + n + 2], [a, a + n + 2, a + n + 1]])
        .collect();
    scene(vec![mesh(positions, triangles, None)], vec![(0, None)])
}

/// A backend that answers what a function makes of the true answer.
struct Bent<F> {
    accel: BvhAccel,
    bend: F,
}

impl<F: Fn(&Ray, Option<Hit>) -> Option<Hit> + Send + Sync> Accel for Bent<F> {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        (self.bend)(ray, self.accel.intersect(ray))
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.intersect(ray).is_some()
    }

    fn memory_bytes(&self) -> usize {
        self.accel.memory_bytes()
    }
}

/// What the cross-check makes of one ray when a second backend bends the BVH's answer.
fn judged(
    scene: &Scene,
    ray: Ray,
    bend: impl Fn(&Ray, Option<Hit>) -> Option<Hit> + Send + Sync,
) -> (Counts, Checked) {
    let honest = BvhAccel::build(scene).unwrap();
    let bent = Bent { accel: BvhAccel::build(scene).unwrap(), bend };
    let subjects = [Subject { name: "honest", accel: &honest }, Subject { name: "bent", accel: &bent }];
    let checked = check_rays(&Judge::new(scene), &subjects, &[ray]);
    assert_eq!(checked.counts[0], Counts { agree: 1, ..Counts::default() }, "the honest backend");
    (checked.counts[1], checked)
}

const TIE: Counts = Counts { agree: 0, tie: 1, graze: 0, in_plane: 0, unexplained: 0 };
const GRAZE: Counts = Counts { agree: 0, tie: 0, graze: 1, in_plane: 0, unexplained: 0 };
const IN_PLANE: Counts = Counts { agree: 0, tie: 0, graze: 0, in_plane: 1, unexplained: 0 };
const UNEXPLAINED: Counts = Counts { agree: 0, tie: 0, graze: 0, in_plane: 0, unexplained: 1 };

fn down(x: f32, y: f32) -> Ray {
    Ray::new(Vec3::new(x, y, 1.0), Vec3::NEG_Z)
}

/// The promise of the whole check: a backend that loses one hit in a million is found out.
#[test]
fn a_backend_that_drops_one_hit_in_a_million_is_caught() {
    let scene = sheet(40);
    let asked = AtomicU64::new(0);
    let bend = |_: &Ray, hit: Option<Hit>| {
        hit.filter(|_| asked.fetch_add(1, Ordering::Relaxed) % 1_000_000 != 999_999)
    };
    let honest = BvhAccel::build(&scene).unwrap();
    let broken = Bent { accel: BvhAccel::build(&scene).unwrap(), bend };
    let subjects = [Subject { name: "honest", accel: &honest }, Subject { name: "broken", accel: &broken }];
    let report = crosscheck(&scene, &[], &subjects, &Options { rays: 1_200_000, seed: 1 }, &|_| ());
    let hits = asked.into_inner();
    assert!(hits > 3_000_000, "{hits} hits are too few for the promise");
    assert!(!report.is_clean(), "none of {} lost hits of {hits} was noticed", hits / 1_000_000);
    let totals = report.totals();
    assert_eq!(totals[0].unexplained, 0, "the honest backend is not to blame");
    assert!(totals[1].unexplained <= hits / 1_000_000);
    assert!(report.unexplained.iter().all(|one| one.backend == "broken"));
}

/// Who lets one lane of a packet answer for an inactive one writes into memory that nobody gave away.
#[test]
fn an_answer_of_an_inactive_lane_is_unexplained() {
    struct Careless(BvhAccel);
    impl Accel for Careless {
        fn intersect(&self, ray: &Ray) -> Option<Hit> {
            self.0.intersect(ray)
        }
        fn occluded(&self, ray: &Ray) -> bool {
            self.0.occluded(ray)
        }
        fn intersect_packet<const N: usize>(&self, _: LaneMask, packet: &mut RayHitPacket<N>, c: Coherence) {
            self.0.intersect_packet(u32::MAX, packet, c);
        }
        fn occluded_packet<const N: usize>(
            &self,
            active: LaneMask,
            packet: &mut RayPacket<N>,
            c: Coherence,
        ) -> LaneMask {
            self.0.occluded_packet(active, packet, c)
        }
        fn memory_bytes(&self) -> usize {
            0
        }
    }
    let scene = square(None);
    let careless = Careless(BvhAccel::build(&scene).unwrap());
    let subjects = [Subject { name: "careless", accel: &careless }];
    let checked = check_rays(&Judge::new(&scene), &subjects, &[down(0.3, 0.2)]);
    assert_eq!(checked.counts[0], UNEXPLAINED);
    assert_eq!(checked.unexplained[0].answer, None);
}

/// On the diagonal both triangles are equally near: either may be named.
#[test]
fn either_triangle_of_a_shared_edge_is_a_tie() {
    let bend = |_: &Ray, hit: Option<Hit>| hit.map(|hit| Hit { triangle: 1 - hit.triangle, ..hit });
    assert_eq!(judged(&square(None), down(0.5, 0.5), bend).0, TIE);
    assert_eq!(judged(&square(None), down(0.5, 0.25), bend).0, UNEXPLAINED, "away from the edge");
}

/// Of two triangles in one place either may be named; of two that are apart by more than rounding the nearer.
#[test]
fn either_of_two_coincident_triangles_is_a_tie() {
    let corners = |z: f32| [[0.0, 0.0, z], [1.0, 0.0, z], [0.0, 1.0, z]];
    for (gap, class) in [(0.0, TIE), (1e-3, UNEXPLAINED)] {
        let positions = corners(0.0).into_iter().chain(corners(-gap)).collect();
        let scene = scene(vec![mesh(positions, vec![[0, 1, 2], [3, 4, 5]], None)], vec![(0, None)]);
        let bend = move |_: &Ray, hit: Option<Hit>| hit.map(|hit| Hit { triangle: 1, t: 1.0 + gap, ..hit });
        assert_eq!(judged(&scene, down(0.2, 0.3), bend).0, class, "gap {gap}");
    }
}

/// Whether a ray through the rim hits is a matter of rounding. 10⁻⁸ is below that of coordinates about 1, which
/// is 6·10⁻⁸; 10⁻⁴ is far above.
#[test]
fn a_miss_is_a_graze_at_the_rim_and_unexplained_inside() {
    let miss = |_: &Ray, _: Option<Hit>| None;
    assert_eq!(judged(&square(None), down(0.5, 0.0), miss).0, GRAZE);
    assert_eq!(judged(&square(None), down(0.5, 1e-8), miss).0, GRAZE);
    assert_eq!(judged(&square(None), down(0.5, 1e-4), miss).0, UNEXPLAINED);
    // The same the other way round: a hit beside the rim.
    let hit = |_: &Ray, _: Option<Hit>| Some(Hit { t: 1.0, u: 0.5, v: 0.0, instance: 0, triangle: 0 });
    assert_eq!(judged(&square(None), down(0.5, -1e-8), hit).0, GRAZE);
    assert_eq!(judged(&square(None), down(0.5, -1e-4), hit).0, UNEXPLAINED);
}

/// At an end of the interval rounding decides, elsewhere it doesn't.
#[test]
fn a_miss_is_a_graze_at_the_ends_of_the_interval() {
    let miss = |_: &Ray, _: Option<Hit>| None;
    for (t_near, t_far, class) in
        [(0.0, 1.0, GRAZE), (1.0, 2.0, GRAZE), (0.0, 1.001, UNEXPLAINED), (0.999, 2.0, UNEXPLAINED)]
    {
        let ray = Ray { t_near, t_far, ..down(0.5, 0.2) };
        assert_eq!(judged(&square(None), ray, miss).0, class, "from {t_near} to {t_far}");
    }
}

/// In a triangle's plane a distance is one rounding over another: it is put down to that where it lies nowhere on the
/// triangle, though that is behind the ray, and a miss is as good as a hit.
#[test]
fn rays_in_the_plane_of_a_triangle_are_told_apart() {
    let ray = Ray::new(Vec3::new(-1.0, 0.5, 0.0), Vec3::X);
    let beyond = |_: &Ray, _: Option<Hit>| Some(Hit { t: 77.0, u: 0.5, v: 0.0, instance: 0, triangle: 0 });
    assert_eq!(judged(&square(None), ray, beyond).0, IN_PLANE);
    let on_it = |_: &Ray, _: Option<Hit>| Some(Hit { t: 1.2, u: 0.5, v: 0.0, instance: 0, triangle: 0 });
    assert!([TIE, GRAZE].contains(&judged(&square(None), ray, on_it).0));
    let away = Ray::new(Vec3::new(-1.0, 0.5, 0.0), Vec3::NEG_X);
    assert_eq!(judged(&square(None), away, beyond).0, IN_PLANE, "whose triangles lie behind it");
    let tilted = Ray::new(Vec3::new(-1.0, 0.5, 0.2), Vec3::new(1.5, 0.0, -0.2));
    assert_eq!(judged(&square(None), tilted, beyond).0, UNEXPLAINED, "a ray that crosses the plane");
}

/// The right triangle at a wrong distance is wrong.
#[test]
fn a_wrong_distance_is_unexplained() {
    for (off, class) in [(0.0, Counts { agree: 1, ..Counts::default() }), (1e-4, UNEXPLAINED)] {
        let bend = move |_: &Ray, hit: Option<Hit>| hit.map(|hit| Hit { t: hit.t + off, ..hit });
        assert_eq!(judged(&square(None), down(0.5, 0.2), bend).0, class, "off by {off}");
    }
}

/// An alpha mask's rim is a matter of rounding too; its inside and outside aren't.
#[test]
fn alpha_masks_are_judged_by_where_their_rim_is() {
    // Triangle 0 has u = x − y and v = y: it is opaque where x − y ≥ 1/4.
    let scene = square(Some(TriangleMaterials::PerTriangle(vec![RIM, 0])));
    let other = |_: &Ray, hit: Option<Hit>| match hit {
        Some(_) => None,
        None => Some(Hit { t: 1.0, u: 0.25, v: 0.25, instance: 0, triangle: 0 }),
    };
    assert_eq!(judged(&scene, down(0.5, 0.25), other).0, GRAZE, "on the rim");
    assert_eq!(judged(&scene, down(0.6, 0.25), other).0, UNEXPLAINED, "where it is opaque");
    assert_eq!(judged(&scene, down(0.4, 0.25), other).0, UNEXPLAINED, "in the hole");
}

/// Rays are brought into an instance's space with roundings that grow with its distance from the origin, and the bound
/// grows along.
#[test]
fn instances_are_judged_with_the_rounding_of_their_placement() {
    let mirrored = Affine3A::from_scale(Vec3::new(-1.0, 2.0, 1.0));
    for (shift, depth, class) in [(0.0, 1e-4, UNEXPLAINED), (1e4, 1e-4, GRAZE), (1e4, 0.5, UNEXPLAINED)] {
        let place = Affine3A::from_translation(Vec3::new(shift, shift, 0.0)) * mirrored;
        let flat = square(None);
        let scene = scene(flat.meshes.clone(), vec![(0, Some(place))]);
        let ray = Ray::new(Vec3::new(shift - 0.5, shift, 1.0), Vec3::NEG_Z);
        // y runs from 0 to 2; the BVH's own answer may be either at the rim.
        let ray = Ray { origin: ray.origin + depth * Vec3::Y, ..ray };
        let counts = judged(&scene, ray, |_, hit| {
            hit.map_or(Some(Hit { t: 1.0, u: 0.5, v: 0.0, instance: 0, triangle: 0 }), |_| None)
        });
        assert_eq!(counts.0, class, "{shift}, {depth}");
    }
}

/// An error that all backends share shows as well: some of the rays that all agree about are judged.
#[test]
fn what_all_backends_get_wrong_is_caught() {
    let scene = square(None);
    let blind = Bent { accel: BvhAccel::build(&scene).unwrap(), bend: |_: &Ray, _: Option<Hit>| None };
    let subjects = [Subject { name: "blind", accel: &blind }, Subject { name: "blind too", accel: &blind }];
    let rays: Vec<_> = (0..64).map(|i| down(0.01 + i as f32 / 70.0, 0.3)).collect();
    let checked = check_rays(&Judge::new(&scene), &subjects, &rays);
    assert!(checked.counts[0].unexplained > 0);
}

/// A report that changed with the number of threads could not be repeated from its seed.
#[test]
fn the_report_does_not_depend_on_the_number_of_threads() {
    let scene = sheet(6);
    let (bvh, brute_force) = (BvhAccel::build(&scene).unwrap(), BruteForceAccel::new(&scene));
    let subjects =
        [Subject { name: "bvh", accel: &bvh }, Subject { name: "brute-force", accel: &brute_force }];
    let reports = [1, 3].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let options = Options { rays: 60_000, seed: 5 };
        pool.install(|| crosscheck(&scene, &[], &subjects, &options, &|_| ()).to_json().to_string())
    });
    assert_eq!(reports[0], reports[1]);
    // The two share their arithmetic, so that they agree on every ray.
    assert!(reports[0].contains(r#""tie":0"#) && !reports[0].contains("in_plane\":1"));
}

/// A tetrahedron without one face lets rays out, and the closed one doesn't.
#[test]
fn escapes_are_counted() {
    let corners = vec![[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
    let faces = [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]];
    for (count, tight) in [(4, true), (3, false)] {
        let scene = scene(vec![mesh(corners.clone(), faces[..count].to_vec(), None)], vec![(0, None)]);
        let bvh = BvhAccel::build(&scene).unwrap();
        let result = watertightness(&scene, &[Subject { name: "bvh", accel: &bvh }], Vec3::ZERO, 30_000, 1);
        assert_eq!(result.is_tight(), tight, "{count} faces: {result}");
        assert_eq!(result.rows.iter().map(|row| row.rays).sum::<u64>(), 30_000);
    }
}

/// A ray in a triangle's plane gets edge functions of pure rounding wherever the triangle is, and a lane of a
/// coherent packet is tested with all that the other lanes come near. A little off the plane nothing excuses the hit.
#[test]
fn only_what_is_seen_edge_on_may_be_hit_from_afar() {
    let scene = square(None);
    let claimed = |_: &Ray, _| Some(Hit { t: 0.25, u: 0.0, v: 0.0, instance: 0, triangle: 0 });
    // Sixty edges aside, where its line never meets the square.
    let beside = |z| Ray::new(Vec3::new(-1.0, 60.0, z), Vec3::X);
    assert_eq!(judged(&scene, beside(0.0), claimed).0, IN_PLANE);
    assert_eq!(judged(&scene, beside(0.01), claimed).0, UNEXPLAINED);
}
