//! Rays, and what they hit.

use glam::Vec3;

/// A ray `origin + t * direction` for `t_near <= t <= t_far`.
///
/// The direction need not be normalised; t is in units of its length. Occlusion rays between two
/// points therefore have the difference as direction and `t_far = 1`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Start point, scene units.
    pub origin: Vec3,
    /// Direction, of any length; but one without a component of at least 10⁻¹⁰ is none, and hits nothing.
    pub direction: Vec3,
    /// Start of the valid interval.
    pub t_near: f32,
    /// End of the valid interval.
    pub t_far: f32,
}

impl Ray {
    /// Ray from `origin` along `direction`, from t = 0 to infinity.
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Self { origin, direction, t_near: 0.0, t_far: f32::INFINITY }
    }

    /// Ray that covers the open segment between two points: t runs from 0 to 1.
    pub fn between(from: Vec3, to: Vec3) -> Self {
        Self { origin: from, direction: to - from, t_near: 0.0, t_far: 1.0 }
    }
}

/// Closest hit of a ray, the same for every acceleration structure.
///
/// The point is `(1 − u − v)·v0 + u·v1 + v·v2` of the named triangle. It carries no normal: normals
/// come from the scene's vertices, so that they don't differ between acceleration structures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Ray parameter of the hit.
    pub t: f32,
    /// Barycentric coordinate of the second vertex.
    pub u: f32,
    /// Barycentric coordinate of the third vertex.
    pub v: f32,
    /// Index into [`Scene::instances`](super::Scene::instances).
    pub instance: u32,
    /// Triangle within the instance's mesh.
    pub triangle: u32,
}
