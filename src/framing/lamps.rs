//! Lights for models that bring none.

use glam::Vec3;

use super::probe::Probe;
use crate::accel::Accel;
use crate::scene::{Camera, Light, LightKind};

/// Three directional lights relative to a camera: from the upper left, weaker from the right, and from straight above.
pub fn directional(camera: &Camera) -> Vec<Light> {
    let back = (camera.position - camera.look_at).normalize_or(Vec3::Z);
    let right = camera.up.cross(back).normalize_or(Vec3::X);
    let up = back.cross(right);
    let light = |towards: Vec3, illuminance: f32| Light {
        position: camera.position,
        intensity: Vec3::splat(illuminance),
        kind: LightKind::Directional { direction: -towards.normalize_or(Vec3::Y) },
    };
    vec![
        light(back + 0.7 * up - 0.6 * right, 2.5),
        light(back + 0.1 * up + 0.9 * right, 0.8),
        light(camera.up.normalize_or(Vec3::Y) + 0.2 * back, 1.2),
    ]
}

/// Lamps are looked for among this many positions.
const POSITIONS: usize = 64;
/// Lamps at most.
const LAMPS: usize = 16;
/// How far from a lamp a position counts as lit by it, in diagonals.
const REACH: f32 = 0.25;
/// Where lamps hang, as a share of the height of the room.
const HEIGHT: f32 = 0.85;

/// Point lights in the rooms: each in turn where it lights most of the positions that are still dark.
pub fn in_rooms<A: Accel>(probe: &Probe<A>, positions: &[Vec3]) -> Vec<Light> {
    let reach = REACH * probe.diagonal();
    let mut dark: Vec<Vec3> = positions.iter().take(POSITIONS).copied().collect();
    let hung: Vec<Vec3> = dark.iter().map(|&position| probe.at_height(position, HEIGHT)).collect();
    let lights = |lamp: Vec3, position: Vec3| lamp.distance(position) <= reach && probe.sees(lamp, position);
    let mut lamps = Vec::new();
    while lamps.len() < LAMPS {
        let reached = |lamp: Vec3| dark.iter().filter(|&&position| lights(lamp, position)).count();
        let counted = hung.iter().map(|&lamp| (reached(lamp), lamp));
        let best = counted.reduce(|best, other| if other.0 > best.0 { other } else { best });
        let Some((1.., lamp)) = best else { break };
        dark.retain(|&position| !lights(lamp, position));
        // An illuminance of 3 at the end of the reach; the exposure follows from the image.
        lamps.push(Light::point(lamp, Vec3::splat(3.0 * reach * reach)));
    }
    lamps
}

/// How much weaker than the lamps of the rooms the one at the camera is.
const WEAKER: f32 = 0.125;

/// Adds a weak lamp at the camera, so that nothing in view stays black.
pub fn with_one_at(camera: &Camera, mut lamps: Vec<Light>) -> Vec<Light> {
    if let Some(lamp) = lamps.first() {
        lamps.push(Light::point(camera.position, lamp.intensity * WEAKER));
    }
    lamps
}
