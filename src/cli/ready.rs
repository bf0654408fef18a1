//! From the command line to a scene that is ready to be rendered.

use std::time::Instant;

use super::error::CommandError;
use super::overrides::Overrides;
use super::progress::Reporter;
use super::shared::{BackendArgs, MemoryArgs, SceneArgs};
use super::stats_file::Seconds;
use crate::accel::Backend;
use crate::framing::choose_view;
use crate::render::Session;
use crate::scene::Camera;
use crate::scene::load::{LoadedScene, OpenedScene};
use crate::settings::{Limits, Settings};

/// A scene that is ready to be rendered.
pub struct ReadyScene {
    /// The scene and its acceleration structure.
    pub session: Session,
    /// Its cameras, at least one.
    pub cameras: Vec<Camera>,
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
    memory.check(args, &opened.loaded.scene, &[backend.backend])?;
    let chosen = Backend::build(backend.backend, &opened.loaded.scene)?;
    spinner.finish_and_clear();
    if let Some(notice) = &chosen.notice {
        reporter.line(&format!("note: {notice}"));
    }
    seconds.build = stage.elapsed().as_secs_f64();

    let stage = Instant::now();
    let view = choose_view(&opened, &chosen.backend);
    let OpenedScene { loaded, choices, bare } = view.complete(opened);
    let LoadedScene { scene, cameras, settings, .. } = loaded;
    for choice in &choices {
        reporter.line(&format!("note: {choice}"));
    }
    let session = Session::with_backend(scene, chosen.backend)
        .map_err(|source| CommandError::Session { scene: args.path.clone(), source })?;
    seconds.view = stage.elapsed().as_secs_f64();
    Ok(ReadyScene { session, cameras, settings, bare, seconds })
}

/// The camera of a name, or the first one.
///
/// # Errors
/// [`CommandError::NoSuchCamera`].
pub fn camera_of<'a>(
    args: &SceneArgs,
    cameras: &'a [Camera],
    name: Option<&str>,
) -> Result<&'a Camera, CommandError> {
    let camera = match name {
        None => cameras.first(),
        Some(name) => cameras.iter().find(|camera| camera.name == *name),
    };
    camera.ok_or_else(|| CommandError::NoSuchCamera {
        scene: args.path.clone(),
        name: name.unwrap_or_default().to_owned(),
        names: cameras.iter().map(|camera| camera.name.as_str()).collect::<Vec<_>>().join(", "),
    })
}
