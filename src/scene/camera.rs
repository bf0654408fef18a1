//! Pinhole camera.

use glam::{Affine3A, Vec3};

/// Pinhole camera: position, direction and field of view; the resolution is a setting of the render.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Name from the file, empty if it has none.
    pub name: String,
    /// Eye point.
    pub position: Vec3,
    /// Point in the middle of the image.
    pub look_at: Vec3,
    /// Direction that is up in the image; need not be perpendicular to the view direction.
    pub up: Vec3,
    /// Vertical field of view, degrees, in (0, 180).
    pub vertical_fov: f32,
}

/// How large pixels are where a view's camera rays end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelFootprint {
    /// Where the rays start.
    pub eye: Vec3,
    /// Edge of a pixel at distance 1 from there, in the middle of the image.
    pub edge: f32,
}

impl PixelFootprint {
    /// Edge of a pixel at a position.
    #[inline(always)]
    pub fn edge_at(&self, position: Vec3) -> f32 {
        self.edge * position.distance(self.eye)
    }
}

/// A camera that shows nothing.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{} {}", self.field(), self.problem())]
pub enum CameraError {
    /// The position is not finite.
    Position(Vec3),
    /// The point that is looked at is not finite, or the eye itself.
    LookAt(Vec3),
    /// Up is not finite, or along the view direction.
    Up(Vec3),
    /// The field of view lies outside of (0, 180) degrees.
    VerticalFov(f32),
}

impl CameraError {
    /// The field of [`Camera`] that is wrong.
    pub fn field(&self) -> &'static str {
        match self {
            Self::Position(_) => "position",
            Self::LookAt(_) => "look_at",
            Self::Up(_) => "up",
            Self::VerticalFov(_) => "vertical_fov",
        }
    }

    /// What is wrong with the field, in words.
    pub fn problem(&self) -> String {
        match self {
            Self::Position(value) | Self::LookAt(value) | Self::Up(value) if !value.is_finite() => {
                format!("must be finite, found {value}")
            }
            Self::Position(_) | Self::LookAt(_) => "must differ from position".to_owned(),
            Self::Up(_) => "must not be parallel to the view direction".to_owned(),
            Self::VerticalFov(fov) => format!("must lie in (0, 180), found {fov}"),
        }
    }
}

/// Sine of the angle between the view direction and up below which the image's horizontal is made of rounding errors.
const LEAST_SINE: f64 = 1e-6;

impl Camera {
    /// A camera at `position` with `target` in the middle of its image; y is up, and 45° are in view.
    pub fn look_at(position: Vec3, target: Vec3) -> Self {
        Self { name: String::new(), position, look_at: target, up: Vec3::Y, vertical_fov: 45.0 }
    }

    /// How large the pixels of an image of this resolution are.
    pub fn pixel_footprint(&self, resolution: (u32, u32)) -> PixelFootprint {
        let edge = 2.0 * (self.vertical_fov.to_radians() * 0.5).tan() / resolution.1 as f32;
        PixelFootprint { eye: self.position, edge }
    }

    /// The camera with another vertical field of view, degrees.
    pub fn with_fov(self, vertical_fov: f32) -> Self {
        Self { vertical_fov, ..self }
    }

    /// The camera with another direction up.
    pub fn with_up(self, up: Vec3) -> Self {
        Self { up, ..self }
    }

    /// The camera with a name.
    pub fn named(self, name: impl Into<String>) -> Self {
        Self { name: name.into(), ..self }
    }

    /// The camera in another place.
    pub fn moved(&self, to_world: &Affine3A) -> Self {
        Self {
            position: to_world.transform_point3(self.position),
            look_at: to_world.transform_point3(self.look_at),
            up: to_world.transform_vector3(self.up).normalize_or(self.up),
            ..self.clone()
        }
    }

    /// Whether the camera shows anything.
    ///
    /// # Errors
    /// The first field that is wrong.
    pub fn validate(&self) -> Result<(), CameraError> {
        if !self.position.is_finite() {
            return Err(CameraError::Position(self.position));
        }
        // In double precision the difference of finite numbers is finite.
        let view = (self.look_at.as_dvec3() - self.position.as_dvec3()).try_normalize();
        let Some(view) = view.filter(|_| self.look_at.is_finite()) else {
            return Err(CameraError::LookAt(self.look_at));
        };
        let up = self.up.as_dvec3().try_normalize();
        if up.is_none_or(|up| view.cross(up).length() < LEAST_SINE) {
            return Err(CameraError::Up(self.up));
        }
        if !(self.vertical_fov > 0.0 && self.vertical_fov < 180.0) {
            return Err(CameraError::VerticalFov(self.vertical_fov));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn good() -> Camera {
        Camera::look_at(Vec3::new(0.0, 1.0, 5.0), Vec3::ZERO)
    }

    /// Each field has values with which no image can be made; the error names the field.
    #[test]
    fn cameras_that_show_nothing_are_refused_by_field() {
        assert_eq!(good().validate(), Ok(()));
        let text = |camera: Camera| camera.validate().unwrap_err().to_string();
        assert_eq!(
            text(Camera { position: Vec3::NAN, ..good() }),
            "position must be finite, found [NaN, NaN, NaN]"
        );
        assert_eq!(text(Camera { look_at: good().position, ..good() }), "look_at must differ from position");
        assert!(text(Camera { look_at: Vec3::INFINITY, ..good() }).starts_with("look_at must be finite"));
        for up in [Vec3::ZERO, Vec3::new(0.0, 1.0, 5.0)] {
            assert_eq!(text(good().with_up(up)), "up must not be parallel to the view direction");
        }
        for fov in [0.0, 180.0, -1.0, f32::NAN] {
            assert_eq!(text(good().with_fov(fov)), format!("vertical_fov must lie in (0, 180), found {fov}"));
        }
    }

    /// Squares of such coordinates leave single precision, but the camera is as good as any.
    #[test]
    fn far_away_cameras_are_accepted() {
        let far = Vec3::new(1e30, 0.0, 0.0);
        assert_eq!(Camera::look_at(far, -far).validate(), Ok(()));
        assert_eq!(Camera::look_at(Vec3::splat(1e-30), Vec3::ZERO).validate(), Ok(()));
    }
}
