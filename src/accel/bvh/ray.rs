//! Rays with what boxes and triangles need precomputed.

use super::lanes::map3;
use crate::scene::Ray;

/// A ray that is fit for traversal.
#[derive(Clone, Copy, Debug)]
pub struct SingleRay {
    pub origin: [f32; 3],
    /// Reciprocal of the direction, finite.
    pub reciprocal: [f32; 3],
    /// Origin times reciprocal.
    pub scaled_origin: [f32; 3],
    /// 1 where the direction is negative.
    pub signs: [usize; 3],
    /// kx, ky, kz of Woop et al.: kz is the axis of the largest direction component.
    pub axes: [usize; 3],
    /// Sx, Sy, Sz of Woop et al.
    pub shear: [f32; 3],
    pub t_near: f32,
    pub t_far: f32,
}

impl SingleRay {
    /// Prepares a ray; `None` if it can't hit anything: a component that isn't finite, no direction,
    /// an empty interval. Intervals are cut to t ≥ 0.
    #[inline(always)]
    pub fn new(ray: &Ray) -> Option<Self> {
        let origin = ray.origin.to_array();
        let direction = ray.direction.to_array();
        let largest = ray.direction.abs().max_element();
        // Adding 0 turns −0 into 0, whose bits sort first.
        let t_near = ray.t_near.max(0.0) + 0.0;
        let finite = ray.origin.is_finite() && ray.direction.is_finite() && !ray.t_near.is_nan();
        if !(finite && largest > 0.0 && t_near <= ray.t_far) {
            return None;
        }
        let scales = map3([0, 1, 2], |axis| safe_reciprocal(origin[axis], direction[axis], largest));
        let (axes, shear) = shear(direction);
        Some(Self {
            origin,
            reciprocal: map3(scales, |(reciprocal, _)| reciprocal),
            scaled_origin: map3(scales, |(_, scaled)| scaled),
            signs: map3(direction, |d| usize::from(d.is_sign_negative())),
            axes,
            shear,
            t_near,
            // Keeps a t that overflowed from counting as a hit.
            t_far: ray.t_far.min(f32::MAX),
        })
    }
}

/// 1/d and origin/d along one axis, both finite.
///
/// Directions below 10⁻¹⁸ of the largest component count as that much, and no reciprocal is so large
/// that it takes the origin beyond what a float holds. The boxes' padding is wider than what a ray whose
/// direction is changed by so little moves along the axis.
#[inline(always)]
pub fn safe_reciprocal(origin: f32, d: f32, largest: f32) -> (f32, f32) {
    let least = largest * 1e-18;
    let d = if d.abs() < least { least.copysign(d) } else { d };
    let reciprocal = (1.0 / d).clamp(-f32::MAX, f32::MAX);
    let scaled = origin * reciprocal;
    if scaled.abs() <= f32::MAX {
        return (reciprocal, scaled);
    }
    let reciprocal = (1e37 / origin.abs()).copysign(d);
    (reciprocal, origin * reciprocal)
}

/// Axes and shear of Woop, Benthin, Wald (2013). The axes keep their cyclic order: since hits on both
/// sides count, the winding doesn't matter.
#[inline(always)]
pub fn shear(direction: [f32; 3]) -> ([usize; 3], [f32; 3]) {
    let kz = largest_axis(direction);
    let kx = if kz == 2 { 0 } else { kz + 1 };
    let ky = if kx == 2 { 0 } else { kx + 1 };
    let dz = direction[kz];
    ([kx, ky, kz], [direction[kx] / dz, direction[ky] / dz, 1.0 / dz])
}

/// The axis with the largest component, the first of equals.
#[inline(always)]
pub fn largest_axis(direction: [f32; 3]) -> usize {
    let [x, y, z] = map3(direction, f32::abs);
    if x >= y && x >= z {
        0
    } else if y >= z {
        1
    } else {
        2
    }
}
