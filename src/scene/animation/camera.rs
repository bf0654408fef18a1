//! How a camera moves by itself.

use glam::{DQuat, DVec3};

use super::curve::Curve;
use crate::scene::Camera;

/// How a camera moves.
#[derive(Clone, Debug, PartialEq)]
pub enum CameraMotion {
    /// Along keyframes.
    Keyframes(Box<CameraCurves>),
    /// Around what it looks at.
    Turntable(Turntable),
}

/// What of a camera changes over time; the rest stays.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CameraCurves {
    /// Eye point.
    pub position: Option<Curve<DVec3>>,
    /// Point in the middle of the image.
    pub look_at: Option<Curve<DVec3>>,
    /// Up in the image.
    pub up: Option<Curve<DVec3>>,
    /// Degrees.
    pub vertical_fov: Option<Curve<f64>>,
}

/// A camera that goes around a point, or what it sees turned in front of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turntable {
    /// What it goes around.
    pub centre: DVec3,
    /// The axis through there, of any length but 0; the camera goes counter-clockwise, seen with the axis pointing at the viewer.
    pub axis: DVec3,
    /// Frames of a full turn, > 0.
    pub frames: f64,
}

impl CameraCurves {
    /// Times of all keyframes, seconds, in no order.
    pub fn times(&self) -> impl Iterator<Item = f64> + '_ {
        let points = [&self.position, &self.look_at, &self.up].into_iter().flatten().flat_map(Curve::times);
        points.chain(self.vertical_fov.iter().flat_map(Curve::times)).copied()
    }

    /// The camera at a time, given what it is where nothing changes.
    pub fn camera(&self, still: &Camera, time: f64) -> Camera {
        let point = |curve: &Option<Curve<DVec3>>, still| {
            curve.as_ref().map_or(still, |curve| curve.at(time).as_vec3())
        };
        let fov = self.vertical_fov.as_ref().map(|curve| curve.at(time) as f32);
        Camera {
            name: still.name.clone(),
            position: point(&self.position, still.position),
            look_at: point(&self.look_at, still.look_at),
            up: point(&self.up, still.up),
            vertical_fov: fov.unwrap_or(still.vertical_fov),
        }
    }
}

impl Turntable {
    /// The camera in a frame, given what it is in frame 0.
    pub fn camera(&self, still: &Camera, number: i64) -> Camera {
        // The same after a full turn, to the bit.
        let turns = (number as f64 / self.frames).rem_euclid(1.0);
        let rotation = DQuat::from_axis_angle(self.axis.normalize(), turns * std::f64::consts::TAU);
        let moved = |point: glam::Vec3| (self.centre + rotation * (point.as_dvec3() - self.centre)).as_vec3();
        Camera {
            position: moved(still.position),
            look_at: moved(still.look_at),
            up: (rotation * still.up.as_dvec3()).as_vec3(),
            ..still.clone()
        }
    }
}

impl CameraMotion {
    /// The camera in a frame at a time in seconds, given what it is in a still image.
    pub fn camera(&self, still: &Camera, number: i64, time: f64) -> Camera {
        match self {
            Self::Keyframes(curves) => curves.camera(still, time),
            Self::Turntable(turntable) => turntable.camera(still, number),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    /// A quarter of a turn about y leads from z to x, half a turn to −z; a whole turn is the start, to the bit.
    #[test]
    fn a_turntable_turns_evenly_and_ends_where_it_began() {
        let still = Camera::look_at(Vec3::new(1.0, 2.0, 5.0), Vec3::new(1.0, 1.0, 0.0));
        let turntable = Turntable { centre: DVec3::new(1.0, 1.0, 0.0), axis: DVec3::Y * 3.0, frames: 48.0 };
        for (number, expected) in [
            (12, Vec3::new(6.0, 2.0, 0.0)),
            (24, Vec3::new(1.0, 2.0, -5.0)),
            (-12, Vec3::new(-4.0, 2.0, 0.0)),
        ] {
            let camera = turntable.camera(&still, number);
            assert!(camera.position.abs_diff_eq(expected, 1e-5), "{number}: {camera:?}");
            assert!(camera.look_at.abs_diff_eq(still.look_at, 1e-6) && camera.up.abs_diff_eq(Vec3::Y, 1e-6));
        }
        assert_eq!(turntable.camera(&still, 0), still);
        assert_eq!(turntable.camera(&still, 48), still);
    }
}
