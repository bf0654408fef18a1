//! What a model file becomes, whatever its format.

use std::ops::Range;

use super::{Skipped, Warning};
use crate::scene::animation::Rig;
use crate::scene::{Camera, Instance, Light, Material, TriangleMesh};

/// What one model file holds.
#[derive(Clone, Default)]
pub struct Model {
    /// Unique geometry.
    pub meshes: Vec<TriangleMesh>,
    /// Placements of the meshes in the model's own space.
    pub instances: Vec<Instance>,
    /// Materials that the meshes refer to; at least one.
    pub materials: Vec<Material>,
    /// Named runs of triangles, for material overrides.
    pub parts: Vec<Part>,
    /// Lights of the file.
    pub lights: Vec<Light>,
    /// Cameras of the file.
    pub cameras: Vec<Camera>,
    /// What moves of instances, lights and cameras.
    pub rig: Rig,
    /// Elements of the file that were left out, counted.
    pub skipped: Skipped,
    /// Warnings for the user.
    pub warnings: Vec<Warning>,
}

/// Consecutive triangles of one mesh that the file put under one name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Part {
    /// Index into [`Model::meshes`].
    pub mesh: u32,
    /// Object or node name; empty if none was given.
    pub object: String,
    /// Group name or names, separated by spaces; empty if none was given.
    pub group: String,
    /// The triangles.
    pub triangles: Range<u32>,
}

/// The coordinates of a model must not exceed this, which backends and the sums over a scene can take.
pub const MAX_COORDINATE: f32 = 1e15;
