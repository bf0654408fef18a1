//! From the command line to a scene that is ready to be rendered.

use std::time::Instant;

use super::error::CommandError;
use super::frames::FrameArgs;
use super::overrides::Overrides;
use super::progress::Reporter;
use super::shared::{BackendArgs, MemoryArgs, SceneArgs};
use super::stats_file::Seconds;
use crate::accel::Backend;
use crate::framing::choose_view;
use crate::render::Session;
use crate::scene::load::{LoadedScene, OpenedScene};
use crate::scene::{Animation, Camera};
use crate::settings::{Limits, Settings};

/// A scene that is ready to be rendered.
pub struct ReadyScene {
    /// The scene and its acceleration structure.
    pub session: Session,
    /// Its cameras, at least one.
    pub cameras: Vec<Camera>,
    /// What moves in it.
    pub animation: Animation,
    /// Its settings, with those of the command line.
    pub settings: Settings,
    /// Whether it is a model without a scene file.
    pub bare: bool,
    /// What it took.
    pub seconds: Seconds,
}

/// Reads a scene, builds what it takes and chooses what it leaves open.
///
/// # Errors
/// See [`CommandError`].
pub fn ready_scene(
    args: &SceneArgs,
    backend: BackendArgs,
    memory: MemoryArgs,
    overrides: &Overrides,
    frames: &FrameArgs,
    reporter: &Reporter,
) -> Result<ReadyScene, CommandError> {
    let mut seconds = Seconds::default();
    let stage = Instant::now();
    let mut opened = args.open(reporter)?;
    overrides.apply(&mut opened.loaded.settings);
    opened.loaded.settings.limits.max_error.get_or_insert(Limits::USUAL_ERROR);
    seconds.load = stage.elapsed().as_secs_f64();

    let stage = Instant::now();
    let spinner = reporter.spinner("building");
    let left = memory.check(args, &opened.loaded.scene, &[backend.backend])?;
    opened.loaded.settings.limits.memory = left;
    let chosen = Backend::build(backend.backend, &opened.loaded.scene)?;
    spinner.finish_and_clear();
    if let Some(notice) = &chosen.notice {
        reporter.line(&format!("note: {notice}"));
    }
    reporter.detail(&format!("backend: {}", chosen.backend));
    seconds.build = stage.elapsed().as_secs_f64();

    let stage = Instant::now();
    let view = choose_view(&opened, &chosen.backend);
    let OpenedScene { loaded, choices, bare } = view.complete(opened);
    let LoadedScene { mut scene, cameras, animation, settings, .. } = loaded;
    for choice in &choices {
        reporter.line(&format!("note: {choice}"));
    }
    frames.prepare(&mut scene, &animation, reporter);
    let session = Session::with_backend(scene, chosen.backend)
        .map_err(|source| CommandError::Session { scene: args.path.clone(), source })?;
    seconds.view = stage.elapsed().as_secs_f64();
    Ok(ReadyScene { session, cameras, animation, settings, bare, seconds })
}

/// The cameras of some names, or all if there is no name.
///
/// # Errors
/// [`CommandError::NoSuchCamera`].
pub fn cameras_of<'a>(
    args: &SceneArgs,
    cameras: &'a [Camera],
    names: &[String],
) -> Result<Vec<&'a Camera>, CommandError> {
    if names.is_empty() {
        return Ok(cameras.iter().collect());
    }
    names.iter().map(|name| Ok(camera_of(args, cameras, Some(name))?.1)).collect()
}

/// The camera of a name, or the first one, with its number.
///
/// # Errors
/// [`CommandError::NoSuchCamera`].
pub fn camera_of<'a>(
    args: &SceneArgs,
    cameras: &'a [Camera],
    name: Option<&str>,
) -> Result<(usize, &'a Camera), CommandError> {
    let mut numbered = cameras.iter().enumerate();
    let camera = match name {
        None => numbered.next(),
        Some(name) => numbered.find(|(_, camera)| camera.name == *name),
    };
    camera.ok_or_else(|| CommandError::NoSuchCamera {
        scene: args.path.clone(),
        name: name.unwrap_or_default().to_owned(),
        names: cameras.iter().map(|camera| camera.name.as_str()).collect::<Vec<_>>().join(", "),
    })
}
