//! Moving geometry into world space.

use std::sync::Arc;

use glam::{Affine3A, DMat3, Mat3A, Vec3};
use rayon::prelude::*;

use crate::scene::{Positions, TriangleMesh};

/// Whether directions survive a linear map.
pub fn is_invertible(linear: &Mat3A) -> bool {
    let determinant = double(linear).determinant();
    determinant != 0.0 && determinant.is_finite()
}

/// Moves vertices and normals; mirrored triangles are turned, so that their front stays their front.
pub fn move_mesh(mesh: &mut TriangleMesh, to_world: &Affine3A) {
    let moved = |position: &[f32; 3]| to_world.transform_point3(Vec3::from_array(*position)).to_array();
    mesh.positions = Positions::new(mesh.positions.as_slice().par_iter().map(moved).collect());
    let linear = double(&to_world.matrix3);
    if let Some(normals) = &mut mesh.normals {
        let normal_map = linear.inverse().transpose();
        normals.par_iter_mut().for_each(|normal| {
            let turned = normal_map * glam::DVec3::from_array(normal.map(f64::from));
            *normal = turned.try_normalize().map_or(*normal, |n| n.as_vec3().to_array());
        });
    }
    if linear.determinant() < 0.0 {
        let turned = mesh.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect();
        mesh.triangles = Arc::new(turned);
    }
}

fn double(linear: &Mat3A) -> DMat3 {
    DMat3::from_cols(linear.x_axis.as_dvec3(), linear.y_axis.as_dvec3(), linear.z_axis.as_dvec3())
}
