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

use crate::common::triangles::{self, HOLES, INVISIBLE, Random, mesh, scene, sphere};

mod build;
mod hits;
mod robust;

fn single(mesh: Arc<TriangleMesh>) -> Scene {
    scene(vec![mesh], vec![(0, None)])
}

/// Triangles without shared vertices.
fn soup(triangles: impl IntoIterator<Item = [Vec3; 3]>) -> Arc<TriangleMesh> {
    let positions: Vec<_> = triangles.into_iter().flatten().map(|p| p.to_array()).collect();
    let count = positions.len() as u32 / 3;
    mesh(positions, (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(), None)
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
