//! Pinhole camera.

use glam::Vec3;

/// Pinhole camera: position, direction and field of view; the resolution is a setting of the render.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Name from the file, empty if it has none.
    pub name: String,
    /// Eye point.
    pub position: Vec3,
    /// Point in the middle of the picture.
    pub look_at: Vec3,
    /// Direction that is up in the picture; need not be perpendicular to the view direction.
    pub up: Vec3,
    /// Vertical field of view, degrees, in (0, 180).
    pub vertical_fov: f32,
}
