//! Views from outside.

use std::f32::consts::TAU;

use glam::{Quat, Vec2, Vec3};

use super::probe::{Probe, Sight};
use crate::Bounds;
use crate::accel::Accel;
use crate::sampling::SphereStrata;
use crate::scene::{Camera, CameraRays};

/// Vertical field of view, degrees.
const FOV: f32 = 40.0;
/// Towards the camera from the model's middle: from the front, somewhat from the right and above.
const DIRECTION: Vec3 = Vec3::new(0.55, 0.42, 1.0);
/// Room around the model.
const MARGIN: f32 = 1.05;
/// Rays that look at what a view shows.
const RASTER: (u32, u32) = (32, 24);
/// Towards the camera from rooms that are looked down into: steep, so that they hide little of each other.
const ABOVE: Vec3 = Vec3::new(0.3, 1.0, 0.8);
/// Directions in which a position's room is measured.
const DIRECTIONS: u32 = 48;
/// Share of what is found there that is left out at either end: what shows through doors.
const DOORS: f32 = 0.02;
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

/// Down into rooms without ceilings, of which these are positions.
pub fn from_above<A: Accel>(probe: &Probe<A>, positions: &[Vec3], aspect: f32) -> Camera {
    let strata = &SphereStrata::new(DIRECTIONS);
    let around = |&x: &Vec3| (0..DIRECTIONS).filter_map(move |cell| probe.look(x, strata.jittered(cell, x)));
    let walls: Vec<Vec3> = positions.iter().flat_map(around).map(|sight| sight.near).collect();
    let ends = [0, 1, 2].map(|axis| {
        let mut along: Vec<f32> = walls.iter().map(|wall| wall[axis]).collect();
        along.sort_unstable_by(f32::total_cmp);
        let left_out = (along.len() as f32 * DOORS) as usize;
        along.get(left_out).copied().zip(along.iter().rev().nth(left_out).copied())
    });
    let bounds = match ends {
        [Some(x), Some(y), Some(z)] => {
            Bounds { min: Vec3::new(x.0, y.0, z.0), max: Vec3::new(x.1, y.1, z.1) }
        }
        _ => probe.bounds,
    };
    fitting(bounds.center(), corners(&bounds), ABOVE, aspect)
}

/// Through the backs of all walls, as on a map: from that of four sides where most is in view.
pub fn cut_open<A: Accel>(probe: &Probe<A>, aspect: f32) -> Camera {
    let sides = [0.0, 0.25, 0.5, 0.75].map(|turns| {
        let direction = Quat::from_rotation_y(turns * TAU) * ABOVE;
        let camera = framing(probe, direction, aspect);
        let fronts = looks(&camera, |x, direction| probe.look_through(x, direction)).count();
        (camera, fronts)
    });
    let [first, others @ ..] = sides;
    others.into_iter().fold(first, |best, other| if other.1 > best.1 { other } else { best }).0
}

/// Share of the surfaces in view that are seen from their back.
pub fn backs<A: Accel>(probe: &Probe<A>, camera: &Camera) -> f32 {
    share(probe, camera, |sight| !sight.front)
}

/// Share of the surfaces in view for which `holds` is true.
fn share<A: Accel>(probe: &Probe<A>, camera: &Camera, holds: impl Fn(&Sight) -> bool) -> f32 {
    let (mut seen, mut counted) = (0, 0);
    for sight in looks(camera, |x, direction| probe.look(x, direction)) {
        seen += 1;
        counted += u32::from(holds(&sight));
    }
    counted as f32 / seen.max(1) as f32
}

/// What a raster of rays sees; `look` takes the origin and the direction of a ray.
fn looks(camera: &Camera, look: impl Fn(Vec3, Vec3) -> Option<Sight>) -> impl Iterator<Item = Sight> {
    let rays = CameraRays::new(camera, RASTER, 1);
    let pixels = (0..RASTER.1).flat_map(|y| (0..RASTER.0).map(move |x| (x, y)));
    pixels.filter_map(move |(x, y)| {
        let ray = rays.ray(x, y, 0);
        look(ray.origin, ray.direction.normalize())
    })
}

/// The nearest camera in a direction from the middle that has all of the scene in view.
fn framing<A>(probe: &Probe<A>, direction: Vec3, aspect: f32) -> Camera {
    let meshes: Vec<Bounds> = probe.scene.meshes.iter().map(|mesh| mesh.bounds()).collect();
    let points = probe.scene.instances.iter().flat_map(|instance| {
        let corners = meshes.get(instance.mesh as usize).map(corners).into_iter().flatten();
        corners.map(|corner| instance.to_world.map_or(corner, |to_world| to_world.transform_point3(corner)))
    });
    fitting(probe.bounds.center(), points, direction, aspect)
}

fn corners(&Bounds { min, max }: &Bounds) -> impl Iterator<Item = Vec3> + use<> {
    (0..8).map(move |corner| {
        let choose = |axis: usize| if corner >> axis & 1 == 1 { max[axis] } else { min[axis] };
        Vec3::new(choose(0), choose(1), choose(2))
    })
}

/// The nearest camera in a direction from `center` that has all of `points` in view.
fn fitting(center: Vec3, points: impl Iterator<Item = Vec3>, direction: Vec3, aspect: f32) -> Camera {
    let back = direction.normalize();
    let right = Vec3::Y.cross(back).normalize();
    let up = back.cross(right);
    let half = (FOV.to_radians() * 0.5).tan();
    let slopes = Vec2::new(half * aspect, half) / MARGIN;
    let distances = points.map(|point| {
        let offset = point - center;
        let across = Vec2::new(offset.dot(right), offset.dot(up)).abs() / slopes;
        across.max_element() + offset.dot(back)
    });
    // A model of no extent is no model, but the camera must still look somewhere.
    let distance = distances.fold(0.0f32, f32::max).max(center.abs().max_element() * 1e-4).max(1e-6);
    Camera::look_at(center + back * distance, center).with_fov(FOV).named("default")
}
