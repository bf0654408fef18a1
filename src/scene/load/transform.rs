//! Moving geometry into world space.

use std::sync::Arc;

use glam::{Affine3A, DMat3, Mat3A, Vec3};
use rayon::prelude::*;

use crate::scene::{Camera, LightShape, PointLight, Positions, TriangleMesh};

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

/// A light in another place; its intensity is that of the file whatever the scale.
pub fn moved_light(light: &PointLight, to_world: &Affine3A) -> PointLight {
    let turned = |direction: Vec3| to_world.transform_vector3(direction).normalize_or(direction);
    let shape = match light.shape {
        LightShape::Point => LightShape::Point,
        LightShape::Spot { direction, inner_cosine, outer_cosine } => {
            LightShape::Spot { direction: turned(direction), inner_cosine, outer_cosine }
        }
        LightShape::Directional { direction } => LightShape::Directional { direction: turned(direction) },
    };
    PointLight { position: to_world.transform_point3(light.position), shape, ..*light }
}

/// A camera in another place.
pub fn moved_camera(camera: &Camera, to_world: &Affine3A) -> Camera {
    Camera {
        position: to_world.transform_point3(camera.position),
        look_at: to_world.transform_point3(camera.look_at),
        up: to_world.transform_vector3(camera.up).normalize_or(camera.up),
        ..camera.clone()
    }
}

fn double(linear: &Mat3A) -> DMat3 {
    DMat3::from_cols(linear.x_axis.as_dvec3(), linear.y_axis.as_dvec3(), linear.z_axis.as_dvec3())
}
