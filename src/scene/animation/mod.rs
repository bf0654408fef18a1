//! What moves in a scene: cameras along keyframes or around a point, and instances, lights and cameras with the nodes that they hang on.
//!
//! All of it is rigid, or scaled: vertices stay where they are in their meshes. Whatever the file, an [`Animation`] says where everything is
//! in a [`Frame`], relative to where the scene was loaded, so that a still image of an animated scene is what it is without the animation.

mod camera;
mod curve;
mod frame;
mod rig;

use glam::{Affine3A, DAffine3, DMat4, Vec3};

pub use camera::{CameraCurves, CameraMotion, Turntable};
pub use curve::{Curve, CurveError, Interpolation, Value};
pub use frame::Frame;
pub use rig::{Channels, Counts, Local, Node, Rig, Turning, about, by_angles};

use crate::Bounds;
use crate::scene::{Camera, Light, Scene};

/// Frames per second where a file says nothing.
pub const FRAMES_PER_SECOND: f64 = 24.0;

/// Times at most that [`Animation::extent`] looks at.
const MOST_TIMES: f64 = 2000.0;

/// A part that hangs on a node, with its index in the scene and what it is in a still image.
#[derive(Clone, Debug, PartialEq)]
struct Part<T> {
    index: u32,
    node: u32,
    still: T,
}

/// What moves in a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Animation {
    frames_per_second: f64,
    rig: Rig,
    instances: Vec<Part<Option<Affine3A>>>,
    lights: Vec<Part<Light>>,
    hung_cameras: Vec<Part<Camera>>,
    /// Cameras that move by themselves.
    cameras: Vec<(u32, Camera, CameraMotion)>,
}

impl Default for Animation {
    /// Nothing moves.
    fn default() -> Self {
        Self::new(FRAMES_PER_SECOND, Rig::default(), Vec::new(), &Scene::default(), &[])
    }
}

impl Animation {
    /// The animation of a loaded scene. Parts of the rig and cameras that the scene doesn't have are left out.
    pub fn new(
        frames_per_second: f64,
        rig: Rig,
        motions: Vec<(u32, CameraMotion)>,
        scene: &Scene,
        cameras: &[Camera],
    ) -> Self {
        let instances = parts(&rig.instances, |index| Some(scene.instances.get(index)?.to_world));
        let lights = parts(&rig.lights, |index| scene.lights.get(index).copied());
        let hung_cameras = parts(&rig.cameras, |index| cameras.get(index).cloned());
        let by_itself = |(index, motion): (u32, CameraMotion)| {
            Some((index, cameras.get(index as usize)?.clone(), motion))
        };
        let cameras = motions.into_iter().filter_map(by_itself).collect();
        Self { frames_per_second, rig, instances, lights, hung_cameras, cameras }
    }

    /// Whether nothing moves.
    pub fn is_empty(&self) -> bool {
        self.instances.is_empty()
            && self.lights.is_empty()
            && self.hung_cameras.is_empty()
            && self.cameras.is_empty()
    }

    /// Whether more than cameras moves.
    pub fn moves_scene(&self) -> bool {
        !(self.instances.is_empty() && self.lights.is_empty())
    }

    /// Frames per second.
    pub fn frames_per_second(&self) -> f64 {
        self.frames_per_second
    }

    /// What moves in the files and stands still here, in words.
    pub fn notes(&self) -> &[String] {
        &self.rig.notes
    }

    /// The first and the last frame in which something moves: those of the first and last keyframe, or a full turn from frame 0; `None` where
    /// nothing moves.
    pub fn range(&self) -> Option<(i64, i64)> {
        let mut range: Option<(f64, f64)> = None;
        let mut extend = |number: f64| {
            range = Some(range.map_or((number, number), |(a, b)| (a.min(number), b.max(number))));
        };
        for (_, _, motion) in &self.cameras {
            match motion {
                CameraMotion::Keyframes(curves) => {
                    curves.times().for_each(|time| extend(time * self.frames_per_second));
                }
                CameraMotion::Turntable(turntable) => {
                    extend(0.0);
                    extend(turntable.frames - 1.0);
                }
            }
        }
        self.rig.times().for_each(|time| extend(time * self.frames_per_second));
        range.map(|(first, last)| (first.floor() as i64, last.ceil() as i64))
    }

    /// Where everything is in a frame, which is at its number over the frames per second, in seconds.
    pub fn frame(&self, number: i64) -> Frame {
        let time = number as f64 / self.frames_per_second;
        let moves = self.moves(time);
        let placed = |part: &Part<Option<Affine3A>>| {
            let to_world = moves.of(part.node).map(|moved| {
                single(&(moved * part.still.map_or(DAffine3::IDENTITY, |still| double(&still))))
            });
            (part.index, to_world.or(part.still))
        };
        let lit = |part: &Part<Light>| {
            (part.index, moves.of(part.node).map_or(part.still, |moved| part.still.moved(&single(&moved))))
        };
        let hung = |part: &Part<Camera>| {
            let moved = moves.of(part.node).map(|moved| part.still.moved(&single(&moved)));
            (part.index, moved.unwrap_or_else(|| part.still.clone()))
        };
        let mut cameras: Vec<(u32, Camera)> = self.hung_cameras.iter().map(hung).collect();
        let by_itself = self.cameras.iter();
        cameras.extend(by_itself.map(|(index, still, motion)| (*index, motion.camera(still, number, time))));
        Frame {
            number,
            cameras,
            instances: self.instances.iter().map(placed).collect(),
            lights: self.lights.iter().map(lit).collect(),
        }
    }

    fn moves(&self, time: f64) -> Moves {
        Moves { now: self.rig.worlds(Some(time)), rest: self.rig.worlds(None) }
    }

    /// A box that holds all that instances reach in any frame, for [`Scene::extent`]: then mesh points stay where they are from frame to frame.
    /// Empty where no instance moves.
    ///
    /// Frames are tried, of long animations not every one; the box is a little larger than what is found.
    pub fn extent(&self, scene: &Scene) -> Bounds {
        let Some((first, last)) = self.range().filter(|_| !self.instances.is_empty()) else {
            return Bounds::EMPTY;
        };
        let step = ((last - first) as f64 / MOST_TIMES).max(1.0);
        let boxes: Vec<(&Part<Option<Affine3A>>, Bounds)> = self
            .instances
            .iter()
            .filter_map(|part| {
                let instance = scene.instances.get(part.index as usize)?;
                Some((part, scene.meshes.get(instance.mesh as usize)?.bounds()))
            })
            .collect();
        let mut extent = Bounds::EMPTY;
        let mut number = first as f64;
        while number <= last as f64 {
            let moves = self.moves(number / self.frames_per_second);
            for (part, of_mesh) in &boxes {
                let still = part.still.map_or(DAffine3::IDENTITY, |still| double(&still));
                let to_world = moves.of(part.node).map_or(still, |moved| moved * still);
                of_mesh.corners().for_each(|corner| {
                    extent.extend(to_world.transform_point3(corner.as_dvec3()).as_vec3());
                });
            }
            number += step;
        }
        let margin = extent.extent() * 0.01;
        let extent = Bounds { min: extent.min - margin, max: extent.max + margin };
        let is_finite = extent.min.is_finite() && extent.max.is_finite();
        if is_finite && !extent.is_empty() { extent } else { Bounds::EMPTY }
    }
}

/// The parts that hang on nodes, as far as they are there.
fn parts<T>(hung: &[(u32, u32)], still: impl Fn(usize) -> Option<T>) -> Vec<Part<T>> {
    let part = |&(index, node): &(u32, u32)| Some(Part { index, node, still: still(index as usize)? });
    hung.iter().filter_map(part).collect()
}

/// Places of all nodes at a time, and at rest.
struct Moves {
    now: Vec<DAffine3>,
    rest: Vec<DAffine3>,
}

impl Moves {
    /// What a node's motion does to what hangs on it, in the world; `None` where it is at rest.
    fn of(&self, node: u32) -> Option<DAffine3> {
        let (now, rest) = (self.now.get(node as usize)?, self.rest.get(node as usize)?);
        let determinant = rest.matrix3.determinant();
        let moved = now != rest && determinant != 0.0 && determinant.is_finite();
        moved.then(|| *now * rest.inverse())
    }
}

fn single(map: &DAffine3) -> Affine3A {
    Affine3A::from_mat4(DMat4::from(*map).as_mat4())
}

/// In double precision.
pub(in crate::scene) fn double(map: &Affine3A) -> DAffine3 {
    let [x, y, z] = [map.matrix3.x_axis, map.matrix3.y_axis, map.matrix3.z_axis].map(|axis| axis.as_dvec3());
    DAffine3::from_cols(x, y, z, Vec3::from(map.translation).as_dvec3())
}
