//! A model without a scene file: what it lacks is chosen.

use std::path::Path;
use std::sync::Arc;

use glam::{Vec2, Vec3};

use super::{LoadError, LoadedScene, Model, ModelFormat, load_model, load_scene_file};
use crate::scene::{Bounds, Camera, Falloff, LightShape, PointLight, Scene};
use crate::settings::{Radius, Resolve, Settings, Spacing};

/// What a file holds, ready to render, and what was chosen for it.
pub struct OpenedScene {
    /// The scene.
    pub loaded: LoadedScene,
    /// What a bare model lacked and got, in words; empty for scene files.
    pub choices: Vec<String>,
    /// Whether the exposure is to follow from the picture: nobody stated one.
    pub auto_exposure: bool,
}

/// Reads a scene file or a model, by the name's extension.
///
/// # Errors
/// Those of the format.
pub fn open_scene(path: &Path) -> Result<OpenedScene, LoadError> {
    if ModelFormat::of(path).is_none() {
        let loaded = load_scene_file(path)?;
        return Ok(OpenedScene { loaded, choices: Vec::new(), auto_exposure: false });
    }
    let model = load_model(path)?;
    Ok(complete(model))
}

/// Turns a model into a scene: physical units, a camera that frames it if it has none, lights if it has none.
pub fn complete(model: Model) -> OpenedScene {
    let Model { meshes, instances, materials, parts: _, lights, mut cameras, skipped, warnings } = model;
    let mut scene = Scene {
        meshes: meshes.into_iter().map(Arc::new).collect(),
        instances,
        materials,
        lights,
        falloff: Falloff::InverseSquare,
        background: Vec3::ZERO,
    };
    let mut choices = Vec::new();
    let bounds = scene.bounds();
    let mut settings = Settings { lambertian: true, ..Settings::default() };
    let (width, height) = settings.resolution;
    if cameras.is_empty() {
        cameras.push(framing_camera(&scene, bounds, width as f32 / height as f32));
        choices.push("no camera in the file: one that frames the model".to_owned());
    }
    if let Some(camera) = cameras.first()
        && scene.lights.is_empty()
    {
        scene.lights.extend(default_lights(camera));
        choices.push(format!("no lights in the file: {} directional ones", scene.lights.len()));
    }
    let spacing = spacing(bounds, &scene.lights);
    settings.light_mesh.points.spacing = Spacing::Units(Vec3::splat(spacing));
    settings.light_mesh.points.radius = Radius::Spacings(2.0);
    settings.light_mesh.resolve = Resolve::Trace;
    choices.push(format!("mesh points every {spacing} units, shadow edges traced"));
    let loaded = LoadedScene { scene, cameras, settings, skipped, warnings };
    OpenedScene { loaded, choices, auto_exposure: true }
}

/// Vertical field of view of the framing camera, degrees.
const FRAMING_FOV: f32 = 40.0;
/// Towards the framing camera from the model's middle: from the front, somewhat from the right and above.
const FRAMING_DIRECTION: Vec3 = Vec3::new(0.55, 0.42, 1.0);
/// Room around the model.
const FRAMING_MARGIN: f32 = 1.05;

/// The nearest camera in the framing direction that has all of the scene in view.
fn framing_camera(scene: &Scene, bounds: Bounds, aspect: f32) -> Camera {
    let center = bounds.center();
    let back = FRAMING_DIRECTION.normalize();
    let right = Vec3::Y.cross(back).normalize();
    let up = back.cross(right);
    let half = (FRAMING_FOV.to_radians() * 0.5).tan();
    let slopes = Vec2::new(half * aspect, half) / FRAMING_MARGIN;
    let mesh_bounds: Vec<Bounds> = scene.meshes.iter().map(|mesh| mesh.bounds()).collect();
    let mut distance = 0.0f32;
    for instance in &scene.instances {
        let Some(bounds) = mesh_bounds.get(instance.mesh as usize) else { continue };
        for corner in 0..8 {
            let choose =
                |axis: usize| if corner >> axis & 1 == 1 { bounds.max[axis] } else { bounds.min[axis] };
            let corner = Vec3::new(choose(0), choose(1), choose(2));
            let corner = instance.to_world.map_or(corner, |to_world| to_world.transform_point3(corner));
            let offset = corner - center;
            let across = Vec2::new(offset.dot(right), offset.dot(up)).abs() / slopes;
            distance = distance.max(across.max_element() + offset.dot(back));
        }
    }
    // A model of no extent is no model, but the camera must still look somewhere.
    let distance = distance.max(center.abs().max_element() * 1e-4).max(1e-6);
    Camera {
        name: "default".to_owned(),
        position: center + back * distance,
        look_at: center,
        up: Vec3::Y,
        vertical_fov: FRAMING_FOV,
    }
}

/// Three directional lights relative to a camera: from the upper left, weaker from the right, and from straight above.
fn default_lights(camera: &Camera) -> [PointLight; 3] {
    let back = (camera.position - camera.look_at).normalize_or(Vec3::Z);
    let right = camera.up.cross(back).normalize_or(Vec3::X);
    let up = back.cross(right);
    let light = |towards: Vec3, illuminance: f32| PointLight {
        position: camera.position,
        intensity: Vec3::splat(illuminance),
        shape: LightShape::Directional { direction: -towards.normalize_or(Vec3::Y) },
    };
    [
        light(back + 0.7 * up - 0.6 * right, 2.5),
        light(back + 0.1 * up + 0.9 * right, 0.8),
        light(camera.up.normalize_or(Vec3::Y) + 0.2 * back, 1.2),
    ]
}

/// Parts of the scene's diagonal between mesh points: at most, without knowledge of the lights, and at least.
const SPACING_RANGE: [f32; 3] = [1.0 / 80.0, 1.0 / 120.0, 1.0 / 400.0];
/// Lights whose nearest neighbour is looked for.
const LIGHTS_ASKED: usize = 1000;

/// Distance between mesh points: a quarter of the distance between neighbouring lights, within a range that follows
/// from the scene's size. Shadow edges are traced, so that it decides on speed more than on sharpness.
fn spacing(bounds: Bounds, lights: &[PointLight]) -> f32 {
    let diagonal = bounds.extent().length();
    if diagonal <= 0.0 {
        return 1.0;
    }
    let [most, middle, least] = SPACING_RANGE.map(|part| part * diagonal);
    let local: Vec<Vec3> = lights
        .iter()
        .filter(|light| !matches!(light.shape, LightShape::Directional { .. }))
        .map(|light| light.position)
        .take(LIGHTS_ASKED)
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
    let unit = 10f32.powf(spacing.log10().floor() - 1.0);
    let rounded = (spacing / unit).round() * unit;
    if rounded.is_finite() && rounded > 0.0 { rounded } else { spacing }
}

/// Exposure in stops at which a picture is neither dark nor washed out: nine tenths of what is lit stay below 60 % of
/// white.
pub fn auto_exposure(pixels: &[[f32; 3]]) -> f32 {
    let luminance = |[r, g, b]: &[f32; 3]| 0.2126 * r + 0.7152 * g + 0.0722 * b;
    let lit = pixels.iter().map(luminance).filter(|l| l.is_finite() && *l > 0.0);
    let mut lit: Vec<f32> = lit.collect();
    if lit.is_empty() {
        return 0.0;
    }
    let tenth = lit.len() * 9 / 10;
    let (_, bright, _) = lit.select_nth_unstable_by(tenth, f32::total_cmp);
    // Quarters of a stop, so that two renders of nearly the same picture get the same.
    ((0.6 / *bright).log2() * 4.0).round().clamp(-160.0, 160.0) / 4.0
}
