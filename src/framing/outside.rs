//! Views from outside.

use glam::{Vec2, Vec3};

use super::probe::{Probe, Sight};
use crate::accel::Accel;
use crate::render::CameraRays;
use crate::scene::{Bounds, Camera};

/// Vertical field of view, degrees.
const FOV: f32 = 40.0;
/// Towards the camera from the model's middle: from the front, somewhat from the right and above.
const DIRECTION: Vec3 = Vec3::new(0.55, 0.42, 1.0);
/// Room around the model.
const MARGIN: f32 = 1.05;
/// Rays that look at what a view shows.
const RASTER: (u32, u32) = (32, 24);
/// Share of the surfaces in view that must be sheltered for a side to count as open.
const OPEN: f32 = 0.7;
/// Share of the directions above a surface that must end on others for it to count as sheltered.
const SHELTERED: f32 = 0.5;

/// The model from the front.
pub fn from_the_front<A>(probe: &Probe<A>, aspect: f32) -> Camera {
    framing(probe, DIRECTION, aspect)
}

/// The view straight through a side of the model that is open, of the four around it.
pub fn through_an_open_side<A: Accel>(probe: &Probe<A>, aspect: f32) -> Option<Camera> {
    let sides = [Vec3::Z, Vec3::NEG_Z, Vec3::X, Vec3::NEG_X].map(|direction| {
        let camera = framing(probe, direction, aspect);
        let sheltered = share(probe, &camera, |sight| sight.front && probe.shelter(sight) >= SHELTERED);
        (camera, sheltered)
    });
    let best = sides.into_iter().reduce(|best, other| if other.1 > best.1 { other } else { best });
    best.filter(|(_, sheltered)| *sheltered >= OPEN).map(|(camera, _)| camera)
}

/// Share of the surfaces in view that are seen from their back.
pub fn backs<A: Accel>(probe: &Probe<A>, camera: &Camera) -> f32 {
    share(probe, camera, |sight| !sight.front)
}

/// Share of the surfaces in view for which `holds` is true.
fn share<A: Accel>(probe: &Probe<A>, camera: &Camera, holds: impl Fn(&Sight) -> bool) -> f32 {
    let rays = CameraRays::new(camera, RASTER, 1);
    let (mut seen, mut counted) = (0, 0);
    for (x, y) in (0..RASTER.1).flat_map(|y| (0..RASTER.0).map(move |x| (x, y))) {
        let ray = rays.ray(x, y, 0);
        let Some(sight) = probe.look(ray.origin, ray.direction.normalize()) else { continue };
        seen += 1;
        counted += u32::from(holds(&sight));
    }
    counted as f32 / seen.max(1) as f32
}

/// The nearest camera in a direction from the middle that has all of the scene in view.
fn framing<A>(probe: &Probe<A>, direction: Vec3, aspect: f32) -> Camera {
    let center = probe.bounds.center();
    let back = direction.normalize();
    let right = Vec3::Y.cross(back).normalize();
    let up = back.cross(right);
    let half = (FOV.to_radians() * 0.5).tan();
    let slopes = Vec2::new(half * aspect, half) / MARGIN;
    let mesh_bounds: Vec<Bounds> = probe.scene.meshes.iter().map(|mesh| mesh.bounds()).collect();
    let mut distance = 0.0f32;
    for instance in &probe.scene.instances {
        let Some(bounds) = mesh_bounds.get(instance.mesh as usize) else { continue };
        for corner in 0..8 {
            let choose =
                |axis: usize| if corner >> axis & 1 == 1 { bounds.max[axis] } else { bounds.min[axis] };
            let corner = Vec3::new(choose(0), choose(1), choose(2));
            let corner = instance.to_world.map_or(corner, |to_world| to_world.transform_point3(corner));
            let offset = corner - center;
            let across = Vec2::new(offset.dot(right), offset.dot(up)).abs() / slopes;
            distance = distance.max(across.max_element() + offset.dot(back));
        }
    }
    // A model of no extent is no model, but the camera must still look somewhere.
    let distance = distance.max(center.abs().max_element() * 1e-4).max(1e-6);
    Camera {
        name: "default".to_owned(),
        position: center + back * distance,
        look_at: center,
        up: Vec3::Y,
        vertical_fov: FOV,
    }
}
