//! `[animation]`, and keyframes of cameras and geometry.

use glam::{DAffine3, DVec3, Vec3};
use serde::Deserialize;

use super::values::{Direction, FieldOfView, Point, Positive, Rotation, ScaleFactors, Seconds};
use crate::scene::animation::{
    Channels, Curve, FRAMES_PER_SECOND, Interpolation, Local, Node, Turning, Value, about, by_angles,
};

/// `[animation]`
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AnimationTable {
    frames_per_second: Option<Positive>,
}

impl AnimationTable {
    /// Frames per second.
    pub fn frames_per_second(&self) -> f64 {
        self.frames_per_second.map_or(FRAMES_PER_SECOND, |frames| f64::from(frames.0))
    }
}

/// One of `camera.keyframes`; what is left out doesn't change there.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraKeyframe {
    pub time: Seconds,
    pub position: Option<Point>,
    pub look_at: Option<Point>,
    pub up: Option<Direction>,
    pub vertical_fov: Option<FieldOfView>,
}

/// One of `geometry.keyframes`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GeometryKeyframe {
    pub time: Seconds,
    pub translate: Option<Point>,
    pub rotate: Option<Rotation>,
    pub scale: Option<ScaleFactors>,
}

/// A curve through those keyframes that have a value; `None` where none has.
///
/// # Errors
/// What is wrong with the times, in words.
pub fn curve<V: Value>(
    keyframes: impl Iterator<Item = (f64, Option<V>)>,
    interpolation: Interpolation,
) -> Result<Option<Curve<V>>, String> {
    let mut before = f64::NEG_INFINITY;
    let (mut times, mut values) = (Vec::new(), Vec::new());
    for (time, value) in keyframes {
        if time <= before {
            return Err(format!("times must rise, found {time} after {before}"));
        }
        before = time;
        if let Some(value) = value {
            times.push(time);
            values.push(value);
        }
    }
    if times.is_empty() {
        return Ok(None);
    }
    Curve::new(times, values, interpolation).map(Some).map_err(|error| error.to_string())
}

/// The steps of placing a model.
#[derive(Clone, Copy, Default)]
pub struct Steps {
    /// Last step.
    pub translate: Option<Vec3>,
    /// Second step.
    pub rotate: Option<Rotation>,
    /// First step.
    pub scale: Option<Vec3>,
}

/// The node of a model that is placed by some steps, which change along keyframes.
///
/// # Errors
/// What is wrong with the keyframes, in words.
pub fn node(
    still: Steps,
    keyframes: &[GeometryKeyframe],
    interpolation: Interpolation,
) -> Result<Node, String> {
    let at = |value: fn(&GeometryKeyframe) -> Option<Vec3>| {
        let keyframes = keyframes.iter().map(|frame| (frame.time.0, value(frame).map(|at| at.as_dvec3())));
        curve::<DVec3>(keyframes, interpolation)
    };
    let channels = Channels {
        translation: at(|frame| frame.translate.map(|at| at.0))?,
        rotation: turning(keyframes, interpolation)?,
        scale: at(|frame| frame.scale.map(|at| at.0))?,
    };
    if channels.is_empty() {
        return Err("change nothing".to_owned());
    }
    let rotation = match still.rotate {
        None => glam::DQuat::IDENTITY,
        Some(Rotation::Axes(angles)) => by_angles(angles.as_dvec3()),
        Some(Rotation::AxisAngle { axis, degrees }) => about(axis.as_dvec3(), f64::from(degrees)),
    };
    let rest = Local::Steps {
        translation: still.translate.map_or(DVec3::ZERO, |at| at.as_dvec3()),
        rotation,
        scale: still.scale.map_or(DVec3::ONE, |at| at.as_dvec3()),
    };
    Ok(Node { parent: None, rest, channels })
}

/// The node of a model that stands still.
pub fn still_node(to_world: DAffine3) -> Node {
    Node { parent: None, rest: Local::Matrix(to_world), channels: Channels::default() }
}

/// Rotations as they are written: angles follow from angles, so that a full turn is one.
fn turning(keyframes: &[GeometryKeyframe], interpolation: Interpolation) -> Result<Option<Turning>, String> {
    let first = keyframes.iter().find_map(|frame| frame.rotate);
    match first {
        None => Ok(None),
        Some(Rotation::Axes(_)) => {
            let angles = keyframes.iter().map(|frame| match frame.rotate {
                Some(Rotation::AxisAngle { .. }) => Err(frame.time.0),
                Some(Rotation::Axes(angles)) => Ok((frame.time.0, Some(angles.as_dvec3()))),
                None => Ok((frame.time.0, None)),
            });
            let angles = angles.collect::<Result<Vec<_>, _>>().map_err(mixed)?;
            Ok(curve(angles.into_iter(), interpolation)?.map(Turning::Angles))
        }
        Some(Rotation::AxisAngle { axis: common, .. }) => {
            let degrees = keyframes.iter().map(|frame| match frame.rotate {
                Some(Rotation::AxisAngle { axis, degrees }) if axis == common => {
                    Ok((frame.time.0, Some(f64::from(degrees))))
                }
                Some(_) => Err(frame.time.0),
                None => Ok((frame.time.0, None)),
            });
            let degrees = degrees.collect::<Result<Vec<_>, _>>().map_err(mixed)?;
            let curve = curve(degrees.into_iter(), interpolation)?;
            Ok(curve.map(|curve| Turning::About(common.as_dvec3(), curve)))
        }
    }
}

fn mixed(time: f64) -> String {
    format!("all rotations must be three angles, or all about the same axis; not so at time {time}")
}
