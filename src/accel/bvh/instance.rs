//! Placed trees: rays go to object space, boxes to world space.

use glam::{Affine3A, DAffine3, DVec3, Vec3};

use crate::accel::largest_coordinate_of;

use super::lanes::map3;
use crate::scene::Ray;

/// The map of rays from world to object space, row by row; t is the same on both sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorldToObject([[f32; 4]; 3]);

impl WorldToObject {
    /// The inverse of a placement; `None` if it has none: such an instance is never hit.
    pub fn new(to_world: &Affine3A) -> Option<Self> {
        largest_coordinate_of(to_world)?;
        let to_world = double(to_world);
        let inverse = to_world.inverse();
        let columns =
            [inverse.matrix3.x_axis, inverse.matrix3.y_axis, inverse.matrix3.z_axis, inverse.translation];
        let rows = [0, 1, 2].map(|row| columns.map(|column| column[row] as f32));
        rows.as_flattened().iter().all(|e| e.is_finite()).then_some(Self(rows))
    }

    /// A point in object space. The sums have one order and no fused products, so that single rays
    /// and packets agree.
    #[inline(always)]
    pub fn point(&self, [x, y, z]: [f32; 3]) -> [f32; 3] {
        map3(self.0, |row| row[0] * x + row[1] * y + row[2] * z + row[3])
    }

    /// A direction in object space, its length scaled along.
    #[inline(always)]
    pub fn direction(&self, [x, y, z]: [f32; 3]) -> [f32; 3] {
        map3(self.0, |row| row[0] * x + row[1] * y + row[2] * z)
    }

    /// A ray in object space.
    #[inline(always)]
    pub fn ray(&self, ray: &Ray) -> Ray {
        Ray {
            origin: Vec3::from_array(self.point(ray.origin.to_array())),
            direction: Vec3::from_array(self.direction(ray.direction.to_array())),
            ..*ray
        }
    }
}

/// World-space box of an object-space box; `None` if it is not finite.
///
/// It is a little too large, since a ray that was rounded on its way to object space may hit what
/// lies just beside it in world space.
pub fn world_bounds(to_world: &Affine3A, [lower, upper]: [[f32; 3]; 2]) -> Option<[[f32; 3]; 2]> {
    let to_world = double(to_world);
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for corner in 0..8 {
        let pick = |axis: usize| f64::from(if corner >> axis & 1 == 0 { lower[axis] } else { upper[axis] });
        let point = to_world.transform_point3(DVec3::new(pick(0), pick(1), pick(2)));
        (low, high) = (low.min(point), high.max(point));
    }
    let padding = 1e-5 * (high - low).max_element() + 1e-6 * low.abs().max(high.abs()).max_element();
    let bounds = [low - padding, high + padding].map(|p| p.as_vec3().to_array());
    bounds.as_flattened().iter().all(|c| c.is_finite()).then_some(bounds)
}

fn double(transform: &Affine3A) -> DAffine3 {
    DAffine3::from_cols(
        transform.matrix3.x_axis.as_dvec3(),
        transform.matrix3.y_axis.as_dvec3(),
        transform.matrix3.z_axis.as_dvec3(),
        transform.translation.as_dvec3(),
    )
}
