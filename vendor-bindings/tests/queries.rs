//! Queries give the right answers, the same for single rays and for packets of every width.

mod common;

use std::sync::Arc;

use common::{Random, device, devices, down, floor, library, scene_of};
use embree_sys::{
    Device, Hit, Ray, Scene, SceneBuilder,
    packet::{INVALID_ID, RayHitPacket, RayPacket},
};

fn set<const N: usize>(packet: &mut RayPacket<N>, lane: usize, ray: &Ray) {
    [packet.org_x[lane], packet.org_y[lane], packet.org_z[lane]] = ray.origin;
    [packet.dir_x[lane], packet.dir_y[lane], packet.dir_z[lane]] = ray.direction;
    (packet.tnear[lane], packet.tfar[lane]) = (ray.tnear, ray.tfar);
}

fn get<const N: usize>(packet: &RayHitPacket<N>, lane: usize) -> Option<Hit> {
    let hit = &packet.hit;
    (hit.geom_id[lane] != INVALID_ID).then(|| Hit {
        t: packet.ray.tfar[lane],
        u: hit.u[lane],
        v: hit.v[lane],
        prim_id: hit.prim_id[lane],
        geom_id: hit.geom_id[lane],
        inst_id: hit.inst_id[lane],
    })
}

/// Nearest hits of all rays in packets of N, the last one partly filled.
fn in_packets<const N: usize>(scene: &Scene, rays: &[Ray], coherent: bool) -> (Vec<Option<Hit>>, Vec<bool>) {
    let (mut hits, mut blocked) = (Vec::new(), Vec::new());
    for rays in rays.chunks(N) {
        let mut packet = RayHitPacket::<N>::empty();
        rays.iter().enumerate().for_each(|(lane, ray)| set(&mut packet.ray, lane, ray));
        let mut shadow = packet.ray;
        let active = (1u32 << rays.len()) - 1;
        scene.intersect_packet(active, &mut packet, coherent);
        let mask = scene.occluded_packet(active, &mut shadow, coherent);
        hits.extend((0..rays.len()).map(|lane| get(&packet, lane)));
        blocked.extend((0..rays.len()).map(|lane| mask >> lane & 1 == 1));
    }
    (hits, blocked)
}

/// Straight down onto the floor, where cell, triangle, t, u and v can be read off the origin.
#[test]
fn hits_are_where_geometry_says() {
    let Some(device) = device() else { return };
    let scene = scene_of(&device, floor(8), None);
    let mut random = Random(1);
    for _ in 0..1000 {
        let (x, y) = (8.0 * random.next(), 8.0 * random.next());
        let (cx, cy) = (x.floor(), y.floor());
        let (fx, fy) = (x - cx, y - cy);
        if (fx + fy - 1.0).abs() < 1e-3 || fx.min(fy) < 1e-3 || fx.max(fy) > 0.999 {
            continue; // near an edge either triangle is right
        }
        let first = fx + fy < 1.0;
        let (u, v) = if first { (fx, fy) } else { (1.0 - fx, 1.0 - fy) };
        let hit = scene.intersect1(&down(x, y)).expect("the floor has no holes");
        assert_eq!(hit.prim_id, 2 * (cy as u32 * 8 + cx as u32) + u32::from(!first));
        assert_eq!((hit.geom_id, hit.inst_id), (0, INVALID_ID));
        assert!((hit.t - 2.0).abs() < 1e-5, "{hit:?}");
        assert!((hit.u - u).abs() < 1e-5 && (hit.v - v).abs() < 1e-5, "{hit:?}, expected {u} {v}");
        assert!(scene.occluded1(&down(x, y)));
    }
    assert_eq!(scene.intersect1(&down(-0.5, 4.0)), None);
    assert!(!scene.occluded1(&down(-0.5, 4.0)));
    // The floor lies outside of the valid interval.
    assert_eq!(scene.intersect1(&Ray { tfar: 1.5, ..down(0.3, 0.3) }), None);
    assert_eq!(scene.intersect1(&Ray { tnear: 2.5, ..down(0.3, 0.3) }), None);
    assert_eq!(scene.bounds(), Some(([0.0; 3], [8.0, 8.0, 0.0])));
}

/// Möller and Trumbore's test in f64: (t, u, v).
fn reference(ray: &Ray, corners: [[f32; 3]; 3]) -> Option<(f64, f64, f64)> {
    let f = |a: [f32; 3]| a.map(f64::from);
    let sub = |a: [f64; 3], b: [f64; 3]| [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let cross = |a: [f64; 3], b: [f64; 3]| {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    };
    let (o, d) = (f(ray.origin), f(ray.direction));
    let [a, b, c] = corners.map(f);
    let (e1, e2) = (sub(b, a), sub(c, a));
    let p = cross(d, e2);
    let det = dot(e1, p);
    let s = sub(o, a);
    let u = dot(s, p) / det;
    let q = cross(s, e1);
    let v = dot(d, q) / det;
    let t = dot(e2, q) / det;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= 0.0 && t <= f64::from(ray.tfar)).then_some((t, u, v))
}

fn soup(random: &mut Random, count: u32) -> common::Buffers {
    let mut vertices = Vec::new();
    for _ in 0..count {
        let centre = random.vector(-10.0, 10.0);
        for _ in 0..3 {
            let offset = random.vector(-2.0, 2.0);
            vertices.push(std::array::from_fn(|axis| centre[axis] + offset[axis]));
        }
    }
    vertices.push([0.0; 3]);
    (Arc::new(vertices), Arc::new((0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect()))
}

fn check_against_reference(device: &Device) {
    let mut random = Random(2);
    let buffers = soup(&mut random, 300);
    let scene = scene_of(device, buffers.clone(), None);
    let rays: Vec<Ray> = (0..1003)
        .map(|_| Ray {
            origin: random.vector(-12.0, 12.0),
            direction: random.vector(-1.0, 1.0),
            tnear: 0.0,
            tfar: 20.0,
        })
        .collect();
    let singles: Vec<_> = rays.iter().map(|ray| scene.intersect1(ray)).collect();
    let blocked: Vec<_> = rays.iter().map(|ray| scene.occluded1(ray)).collect();
    let mut wrong = 0;
    for ((ray, hit), blocked) in rays.iter().zip(&singles).zip(&blocked) {
        let nearest = buffers
            .1
            .iter()
            .zip(0u32..)
            .filter_map(|(t, i)| Some((reference(ray, t.map(|v| buffers.0[v as usize]))?, i)))
            .min_by(|a, b| a.0.0.total_cmp(&b.0.0));
        let same = match (nearest, hit) {
            (None, None) => true,
            (Some(((t, u, v), prim)), Some(hit)) => {
                hit.prim_id == prim
                    && (f64::from(hit.t) - t).abs() < 1e-4 * t.max(1.0)
                    && (f64::from(hit.u) - u).abs() < 1e-3
                    && (f64::from(hit.v) - v).abs() < 1e-3
            }
            _ => false,
        };
        wrong += usize::from(!same || *blocked != nearest.is_some());
    }
    assert!(singles.iter().flatten().count() > 200, "the rays must hit something for this to mean anything");
    // A ray within rounding of an edge may go either way; more than one in 1,000 such is no accident.
    assert!(wrong <= 1, "{wrong} of {} rays differ from the f64 reference", rays.len());

    for coherent in [false, true] {
        for (hits, mask) in [
            in_packets::<4>(&scene, &rays, coherent),
            in_packets::<8>(&scene, &rays, coherent),
            in_packets::<16>(&scene, &rays, coherent),
        ] {
            let differing = hits
                .iter()
                .zip(&singles)
                .filter(|(packet, single)| packet.map(|hit| hit.prim_id) != single.map(|hit| hit.prim_id));
            assert!(differing.count() <= 1, "packets and single rays hit the same");
            let differing = mask.iter().zip(&blocked).filter(|(packet, single)| packet != single);
            assert!(differing.count() <= 1, "packets and single rays are blocked alike");
        }
    }
}

/// Random triangles against an independent computation in f64, single rays and all packets.
#[test]
fn all_forms_agree_with_an_f64_reference() {
    for device in devices() {
        check_against_reference(&device);
    }
}

/// On a processor without AVX, packets of 8 and 16 are not native; they must still be right.
#[test]
fn packets_that_are_not_native_are_right() {
    let Some(library) = library() else { return };
    let device = Device::new(&library, "isa=sse4.2").unwrap();
    assert!(device.native_packets(1) && device.native_packets(4));
    assert!(!device.native_packets(8) && !device.native_packets(16) && !device.native_packets(5));
    check_against_reference(&device);
}

/// Inactive lanes come back as they went in, bit by bit, even full of garbage.
#[test]
fn inactive_lanes_are_untouched() {
    fn check<const N: usize>(scene: &Scene) {
        for (coherent, active) in [false, true].into_iter().flat_map(|coherent| {
            [0u32, 1, 0b0110, 0b1010, 0xf00f, 0xffff_0000].map(|active| (coherent, active))
        }) {
            let mut packet = RayHitPacket::<N>::empty();
            for lane in 0..N {
                set(&mut packet.ray, lane, &down(0.3, 0.3));
                packet.hit.prim_id[lane] = 77;
                packet.hit.u[lane] = 0.123;
                packet.hit.inst_prim_id[lane] = 55;
                // Half of the inactive lanes hold a ray that would hit, the other half garbage.
                if active >> lane & 1 == 0 && lane % 4 < 2 {
                    packet.ray.org_x[lane] = f32::NAN;
                    packet.ray.tfar[lane] = f32::from_bits(0x7fc0_1234);
                }
            }
            let before = packet;
            scene.intersect_packet(active, &mut packet, coherent);
            let mut shadow = before.ray;
            let mask = scene.occluded_packet(active, &mut shadow, coherent);
            assert_eq!(mask, active & ((1 << N) - 1), "exactly the active lanes are blocked");
            for lane in 0..N {
                if active >> lane & 1 == 1 {
                    assert_eq!(packet.hit.geom_id[lane], 0);
                    continue;
                }
                assert_eq!(packet.ray.tfar[lane].to_bits(), before.ray.tfar[lane].to_bits());
                assert_eq!(shadow.tfar[lane].to_bits(), before.ray.tfar[lane].to_bits());
                assert_eq!(packet.ray.org_x[lane].to_bits(), before.ray.org_x[lane].to_bits());
                assert_eq!(packet.hit.geom_id[lane], INVALID_ID);
                assert_eq!(packet.hit.inst_id[lane], INVALID_ID);
                assert_eq!(packet.hit.prim_id[lane], 77);
                assert_eq!(packet.hit.inst_prim_id[lane], 55);
                assert_eq!(packet.hit.u[lane].to_bits(), 0.123f32.to_bits());
            }
        }
    }
    for device in devices() {
        let scene = scene_of(&device, floor(1), None);
        check::<4>(&scene);
        check::<8>(&scene);
        check::<16>(&scene);
    }
}

/// An active lane with the interval [0, −∞] is empty: it must not pass for blocked, whose mark is tfar = −∞.
#[test]
fn an_empty_interval_is_never_blocked() {
    let Some(device) = device() else { return };
    let scene = scene_of(&device, floor(1), None);
    let empty = Ray { tfar: f32::NEG_INFINITY, ..down(0.3, 0.3) };
    assert!(!scene.occluded1(&empty));
    assert_eq!(scene.intersect1(&empty), None);
    let mut packet = RayPacket::<8>::empty();
    set(&mut packet, 0, &down(0.3, 0.3));
    set(&mut packet, 1, &empty);
    assert_eq!(scene.occluded_packet(0xff, &mut packet, true), 1);
}

/// Rays of NaN, infinity, zero and denormals end in some answer, and leave the lanes beside them right.
#[test]
fn garbage_rays_do_no_harm() {
    for device in devices() {
        hit_with_garbage(&scene_of(&device, floor(32), None));
    }
}

fn hit_with_garbage(scene: &Scene) {
    let values = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 0.0, -0.0, 1e-42, 1e30, f32::MAX, -1.0];
    let mut random = Random(3);
    let good = down(10.3, 20.3);
    let mut pick = || values[(random.next() * values.len() as f32) as usize];
    for _ in 0..2000 {
        let garbage = Ray {
            origin: [pick(), pick(), pick()],
            direction: [pick(), pick(), pick()],
            tnear: pick(),
            tfar: pick(),
        };
        scene.intersect1(&garbage);
        scene.occluded1(&garbage);
        let mut packet = RayHitPacket::<16>::empty();
        for lane in 0..16 {
            set(&mut packet.ray, lane, if lane % 2 == 0 { &garbage } else { &good });
        }
        let mut shadow = packet.ray;
        scene.intersect_packet(0xffff, &mut packet, true);
        let mask = scene.occluded_packet(0xffff, &mut shadow, true);
        for lane in (1..16).step_by(2) {
            assert_eq!(get(&packet, lane).map(|hit| hit.prim_id), Some(2 * (20 * 32 + 10)));
            assert!(mask >> lane & 1 == 1);
        }
    }
}

/// Nothing in the scene: nothing hit, no bounds.
#[test]
fn an_empty_scene_is_missed() {
    let Some(device) = device() else { return };
    let scene = SceneBuilder::new(&device).unwrap().commit().unwrap();
    assert_eq!(scene.intersect1(&down(0.0, 0.0)), None);
    assert!(!scene.occluded1(&down(0.0, 0.0)));
    let (hits, blocked) = in_packets::<8>(&scene, &[down(0.0, 0.0); 5], false);
    assert!(hits.iter().all(Option::is_none) && blocked.iter().all(|blocked| !blocked));
    assert_eq!(scene.bounds(), None);
}
