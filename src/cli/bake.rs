//! `lightmesh bake`: a scene's light mesh as a file.

use std::path::PathBuf;
use std::time::Instant;

use clap::{ArgAction, Args};
use glam::Vec3;

use super::error::{CommandError, Outcome};
use super::frames::{self, FrameArgs};
use super::interrupt::Interrupt;
use super::overrides::Overrides;
use super::parse;
use super::ready::{ReadyScene, camera_of, ready_scene};
use super::shared::{BackendArgs, MemoryArgs, QuietArgs, SceneArgs, ThreadArgs};
use crate::Bounds;
use crate::image::OutputFile;
use crate::light_mesh::file::MeshFileError;
use crate::render::{RenderError, Session};
use crate::scene::Camera;
use crate::settings::Settings;

/// What `bake` takes.
#[derive(Args, Debug)]
pub struct BakeArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Light mesh to write; one that is there and belongs to the scene is added to
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Camera whose view is made known, by name; may be given several times; all cameras of the scene if nothing else is asked for
    #[arg(long, value_name = "NAME")]
    camera: Vec<String>,
    /// Evaluate all mesh points of direct light in the whole scene
    #[arg(long)]
    whole: bool,
    /// Evaluate all mesh points of direct light in a box between two corners; may be given several times
    #[arg(long = "box", value_name = "X,Y,Z", num_args = 2, action = ArgAction::Append, allow_hyphen_values = true, value_parser = parse::point)]
    corners: Vec<Vec3>,
    #[command(flatten)]
    quiet: QuietArgs,
    #[command(flatten)]
    backend: BackendArgs,
    #[command(flatten)]
    memory: MemoryArgs,
    #[command(flatten)]
    threads: ThreadArgs,
    #[command(flatten)]
    frames: FrameArgs,
    #[command(flatten)]
    overrides: Overrides,
}

/// Writes the light mesh.
///
/// # Errors
/// See [`CommandError`]; then the file is as it was.
pub fn run(args: &BakeArgs) -> Result<Outcome, CommandError> {
    OutputFile::new(&args.output)?;
    args.threads.pool()?.install(|| bake(args))?;
    Ok(Outcome::Passed)
}

fn bake(args: &BakeArgs) -> Result<(), CommandError> {
    let start = Instant::now();
    let reporter = args.quiet.reporter();
    let ready =
        ready_scene(&args.scene, args.backend, args.memory, &args.overrides, &args.frames, &reporter)?;
    let ReadyScene { mut session, cameras, animation, settings, .. } = ready;
    match session.read_light_meshes(&args.output, &settings) {
        Err(MeshFileError::Read(error)) if error.kind() == std::io::ErrorKind::NotFound => {}
        read => {
            read.map_err(|source| CommandError::LightMesh { file: args.output.clone(), source })?;
        }
    }
    let named = args.camera.iter().map(|name| camera_of(&args.scene, &cameras, Some(name)));
    let mut seen = named.collect::<Result<Vec<_>, _>>()?;
    let (corners, _) = args.corners.as_chunks::<2>();
    let mut boxes: Vec<Bounds> =
        corners.iter().map(|&[a, b]| Bounds { min: a.min(b), max: a.max(b) }).collect();
    if args.whole {
        // As far as points matter to any surface.
        boxes.push(Bounds { min: Vec3::NEG_INFINITY, max: Vec3::INFINITY });
    }
    if seen.is_empty() && boxes.is_empty() {
        seen.extend(cameras.iter().enumerate());
    }
    let numbers = args.frames.numbers(&animation, &args.scene.path)?;
    if numbers.is_some() && animation.moves_scene() {
        reporter
            .line("note: only cameras move here; frames evaluate anew what other motion may have changed");
    }
    let interrupt = Interrupt::catch().map_err(CommandError::Signals)?;
    let stop = &interrupt.stop;
    let (mut evaluated, mut rays) = (0, 0);
    let (width, height) = settings.view.resolution;
    for (index, still) in seen {
        let views: Vec<Camera> = match &numbers {
            None => vec![still.clone()],
            Some(numbers) => {
                numbers.iter().map(|&number| animation.frame(number).camera(index, still)).collect()
            }
        };
        if numbers.is_some() && !animation.moves_scene() {
            let scene = &args.scene.path;
            rays += frames::settle(&mut session, &animation, (index, still), &settings, scene, &reporter)?;
        }
        for camera in &views {
            let bar = reporter.bar("baking");
            bar.set(0, u64::from(width) * u64::from(height));
            let prepared = session.prepare(camera, &settings, &bar, stop);
            bar.finish();
            let stats =
                prepared.or_else(|error| Err(stopped(args, &session, &settings, &interrupt, error)?))?;
            evaluated += stats.mesh_points.direct.evaluated + stats.mesh_points.indirect.evaluated;
            rays += stats.rays.shadow + stats.rays.indirect;
        }
    }
    let (_, eye) = camera_of(&args.scene, &cameras, None)?;
    for bounds in boxes {
        let spinner = reporter.spinner("baking");
        let prepared = session.prepare_box(bounds, eye, &settings, stop);
        spinner.finish_and_clear();
        let evaluation =
            prepared.or_else(|error| Err(stopped(args, &session, &settings, &interrupt, error)?))?;
        evaluated += evaluation.evaluated;
        rays += evaluation.shadow;
    }
    let bytes = session.update_light_meshes(&args.output, &settings)?;
    reporter.line(&format!(
        "{}: {evaluated} points evaluated with {rays} rays in {:.2} s, {:.1} MB",
        args.output.display(),
        start.elapsed().as_secs_f64(),
        bytes as f64 / 1e6
    ));
    Ok(())
}

/// Why baking ended; where a signal did that, what is known by then is kept.
fn stopped(
    args: &BakeArgs,
    session: &Session,
    settings: &Settings,
    interrupt: &Interrupt,
    source: RenderError,
) -> Result<CommandError, CommandError> {
    let Some(exit_code) = interrupt.exit_code().filter(|_| matches!(source, RenderError::Stopped)) else {
        return Ok(CommandError::Render { scene: args.scene.path.clone(), source });
    };
    session.update_light_meshes(&args.output, settings)?;
    let kept = format!("{} has what was evaluated; the same command goes on", args.output.display());
    Ok(CommandError::Interrupted { exit_code, kept })
}
