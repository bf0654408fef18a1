//! `[camera]`, or several of `[[camera]]`.

use std::fmt;
use std::ops::Range;

use glam::{DVec3, Vec3};
use serde::Deserialize;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserializer, MapAccess, SeqAccess, Visitor};
use toml::Spanned;

use super::keyframes::{CameraKeyframe, curve};
use super::place::Places;
use super::values::{Direction, FieldOfView, Point, Positive};
use crate::scene::Camera;
use crate::scene::animation::{CameraCurves, CameraMotion, Interpolation, Turntable};
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
    keyframes: Option<Spanned<Vec<CameraKeyframe>>>,
    interpolation: Option<Spanned<Interpolation>>,
    turntable: Option<Spanned<TurntableTable>>,
}

/// `camera.turntable`
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TurntableTable {
    centre: Option<Point>,
    axis: Option<Direction>,
    frames: Positive,
}

/// One table or several.
pub enum CameraTables {
    /// `[camera]`
    One(Box<CameraTable>),
    /// `[[camera]]`
    Many(Vec<Spanned<CameraTable>>),
}

impl<'de> Deserialize<'de> for CameraTables {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct TablesVisitor;
        impl<'de> Visitor<'de> for TablesVisitor {
            type Value = CameraTables;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a table, or an array of tables")
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<CameraTables, A::Error> {
                let table = CameraTable::deserialize(MapAccessDeserializer::new(map))?;
                Ok(CameraTables::One(Box::new(table)))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut sequence: A) -> Result<CameraTables, A::Error> {
                let mut tables = Vec::new();
                while let Some(table) = sequence.next_element()? {
                    tables.push(table);
                }
                Ok(CameraTables::Many(tables))
            }
        }
        deserializer.deserialize_any(TablesVisitor)
    }
}

impl CameraTables {
    /// The cameras in their order, each with how it moves.
    ///
    /// # Errors
    /// See [`CameraTable::camera`].
    pub fn cameras(
        tables: &Spanned<Self>,
        places: &Places,
    ) -> Result<Vec<(Camera, Option<CameraMotion>)>, LoadError> {
        match tables.get_ref() {
            Self::One(table) => Ok(vec![table.camera(&tables.span(), "camera", places)?]),
            Self::Many(tables) => {
                let camera = |(index, table): (usize, &Spanned<CameraTable>)| {
                    table.get_ref().camera(&table.span(), &format!("camera[{index}]"), places)
                };
                tables.iter().enumerate().map(camera).collect()
            }
        }
    }
}

impl CameraTable {
    /// The camera, and how it moves.
    ///
    /// # Errors
    /// If the view has no direction, or the same as up, at rest or at a keyframe; for times that are none; and for keys that exclude each other.
    fn camera(
        &self,
        span: &Range<usize>,
        key: &str,
        places: &Places,
    ) -> Result<(Camera, Option<CameraMotion>), LoadError> {
        let camera = Camera {
            name: self.name.clone(),
            position: self.position.0,
            look_at: self.look_at.0,
            up: self.up.map_or(Vec3::Y, |up| up.0),
            vertical_fov: self.vertical_fov.map_or(45.0, |fov| fov.0),
        };
        camera
            .validate()
            .map_err(|error| places.error(span, &format!("{key}.{}", error.field()), error.problem()))?;
        if let (Some(interpolation), None) = (&self.interpolation, &self.keyframes) {
            return Err(places.error(
                &interpolation.span(),
                &format!("{key}.interpolation"),
                "needs keyframes",
            ));
        }
        if let (Some(turntable), Some(_)) = (&self.turntable, &self.keyframes) {
            return Err(places.error(&turntable.span(), &format!("{key}.turntable"), "excludes keyframes"));
        }
        if let Some(turntable) = &self.turntable {
            let TurntableTable { centre, axis, frames } = turntable.get_ref();
            return Ok((
                camera,
                Some(CameraMotion::Turntable(Turntable {
                    centre: centre.map_or(self.look_at.0, |centre| centre.0).as_dvec3(),
                    axis: axis.map_or(Vec3::Y, |axis| axis.0).as_dvec3(),
                    frames: f64::from(frames.0),
                })),
            ));
        }
        let Some(keyframes) = &self.keyframes else { return Ok((camera, None)) };
        let interpolation = self.interpolation.as_ref().map(|name| *name.get_ref()).unwrap_or_default();
        let error = |problem: String| places.error(&keyframes.span(), &format!("{key}.keyframes"), problem);
        let frames = keyframes.get_ref();
        let points = |value: fn(&CameraKeyframe) -> Option<Vec3>| {
            let keyframes = frames.iter().map(|frame| (frame.time.0, value(frame).map(|at| at.as_dvec3())));
            curve::<DVec3>(keyframes, interpolation).map_err(error)
        };
        let fovs = frames.iter().map(|frame| (frame.time.0, frame.vertical_fov.map(|fov| f64::from(fov.0))));
        let curves = CameraCurves {
            position: points(|frame| frame.position.map(|at| at.0))?,
            look_at: points(|frame| frame.look_at.map(|at| at.0))?,
            up: points(|frame| frame.up.map(|at| at.0))?,
            vertical_fov: curve(fovs, interpolation).map_err(error)?,
        };
        if curves.times().next().is_none() {
            return Err(error("change nothing".to_owned()));
        }
        for frame in frames {
            let time = frame.time.0;
            let wrong = curves.camera(&camera, time).validate().err();
            if let Some(wrong) = wrong {
                return Err(error(format!("at time {time}, {wrong}")));
            }
        }
        Ok((camera, Some(CameraMotion::Keyframes(Box::new(curves)))))
    }
}
