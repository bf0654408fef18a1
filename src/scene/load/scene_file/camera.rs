//! `[camera]`.

use serde::Deserialize;
use toml::Spanned;

use super::place::Places;
use super::values::{Direction, FieldOfView, Point};
use crate::scene::Camera;
use crate::scene::load::LoadError;

/// `[camera]`
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraTable {
    #[serde(default)]
    name: String,
    position: Point,
    look_at: Point,
    up: Option<Direction>,
    vertical_fov: Option<FieldOfView>,
}

impl CameraTable {
    /// The camera.
    ///
    /// # Errors
    /// If the view has no direction, or the same as up.
    pub fn camera(table: &Spanned<Self>, places: &Places) -> Result<Camera, LoadError> {
        let error = |key: &str, problem| Err(places.error(&table.span(), key, problem));
        let CameraTable { name, position, look_at, up, vertical_fov } = table.get_ref();
        let (position, look_at) = (position.0, look_at.0);
        let up = up.map_or(glam::Vec3::Y, |up| up.0);
        let view = (look_at.as_dvec3() - position.as_dvec3()).try_normalize();
        let Some(view) = view else {
            return error("camera.look_at", "must differ from position");
        };
        // Below this sine, the picture's horizontal is made of rounding errors.
        if view.cross(up.as_dvec3().normalize()).length() < 1e-6 {
            return error("camera.up", "must not be parallel to the view direction");
        }
        let vertical_fov = vertical_fov.map_or(45.0, |fov| fov.0);
        Ok(Camera { name: name.clone(), position, look_at, up, vertical_fov })
    }
}
