//! Nodes that move, and what hangs on them.

use std::collections::HashMap;

use glam::{DAffine3, DQuat, DVec3, DVec4, EulerRot};

use super::curve::Curve;

/// A place relative to another.
#[derive(Clone, Debug, PartialEq)]
pub enum Local {
    /// Any affine map.
    Matrix(DAffine3),
    /// Scaled, then turned, then moved.
    Steps {
        /// Last step.
        translation: DVec3,
        /// Second step, of unit length.
        rotation: DQuat,
        /// First step.
        scale: DVec3,
    },
}

impl Local {
    /// As one map.
    pub fn matrix(&self) -> DAffine3 {
        match self {
            Self::Matrix(matrix) => *matrix,
            Self::Steps { translation, rotation, scale } => {
                DAffine3::from_scale_rotation_translation(*scale, *rotation, *translation)
            }
        }
    }
}

/// Rotations over time.
#[derive(Clone, Debug, PartialEq)]
pub enum Turning {
    /// Quaternions (x, y, z, w).
    Quaternions(Curve<DVec4>),
    /// Degrees about the x axis, then y, then z.
    Angles(Curve<DVec3>),
    /// Degrees about one axis, of any length but 0.
    About(DVec3, Curve<f64>),
}

/// Degrees about the x axis, then y, then z, as a rotation.
pub fn by_angles(degrees: DVec3) -> DQuat {
    let [x, y, z] = degrees.to_array().map(f64::to_radians);
    DQuat::from_euler(EulerRot::ZYX, z, y, x)
}

/// Degrees about an axis of any length but 0.
pub fn about(axis: DVec3, degrees: f64) -> DQuat {
    DQuat::from_axis_angle(axis.normalize(), degrees.to_radians())
}

impl Turning {
    fn at(&self, time: f64) -> DQuat {
        match self {
            Self::Quaternions(curve) => curve.rotation_at(time),
            Self::Angles(curve) => by_angles(curve.at(time)),
            Self::About(axis, curve) => about(*axis, curve.at(time)),
        }
    }

    fn times(&self) -> &[f64] {
        match self {
            Self::Quaternions(curve) => curve.times(),
            Self::Angles(curve) => curve.times(),
            Self::About(_, curve) => curve.times(),
        }
    }
}

/// The steps of a [`Local`] that change over time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Channels {
    /// In place of [`Local::Steps::translation`].
    pub translation: Option<Curve<DVec3>>,
    /// The same for the rotation.
    pub rotation: Option<Turning>,
    /// The same for the scale.
    pub scale: Option<Curve<DVec3>>,
}

impl Channels {
    /// Whether nothing changes.
    pub fn is_empty(&self) -> bool {
        self.translation.is_none() && self.rotation.is_none() && self.scale.is_none()
    }

    fn times(&self) -> impl Iterator<Item = f64> + '_ {
        let of_vectors = [&self.translation, &self.scale].into_iter().flatten().flat_map(Curve::times);
        of_vectors.chain(self.rotation.iter().flat_map(Turning::times)).copied()
    }
}

/// A node.
#[derive(Clone, Debug, PartialEq)]
pub struct Node {
    /// The node that it is relative to, an earlier one; `None` for the world.
    pub parent: Option<u32>,
    /// Where it stands in a still image.
    pub rest: Local,
    /// What of that moves; nothing of a [`Local::Matrix`] can.
    pub channels: Channels,
}

impl Node {
    /// Its place at a time, or at rest.
    fn local(&self, time: Option<f64>) -> DAffine3 {
        let (Local::Steps { translation, rotation, scale }, Some(time)) = (&self.rest, time) else {
            return self.rest.matrix();
        };
        let Channels { translation: moved, rotation: turned, scale: scaled } = &self.channels;
        DAffine3::from_scale_rotation_translation(
            scaled.as_ref().map_or(*scale, |curve| curve.at(time)),
            turned.as_ref().map_or(*rotation, |turning| turning.at(time)),
            moved.as_ref().map_or(*translation, |curve| curve.at(time)),
        )
    }
}

/// A part of a scene, by its index there, and the node that it hangs on.
pub type Hung = (u32, u32);

/// Nodes, and what hangs on those that move.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rig {
    /// Parents come before their children.
    pub nodes: Vec<Node>,
    /// Instances on moving nodes.
    pub instances: Vec<Hung>,
    /// Lights on moving nodes.
    pub lights: Vec<Hung>,
    /// Cameras on moving nodes.
    pub cameras: Vec<Hung>,
    /// What moves in the file and stands still here, in words.
    pub notes: Vec<String>,
}

/// Numbers of instances, lights and cameras.
#[derive(Clone, Copy, Debug, Default)]
pub struct Counts {
    /// Instances.
    pub instances: usize,
    /// Lights.
    pub lights: usize,
    /// Cameras.
    pub cameras: usize,
}

impl Rig {
    /// Whether each node moves, by itself or with one that it is relative to.
    pub fn moving(&self) -> Vec<bool> {
        let mut moving: Vec<bool> = Vec::with_capacity(self.nodes.len());
        for node in &self.nodes {
            let with_parent = node.parent.and_then(|parent| moving.get(parent as usize));
            moving.push(!node.channels.is_empty() || with_parent == Some(&true));
        }
        moving
    }

    /// Adds a model's rig under a node of its own, `root`. The model brought so many parts (`of_model`), and so many were there before (`first`).
    /// If the root moves, all parts hang on it.
    pub fn append(&mut self, model: &Self, root: Node, of_model: Counts, first: Counts) {
        let root_number = self.nodes.len() as u32;
        let root_moves = !root.channels.is_empty();
        if !root_moves && model.nodes.is_empty() {
            return;
        }
        self.nodes.push(root);
        let number = |node: u32| root_number + 1 + node;
        self.nodes.extend(
            model
                .nodes
                .iter()
                .map(|node| Node { parent: Some(node.parent.map_or(root_number, number)), ..node.clone() }),
        );
        let hang = |hung: &[Hung], count: usize, first: usize| -> Vec<Hung> {
            let own: HashMap<u32, u32> = hung.iter().copied().collect();
            let node =
                |part: u32| own.get(&part).map(|node| number(*node)).or(root_moves.then_some(root_number));
            (0..count as u32).filter_map(|part| Some((first as u32 + part, node(part)?))).collect()
        };
        self.instances.extend(hang(&model.instances, of_model.instances, first.instances));
        self.lights.extend(hang(&model.lights, of_model.lights, first.lights));
        self.cameras.extend(hang(&model.cameras, of_model.cameras, first.cameras));
        for note in &model.notes {
            if !self.notes.contains(note) {
                self.notes.push(note.clone());
            }
        }
    }

    /// Places of all nodes in the world at a time in seconds, or at rest.
    pub fn worlds(&self, time: Option<f64>) -> Vec<DAffine3> {
        let mut worlds: Vec<DAffine3> = Vec::with_capacity(self.nodes.len());
        for node in &self.nodes {
            let parent = node.parent.and_then(|parent| worlds.get(parent as usize).copied());
            worlds.push(parent.unwrap_or(DAffine3::IDENTITY) * node.local(time));
        }
        worlds
    }

    /// Times of all keyframes, seconds, in no order.
    pub fn times(&self) -> impl Iterator<Item = f64> + '_ {
        self.nodes.iter().flat_map(|node| node.channels.times())
    }
}
