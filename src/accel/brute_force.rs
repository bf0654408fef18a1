//! Every ray against every triangle: slow, and simple enough to be seen to be right.

use std::sync::Arc;

use glam::Vec3;

use crate::scene::{AlphaMasks, Hit, MaskedMesh, Ray, Scene, TriangleMesh};

use super::bvh::WorldToObject;
use super::{Accel, MAX_COORDINATE, is_valid_ray, largest_coordinate};

/// The reference backend for tests.
///
/// It is the watertight test of Woop, Benthin and Wald (2013), one triangle after the other, with no
/// boxes, no SIMD and no stack. Its arithmetic is that of the BVH, so that hits must agree to the last bit.
pub struct BruteForceAccel {
    instances: Vec<Placed>,
    /// Largest magnitude of the coordinates of rays that can hit anything.
    largest: f32,
}

struct Placed {
    mesh: Arc<TriangleMesh>,
    /// The mesh with its alpha masks, if it has any.
    masked: Option<MaskedMesh>,
    placement: Placement,
}

enum Placement {
    World,
    Instanced(WorldToObject),
    /// The transform has no inverse: never hit.
    Nowhere,
}

impl BruteForceAccel {
    /// Takes hold of the scene's meshes. Instances of meshes that don't exist are left out.
    pub fn new(scene: &Scene) -> Self {
        let masks = AlphaMasks::of_scene(scene);
        let instances = scene.instances.iter().filter_map(|instance| {
            let placement = match &instance.to_world {
                None => Placement::World,
                Some(to_world) => {
                    WorldToObject::new(to_world).map_or(Placement::Nowhere, Placement::Instanced)
                }
            };
            let mesh = scene.meshes.get(instance.mesh as usize)?.clone();
            let masked = masks.of_mesh(&mesh);
            Some(Placed { mesh, masked, placement })
        });
        Self { instances: instances.collect(), largest: largest_coordinate(scene) }
    }

    /// Calls `found` with every hit; stops when that returns true.
    fn each_hit(&self, ray: &Ray, mut found: impl FnMut(Hit) -> bool) {
        if !is_valid_ray(ray, self.largest) {
            return;
        }
        for (instance, Placed { mesh, masked, placement }) in self.instances.iter().enumerate() {
            let local = match placement {
                Placement::World => *ray,
                Placement::Instanced(to_object) => to_object.ray(ray),
                Placement::Nowhere => continue,
            };
            let finite = local.origin.is_finite() && local.direction.is_finite() && !local.t_near.is_nan();
            if !finite || local.direction == Vec3::ZERO {
                continue;
            }
            for triangle in 0..mesh.triangles.len() as u32 {
                let Some((t, u, v)) = hit_triangle(&local, mesh.corners(triangle)) else { continue };
                if masked.as_ref().is_some_and(|masked| !masked.is_opaque(triangle, u, v)) {
                    continue;
                }
                if found(Hit { t, u, v, instance: instance as u32, triangle }) {
                    return;
                }
            }
        }
    }
}

/// t, u, v of a hit with t in the ray's interval, cut to t ≥ 0.
fn hit_triangle(ray: &Ray, corners: [Vec3; 3]) -> Option<(f32, f32, f32)> {
    if !corners.iter().all(|corner| corner.abs().cmple(Vec3::splat(MAX_COORDINATE)).all()) {
        return None;
    }
    let d = ray.direction;
    let size = d.abs();
    let kz = match (size.x >= size.y && size.x >= size.z, size.y >= size.z) {
        (true, _) => 0,
        (false, true) => 1,
        (false, false) => 2,
    };
    let (kx, ky) = ((kz + 1) % 3, (kz + 2) % 3);
    let (shear_x, shear_y, shear_z) = (d[kx] / d[kz], d[ky] / d[kz], 1.0 / d[kz]);
    let [a, b, c] = corners.map(|corner| {
        let moved = corner - ray.origin;
        [moved[kx] - shear_x * moved[kz], moved[ky] - shear_y * moved[kz], moved[kz]]
    });
    let edge = |p: [f32; 3], q: [f32; 3]| p[0] * q[1] - p[1] * q[0];
    let (u, v, w) = (edge(c, b), edge(a, c), edge(b, a));
    let (determinant, z) = (u + v + w, [a, b, c].map(|p| shear_z * p[2]));
    let scaled = u * z[0] + v * z[1] + w * z[2];
    let decided = u != 0.0 && v != 0.0 && w != 0.0 && determinant.is_finite() && scaled.is_finite();
    let (t, u, v) = if decided {
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        (scaled / determinant, v / determinant, w / determinant)
    } else {
        exact(a, b, c, shear_z)?
    };
    (t.is_finite() && ray.t_near.max(0.0) <= t && t <= ray.t_far).then_some((t, u, v))
}

/// The same in double precision, where an edge function is 0 or too large.
fn exact(a: [f32; 3], b: [f32; 3], c: [f32; 3], shear_z: f32) -> Option<(f32, f32, f32)> {
    let [a, b, c] = [a, b, c].map(|p| p.map(f64::from));
    let edge = |p: [f64; 3], q: [f64; 3]| p[0] * q[1] - p[1] * q[0];
    let (u, v, w) = (edge(c, b), edge(a, c), edge(b, a));
    let determinant = u + v + w;
    if determinant == 0.0 || (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
        return None;
    }
    let t = f64::from(shear_z) * (u * a[2] + v * b[2] + w * c[2]) / determinant;
    Some((t as f32, (v / determinant) as f32, (w / determinant) as f32))
}

impl Accel for BruteForceAccel {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        let mut best: Option<Hit> = None;
        self.each_hit(ray, |hit| {
            // Hits come in the order of instances and triangles, so the first of equals stays.
            if best.is_none_or(|best| hit.t < best.t) {
                best = Some(hit);
            }
            false
        });
        best
    }

    fn occluded(&self, ray: &Ray) -> bool {
        let mut blocked = false;
        self.each_hit(ray, |_| {
            blocked = true;
            true
        });
        blocked
    }

    fn memory_bytes(&self) -> usize {
        self.instances.capacity() * size_of::<Placed>()
    }
}
