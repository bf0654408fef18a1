//! A model without a scene file: its settings are chosen. What it lacks of camera and lights,
//! [`choose_view`](crate::framing::choose_view) chooses.

use std::path::Path;
use std::sync::Arc;

use glam::Vec3;

use super::{LoadError, LoadedScene, Model, ModelFormat, load_model, load_scene_file};
use crate::scene::animation::{Animation, FRAMES_PER_SECOND};
use crate::scene::{Falloff, Scene};
use crate::settings::{IndirectSettings, Radius, Resolve, Settings};

/// What a file holds, and what was chosen for it.
pub struct OpenedScene {
    /// The scene; of a bare model perhaps without cameras and lights.
    pub loaded: LoadedScene,
    /// What was chosen for a bare model, in words; empty for scene files.
    pub choices: Vec<String>,
    /// Whether it is a model rather than a scene file: nobody stated an exposure, and lights may be added.
    pub bare: bool,
}

/// Reads a scene file or a model, by the name's extension.
///
/// # Errors
/// Those of the format.
pub fn open_scene(path: &Path) -> Result<OpenedScene, LoadError> {
    if ModelFormat::of(path).is_none() {
        let loaded = load_scene_file(path)?;
        return Ok(OpenedScene { loaded, choices: Vec::new(), bare: false });
    }
    let model = load_model(path)?;
    Ok(OpenedScene::of_model(model))
}

impl OpenedScene {
    /// Turns a model into a scene: physical units, and mesh points at a distance that suits it.
    pub fn of_model(model: Model) -> Self {
        let Model { meshes, instances, materials, parts: _, lights, cameras, rig, skipped, warnings } = model;
        let scene = Scene {
            meshes: meshes.into_iter().map(Arc::new).collect(),
            instances,
            materials,
            lights,
            falloff: Falloff::InverseSquare,
            background: Vec3::ZERO,
            ..Scene::default()
        };
        let mut settings = Settings::default();
        settings.shading.lambertian = true;
        // Shadow edges are traced, for which mesh points in the first layer in front of surfaces will do.
        settings.shading.kernel.radius = Radius::Spacings(1.2);
        settings.shading.resolve = Resolve::Trace;
        settings.derive_indirect().bounces = IndirectSettings::ALL_BOUNCES;
        let choices = vec!["shadow edges traced".to_owned(), "light from surfaces".to_owned()];
        let animation = Animation::new(FRAMES_PER_SECOND, rig, Vec::new(), &scene, &cameras);
        let loaded = LoadedScene { scene, cameras, animation, settings, skipped, warnings };
        Self { loaded, choices, bare: true }
    }
}
