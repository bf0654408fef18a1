//! Placements of instances in double precision, with what single precision makes of them.

use glam::{Affine3A, DMat3, DVec3};

use super::local_ray::{BOUND, LocalRay};
use crate::Bounds;
use crate::accel::largest_coordinate_of;
use crate::scene::Ray;

/// Where an instance's triangles are.
#[derive(Clone, Debug)]
pub enum Placement {
    /// The mesh is in world space already.
    World,
    /// Moved by a map that can be undone.
    Placed(Box<Inverse>),
    /// Nowhere: the map can't be undone, and no ray hits the instance.
    Nowhere,
}

/// The map from world to object space, and the errors of one that was computed in single precision.
#[derive(Clone, Debug)]
pub struct Inverse {
    to_world: [DVec3; 4],
    matrix: DMat3,
    translation: DVec3,
    /// Bounds of the errors of `matrix`, entry by entry.
    matrix_error: DMat3,
    /// Bound of the error of `translation`.
    translation_error: f64,
}

impl Placement {
    /// Takes the map from object to world space.
    pub fn new(to_world: Option<&Affine3A>) -> Self {
        let Some(to_world) = to_world else { return Self::World };
        if largest_coordinate_of(to_world).is_none() {
            return Self::Nowhere;
        }
        let axes = [to_world.matrix3.x_axis, to_world.matrix3.y_axis, to_world.matrix3.z_axis];
        let [x, y, z] = axes.map(|axis| axis.as_dvec3());
        let translation = to_world.translation.as_dvec3();
        // Cramer's rule: rows of the adjugate over the determinant. The same with absolute values and sums bounds
        // the rounding.
        let adjugate = [y.cross(z), z.cross(x), x.cross(y)];
        let absolute = [cross_of_sizes(y, z), cross_of_sizes(z, x), cross_of_sizes(x, y)];
        let determinant = x.dot(adjugate[0]);
        let size = x.abs().dot(absolute[0]);
        let rows = adjugate.map(|row| row / determinant);
        let row_errors: [DVec3; 3] = std::array::from_fn(|i| {
            BOUND * (absolute[i] / determinant.abs() + rows[i].abs() * (size / determinant.abs()))
        });
        let matrix = DMat3::from_cols(rows[0], rows[1], rows[2]).transpose();
        let matrix_error = DMat3::from_cols(row_errors[0], row_errors[1], row_errors[2]).transpose();
        let back = rows.map(|row| row.abs().dot(translation.abs()));
        let doubt = row_errors.map(|row| row.dot(translation.abs()));
        let translation_error = (DVec3::from_array(back) * BOUND + DVec3::from_array(doubt)).length();
        Self::Placed(Box::new(Inverse {
            to_world: [x, y, z, translation],
            matrix,
            translation: -(matrix * translation),
            matrix_error,
            translation_error,
        }))
    }

    /// The ray in object space; `None` where there is none.
    pub fn ray(&self, ray: &Ray) -> Option<LocalRay> {
        let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        match self {
            Self::World => Some(LocalRay::new(origin, direction, [0.0; 2])),
            Self::Nowhere => None,
            Self::Placed(inverse) => {
                let error = |vector: DVec3| {
                    let rounding = sizes(&inverse.matrix) * vector.abs() * BOUND;
                    (rounding + inverse.matrix_error * vector.abs()).length()
                };
                let errors = [error(origin) + inverse.translation_error, error(direction)];
                let moved = inverse.matrix * origin + inverse.translation;
                Some(LocalRay::new(moved, inverse.matrix * direction, errors))
            }
        }
    }

    /// Box in world space of a box in object space, with room for the doubt that a ray has in object space.
    pub fn world_bounds(&self, bounds: &Bounds) -> Option<Bounds> {
        match self {
            Self::World => Some(*bounds),
            Self::Nowhere => None,
            Self::Placed(inverse) => {
                let [x, y, z, translation] = inverse.to_world;
                let mut moved = Bounds::EMPTY;
                let (low, high) = (bounds.min.as_dvec3(), bounds.max.as_dvec3());
                for corner in 0..8 {
                    let pick = |axis: usize| if corner >> axis & 1 == 0 { low[axis] } else { high[axis] };
                    let point = x * pick(0) + y * pick(1) + z * pick(2) + translation;
                    moved.extend(point.as_vec3());
                }
                let room = 1e-3 * moved.extent().max_element()
                    + 1e-4 * moved.min.abs().max(moved.max.abs()).max_element();
                Some(Bounds { min: moved.min - room, max: moved.max + room })
            }
        }
    }
}

fn cross_of_sizes(a: DVec3, b: DVec3) -> DVec3 {
    let (a, b) = (a.abs(), b.abs());
    DVec3::new(a.y * b.z + a.z * b.y, a.z * b.x + a.x * b.z, a.x * b.y + a.y * b.x)
}

fn sizes(matrix: &DMat3) -> DMat3 {
    DMat3::from_cols(matrix.x_axis.abs(), matrix.y_axis.abs(), matrix.z_axis.abs())
}
