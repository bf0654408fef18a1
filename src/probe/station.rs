//! Probes that are about to measure.

use glam::Vec3;

use super::sensor::Sensor;

/// A probe that is about to measure.
pub struct Station {
    /// Where it is.
    pub position: Vec3,
    /// Where its rays start.
    pub origin: Vec3,
    /// What it measures.
    pub sensor: Sensor,
}

impl Station {
    /// A probe with a normal may lie on a surface: its rays start in front of that, as those of surface points do.
    pub fn new(position: Vec3, sensor: Sensor, scene_size: f32) -> Self {
        let origin = match sensor {
            Sensor::Plane(normal) => {
                let size = position.abs().max_element() + scene_size;
                position + normal * (32.0 * f32::EPSILON * size)
            }
            Sensor::Sphere | Sensor::Harmonics => position,
        };
        Self { position, origin, sensor }
    }
}
