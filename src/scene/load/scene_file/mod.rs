//! The TOML scene file, described for users in docs/scene-format.md.
//!
//! One module per table: a plain struct that mirrors the table, and the function that maps it onto the
//! scene or the settings. Unknown keys are refused everywhere; ranges are checked by the value types.

mod camera;
mod gathered;
mod geometry;
mod keyframes;
mod light_mesh;
mod lights;
mod place;
mod points;
mod render;
mod steps;
mod values;

use std::fs;
use std::path::Path;

use serde::Deserialize;
use toml::Spanned;

pub use self::lights::FalloffName;

use self::camera::CameraTables;
use self::gathered::Gathered;
use self::geometry::{GeometryTable, MaterialTable};
use self::keyframes::AnimationTable;
use self::light_mesh::LightMeshTable;
use self::lights::{LightBoxTable, LightGridTable, LightTable};
use self::place::Places;
use self::render::{PresetName, RenderTable};
use self::values::{Color, NonNegative};
use super::{LoadError, Skipped, Warning};
use crate::scene::{Animation, Camera, Falloff, Scene};
use crate::settings::Settings;

/// A scene, and how its file wants it rendered.
pub struct LoadedScene {
    /// The scene.
    pub scene: Scene,
    /// The scene file's cameras first, then those of its models; at least one, but in bare models that bring none.
    pub cameras: Vec<Camera>,
    /// What moves, by frames.
    pub animation: Animation,
    /// The defaults with the file's settings in their place.
    pub settings: Settings,
    /// Elements of the models that were left out.
    pub skipped: Skipped,
    /// Warnings for the user.
    pub warnings: Vec<Warning>,
}

/// The file's tables.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SceneTable {
    background: Option<Color>,
    preset: Option<PresetName>,
    falloff: Option<FalloffName>,
    falloff_constant: Option<Spanned<NonNegative>>,
    camera: Option<Spanned<CameraTables>>,
    #[serde(default)]
    animation: AnimationTable,
    #[serde(default)]
    render: RenderTable,
    #[serde(default)]
    light_mesh: LightMeshTable,
    geometry: Vec<Spanned<GeometryTable>>,
    #[serde(default)]
    material: Vec<Spanned<MaterialTable>>,
    #[serde(default)]
    light: Vec<Spanned<LightTable>>,
    #[serde(default)]
    light_box: Vec<Spanned<LightBoxTable>>,
    #[serde(default)]
    light_grid: Vec<Spanned<LightGridTable>>,
}

/// Reads a TOML scene file and the models that it names, which lie relative to it.
///
/// # Errors
/// The first thing that is wrong, with file, line and key.
pub fn load_scene_file(path: &Path) -> Result<LoadedScene, LoadError> {
    let read_error = |source| LoadError::Read { file: path.to_owned(), source };
    let bytes = fs::read(path).map_err(read_error)?;
    let text = String::from_utf8(bytes).map_err(|error| {
        let valid = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = 1 + valid.iter().filter(|&&byte| byte == b'\n').count();
        LoadError::Line { file: path.to_owned(), line, problem: "is not UTF-8 text".to_owned() }
    })?;
    load_scene_text(&text, path)
}

/// Reads scene-file text; `path` names it in messages, and models are looked for beside it.
///
/// # Errors
/// As [`load_scene_file`].
pub fn load_scene_text(text: &str, path: &Path) -> Result<LoadedScene, LoadError> {
    let places = Places::new(path, text);
    let table: SceneTable = toml::from_str(text).map_err(|error| places.parse_error(&error))?;

    let folder = path.parent().unwrap_or(Path::new(""));
    let mut settings = Settings::default();
    let mut falloff = Falloff::default();
    if let Some(preset) = table.preset {
        preset.apply(&mut settings, &mut falloff);
    }
    table.render.apply(&mut settings, &places)?;
    table.light_mesh.apply(&mut settings, folder, &places)?;

    let mut gathered = Gathered::default();
    let mut motions = Vec::new();
    if let Some(cameras) = &table.camera {
        for (index, (camera, motion)) in (0..).zip(CameraTables::cameras(cameras, &places)?) {
            gathered.cameras.push(camera);
            motions.extend(motion.map(|motion| (index, motion)));
        }
    }
    let constant = table.falloff_constant.as_ref().map(|constant| *constant.get_ref());
    gathered.scene.falloff = lights::falloff(falloff, table.falloff, constant).ok_or_else(|| {
        let span = table.falloff_constant.as_ref().map(Spanned::span).unwrap_or_default();
        places.error(&span, "falloff_constant", "needs falloff = \"linear\"")
    })?;
    gathered.scene.background = table.background.map_or(glam::Vec3::ZERO, |color| color.0);
    for (index, light) in table.light.iter().enumerate() {
        LightTable::add(light, index, &places, &mut gathered.scene)?;
    }
    for (index, light_box) in table.light_box.iter().enumerate() {
        LightBoxTable::add(light_box, index, &places, &mut gathered.scene)?;
    }
    for (index, grid) in table.light_grid.iter().enumerate() {
        LightGridTable::add(grid, index, &places, &mut gathered.scene)?;
    }

    geometry::load(&table.geometry, &table.material, folder, &places, &mut gathered)?;
    gathered.ensure_material();
    if gathered.cameras.is_empty() {
        return Err(places.error(&(0..0), "camera", "is missing, and no model has one"));
    }
    let Gathered { scene, rig, cameras, skipped, warnings } = gathered;
    let frames_per_second = table.animation.frames_per_second();
    let animation = Animation::new(frames_per_second, rig, motions, &scene, &cameras);
    Ok(LoadedScene { scene, cameras, animation, settings, skipped, warnings })
}
