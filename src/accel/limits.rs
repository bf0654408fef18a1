//! Which rays, triangles and placements take part in ray queries; the same for every backend.

use embree_sys::{packet, placement};
use glam::Affine3A;

use crate::scene::{Ray, Scene};

pub use packet::{MAX_COORDINATE, MIN_DIRECTION};

/// Whether a ray can hit anything: no component of its origin and direction is NaN or larger than `largest`, that of
/// [`largest_coordinate`]; some component of its direction reaches [`MIN_DIRECTION`]; and its interval has a
/// t ≥ 0.
#[inline(always)]
pub fn is_valid_ray(ray: &Ray, largest: f32) -> bool {
    packet::is_valid_ray(ray.origin.to_array(), ray.direction.to_array(), [ray.t_near, ray.t_far], largest)
}

/// Largest magnitude of the coordinates of rays that can hit anything in a scene: [`MAX_COORDINATE`], or less
/// where instances scale rays up, but never below 10⁹.
pub fn largest_coordinate(scene: &Scene) -> f32 {
    let placed = scene.instances.iter().filter_map(|instance| instance.to_world.as_ref());
    placed.filter_map(largest_coordinate_of).fold(MAX_COORDINATE, f32::min)
}

/// The same for one placement; `None` for one that can't be undone, whose triangles are never hit: it is
/// not finite, or flattens space to less than 10⁻⁵, or leaves less than 10⁹ for rays.
pub fn largest_coordinate_of(to_world: &Affine3A) -> Option<f32> {
    placement::largest_coordinate(&columns(to_world))
}

/// The axes of a placement, then its origin.
pub(super) fn columns(map: &Affine3A) -> [[f32; 3]; 4] {
    [map.matrix3.x_axis, map.matrix3.y_axis, map.matrix3.z_axis, map.translation].map(|v| v.to_array())
}
