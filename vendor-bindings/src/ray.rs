//! Single rays, and what they hit.

use crate::packet::is_valid_ray;

/// A ray `origin + t * direction` for `tnear <= t <= tfar`; the direction need not be normalised.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Start point.
    pub origin: [f32; 3],
    /// Direction; t is in units of its length.
    pub direction: [f32; 3],
    /// Start of the valid interval; below 0 it counts as 0.
    pub tnear: f32,
    /// End of the valid interval.
    pub tfar: f32,
}

impl Ray {
    #[inline(always)]
    pub(crate) fn is_valid(&self, largest: f32) -> bool {
        is_valid_ray(self.origin, self.direction, [self.tnear, self.tfar], largest)
    }
}

/// Closest hit of a single ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Ray parameter.
    pub t: f32,
    /// Barycentric coordinate of the triangle's second vertex.
    pub u: f32,
    /// Barycentric coordinate of the triangle's third vertex.
    pub v: f32,
    /// Triangle within the geometry.
    pub prim_id: u32,
    /// Geometry within the scene, or within the instanced scene.
    pub geom_id: u32,
    /// Instance within the scene, [`INVALID_ID`](crate::packet::INVALID_ID) for geometry that is not instanced.
    pub inst_id: u32,
}
