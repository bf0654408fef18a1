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

use crate::common::triangles::{HOLES, INVISIBLE, Random, mesh, scene, soup, sphere};

mod hits;
mod robust;

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
