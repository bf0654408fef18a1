//! `[camera]`.

use glam::Vec3;
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
        let CameraTable { name, position, look_at, up, vertical_fov } = table.get_ref();
        let camera = Camera {
            name: name.clone(),
            position: position.0,
            look_at: look_at.0,
            up: up.map_or(Vec3::Y, |up| up.0),
            vertical_fov: vertical_fov.map_or(45.0, |fov| fov.0),
        };
        camera.validate().map_err(|error| {
            let key = format!("camera.{}", error.field());
            places.error(&table.span(), &key, error.problem())
        })?;
        Ok(camera)
    }
}
