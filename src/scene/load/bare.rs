//! A model without a scene file: its settings are chosen. What it lacks of camera and lights,
//! [`choose_view`](crate::framing::choose_view) chooses.

use std::path::Path;
use std::sync::Arc;

use glam::Vec3;

use super::{LoadError, LoadedScene, Model, ModelFormat, load_model, load_scene_file};
use crate::Bounds;
use crate::scene::{Falloff, Light, LightKind, Scene};
use crate::settings::{Radius, Resolve, Settings, Spacing};

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
        let Model { meshes, instances, materials, parts: _, lights, cameras, skipped, warnings } = model;
        let scene = Scene {
            meshes: meshes.into_iter().map(Arc::new).collect(),
            instances,
            materials,
            lights,
            falloff: Falloff::InverseSquare,
            background: Vec3::ZERO,
        };
        let mut settings = Settings::default();
        settings.shading.lambertian = true;
        let spacing = spacing(scene.bounds(), &scene.lights);
        settings.mesh.direct.spacing = Spacing::Units(Vec3::splat(spacing));
        settings.shading.kernel.radius = Radius::Spacings(2.0);
        settings.shading.resolve = Resolve::Trace;
        let choices = vec![format!("mesh points every {spacing} units, shadow edges traced")];
        let loaded = LoadedScene { scene, cameras, settings, skipped, warnings };
        Self { loaded, choices, bare: true }
    }
}

/// Parts of the scene's diagonal between mesh points: at most, without knowledge of the lights, and at least.
const SPACING_RANGE: [f32; 3] = [1.0 / 80.0, 1.0 / 120.0, 1.0 / 400.0];
/// Lights whose nearest neighbour is looked for.
const NEIGHBOURS: usize = 1000;

/// Distance between mesh points: a quarter of the distance between neighbouring lights, within a range that follows
/// from the scene's size. Shadow edges are traced, so that it decides on speed more than on sharpness.
fn spacing(bounds: Bounds, lights: &[Light]) -> f32 {
    let diagonal = bounds.extent().length();
    if diagonal <= 0.0 {
        return 1.0;
    }
    let [most, middle, least] = SPACING_RANGE.map(|part| part * diagonal);
    let local: Vec<Vec3> = lights
        .iter()
        .filter(|light| !matches!(light.kind, LightKind::Directional { .. }))
        .map(|light| light.position)
        .take(NEIGHBOURS)
        .collect();
    let mut nearest: Vec<f32> = local
        .iter()
        .enumerate()
        .map(|(i, a)| {
            let others = local.iter().enumerate().filter(|(j, _)| *j != i);
            others.fold(f32::INFINITY, |least, (_, b)| least.min(a.distance(*b)))
        })
        .filter(|distance| distance.is_finite())
        .collect();
    nearest.sort_by(f32::total_cmp);
    let spacing = nearest.get(nearest.len() / 2).map_or(middle, |median| (median * 0.25).clamp(least, most));
    // Two digits say what is meant.
    format!("{spacing:.1e}").parse().unwrap_or(spacing)
}
