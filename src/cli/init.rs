//! `lightmesh init`: a scene file for a model, with all that was chosen written down.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use clap::Args;

use super::error::{CommandError, Outcome};
use super::shared::{QuietArgs, report_doubts};
use crate::accel::{Backend, BackendChoice};
use crate::framing::choose_view;
use crate::image::OutputFile;
use crate::image::tone::auto_exposure;
use crate::render::render;
use crate::scene::load::scene_file::FalloffName;
use crate::scene::load::{ModelFormat, OpenedScene, load_model};
use crate::scene::{Camera, Light, LightKind};
use crate::settings::{Integrator, Radius, Shadows};

/// What `init` takes.
#[derive(Args, Debug)]
pub struct InitArgs {
    /// Model (.glb, .gltf, .obj, .ply)
    model: PathBuf,
    /// Scene file to write
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    #[command(flatten)]
    quiet: QuietArgs,
}

/// Size of the image that the exposure is taken from.
const PREVIEW: (u32, u32) = (96, 72);

/// Writes the scene file.
///
/// # Errors
/// See [`CommandError`]; then no file has changed.
pub fn run(args: &InitArgs) -> Result<Outcome, CommandError> {
    if ModelFormat::of(&args.model).is_none() {
        return Err(CommandError::NotAModel(args.model.clone()));
    }
    let target = OutputFile::new(&args.output)?;
    let reporter = args.quiet.reporter();
    let spinner = reporter.spinner("reading");
    let model = load_model(&args.model);
    spinner.finish_and_clear();
    let model = model?;
    let (has_lights, has_cameras) = (!model.lights.is_empty(), !model.cameras.is_empty());
    let opened = OpenedScene::of_model(model);
    report_doubts(&opened.loaded, &args.model, &reporter);
    let spinner = reporter.spinner("choosing");
    let backend = Backend::build(BackendChoice::Auto, &opened.loaded.scene)?.backend;
    let opened = choose_view(&opened, &backend).complete(opened);
    let exposure = exposure(&opened, &backend);
    spinner.finish_and_clear();
    let folder = args.output.parent().unwrap_or(Path::new(""));
    let file = relative(&args.model, folder);
    let file = file.to_str().ok_or_else(|| CommandError::Name(args.model.clone()))?;
    let text = scene_file(&opened, file, exposure, has_lights, has_cameras);
    target.write(text.as_bytes())?;
    Ok(Outcome::Passed)
}

/// Exposure by a small image.
fn exposure(opened: &OpenedScene, backend: &Backend) -> f32 {
    let loaded = &opened.loaded;
    let mut settings = loaded.settings.clone();
    settings.view.resolution = PREVIEW;
    settings.shading.integrator = Integrator::Conventional;
    let Some(camera) = loaded.cameras.first() else { return 0.0 };
    let rendered = render(backend, &loaded.scene, camera, &settings);
    rendered.map_or(0.0, |(image, _)| auto_exposure(image.pixels()))
}

/// The model as the scene file has to name it.
fn relative(model: &Path, folder: &Path) -> PathBuf {
    if let Ok(inside) = model.strip_prefix(folder) {
        return inside.to_owned();
    }
    std::path::absolute(model).unwrap_or_else(|_| model.to_owned())
}

/// A text as TOML has it.
fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

fn scene_file(
    opened: &OpenedScene,
    file: &str,
    exposure: f32,
    has_lights: bool,
    has_cameras: bool,
) -> String {
    let loaded = &opened.loaded;
    let mut text = String::new();
    let mut line = |content: String| {
        // Writing to a String can't fail.
        let _ = writeln!(text, "{content}");
    };
    line("# Lights in candela (W/sr) at point lights, in lux at directional ones.".to_owned());
    line(format!("falloff = \"{}\"", FalloffName::InverseSquare));
    if let Some(camera) = loaded.cameras.first() {
        line(String::new());
        if has_cameras {
            line("# The model's first camera; without this table it is taken from the model.".to_owned());
            let names: Vec<&str> = loaded.cameras.iter().map(|camera| camera.name.as_str()).collect();
            line(format!("# Cameras in the model, for --camera: {}", quoted(&names.join(", "))));
        } else {
            line("# The model has no camera: this one was chosen by what rays found.".to_owned());
        }
        line(camera_table(camera));
    }
    let (width, height) = loaded.settings.view.resolution;
    line("\n[render]".to_owned());
    line(format!("resolution = [{width}, {height}]"));
    line("lambertian = true".to_owned());
    line("# Stops; each doubles the brightness of PNG images.".to_owned());
    line(format!("exposure = {exposure:?}"));
    line("\n[light_mesh]".to_owned());
    line(
        "# Distance between mesh points; with traced shadow edges \"auto\" follows the size of pixels."
            .to_owned(),
    );
    line("spacing = \"auto\"".to_owned());
    if let Radius::Spacings(radius) = loaded.settings.shading.kernel.radius {
        line(format!("radius_in_spacings = {radius:?}"));
    }
    line(format!(
        "# Where mesh points disagree about a light, a shadow ray decides; \"{}\" shadows blur over the radius.",
        Shadows::Soft
    ));
    line(format!("shadows = \"{}\"", Shadows::Sharp));
    if let Some(indirect) = &loaded.settings.mesh.indirect {
        line("\n# Light from surfaces, bounce after bounce; without this table there is none.".to_owned());
        line(format!("[light_mesh.indirect]\nbounces = {}", indirect.bounces));
    }
    line("\n[[geometry]]".to_owned());
    line(format!("file = {}", quoted(file)));
    if has_lights {
        line(format!("# false leaves out the model's {} lights.\nlights = true", loaded.scene.lights.len()));
    } else {
        line("\n# The model has no lights: these go with the camera.".to_owned());
        loaded.scene.lights.iter().for_each(|light| line(light_table(light)));
    }
    if loaded.scene.materials.iter().any(|material| material.cull) {
        line("\n# The rooms are shown cut open: camera rays pass through the backs of walls.".to_owned());
        line("[[material]]\ncull = true".to_owned());
    }
    text
}

fn camera_table(camera: &Camera) -> String {
    let Camera { name, position, look_at, up, vertical_fov } = camera;
    format!(
        "[camera]\nname = {}\nposition = {:?}\nlook_at = {:?}\nup = {:?}\nvertical_fov = {vertical_fov:?}",
        quoted(name),
        position.to_array(),
        look_at.to_array(),
        up.to_array(),
    )
}

fn light_table(light: &Light) -> String {
    let mut table = "[[light]]\n".to_owned();
    let direction = match light.kind {
        LightKind::Point | LightKind::Ball { .. } => None,
        LightKind::Spot { direction, .. } | LightKind::Directional { direction } => Some(direction),
    };
    if !matches!(light.kind, LightKind::Directional { .. }) {
        table += &format!("position = {:?}\n", light.position.to_array());
    }
    if let Some(direction) = direction {
        table += &format!("direction = {:?}\n", direction.to_array());
    }
    if let LightKind::Ball { radius } = light.kind {
        table += &format!("radius = {radius:?}\n");
    }
    if let LightKind::Spot { inner_cosine, outer_cosine, .. } = light.kind {
        let angles = [inner_cosine, outer_cosine].map(|cosine| cosine.acos().to_degrees());
        table += &format!("cone = {angles:?}\n");
    }
    table + &format!("intensity = {:?}", light.intensity.to_array())
}
