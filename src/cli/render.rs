//! `lightmesh render`: a scene file to an image, or to the frames of an animation.

use std::path::PathBuf;
use std::time::Instant;

use clap::Args;

use super::error::{CommandError, Outcome};
use super::frames::{self, FrameArgs};
use super::job::Job;
use super::light_mesh::LightMeshArgs;
use super::overrides::Overrides;
use super::ready::{camera_of, ready_scene};
use super::region::RegionArgs;
use super::shared::{BackendArgs, MemoryArgs, QuietArgs, SceneArgs, ThreadArgs};

/// What `render` takes. Flags override the scene file.
#[derive(Debug, Default, Args)]
pub struct RenderArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Image to write, .exr or .png; may be given several times
    #[arg(short, long = "output", value_name = "FILE", required = true)]
    pub output: Vec<PathBuf>,
    /// Write what was counted and measured as JSON
    #[arg(long, value_name = "FILE")]
    pub stats: Option<PathBuf>,
    #[command(flatten)]
    pub quiet: QuietArgs,
    #[command(flatten)]
    pub backend: BackendArgs,
    #[command(flatten)]
    pub memory: MemoryArgs,
    #[command(flatten)]
    pub threads: ThreadArgs,
    /// Store EXR files as 32-bit float instead of 16-bit half
    #[arg(long)]
    pub float: bool,
    /// Camera to look through, by name
    #[arg(long, value_name = "NAME")]
    pub camera: Option<String>,
    /// Write the images after every step, not only after the last one
    #[arg(long)]
    pub write_partial: bool,
    /// Go on where an interrupted render of the same image ended, and leave an image alone that is finished
    #[arg(long)]
    pub resume: bool,
    #[command(flatten)]
    pub frames: FrameArgs,
    #[command(flatten)]
    pub region: RegionArgs,
    #[command(flatten)]
    pub light_mesh: LightMeshArgs,
    #[command(flatten)]
    pub overrides: Overrides,
}

/// Renders a scene file.
///
/// # Errors
/// See [`CommandError`]; then no output file has changed, but those of frames that were finished.
pub fn run(args: &RenderArgs) -> Result<Outcome, CommandError> {
    args.frames.check(args.output.iter().chain(&args.stats).map(PathBuf::as_path))?;
    // Before anything is loaded: what can't be written is an error at once.
    args.frames.targets(&args.output, args.frames.first())?;
    args.frames.file(args.stats.as_deref(), args.frames.first())?;
    args.threads.pool()?.install(|| render_all(args))?;
    Ok(Outcome::Passed)
}

fn render_all(args: &RenderArgs) -> Result<(), CommandError> {
    let start = Instant::now();
    let reporter = args.quiet.reporter();
    let mut ready =
        ready_scene(&args.scene, args.backend, args.memory, &args.overrides, &args.frames, &reporter)?;
    ready.settings.view.crop = args.region.window(ready.settings.view.resolution)?;
    args.light_mesh.read(&mut ready.session, &ready.settings, &reporter)?;
    let (index, camera) = camera_of(&args.scene, &ready.cameras, args.camera.as_deref())?;
    let (camera, animation) = (camera.clone(), ready.animation.clone());
    let numbers = args.frames.numbers(&animation, &args.scene.path)?;
    let mut job = Job { args, reporter: &reporter, start, ready };
    let Some(numbers) = numbers else {
        job.run(None, &camera)?;
        return args.light_mesh.update(&job.ready.session, &job.ready.settings);
    };
    let moves_scene = animation.moves_scene();
    let mut rays = Vec::new();
    for number in numbers {
        let still = (index, &camera);
        let moved = frames::move_to(&mut job.ready.session, &animation, Some(number), still, &reporter);
        let moved =
            moved.map_err(|source| CommandError::Session { scene: args.scene.path.clone(), source })?;
        rays.push(job.run(Some(number), &moved)?);
    }
    reporter.line(&format!(
        "{} frames: {} shadow rays, {} of them for the first one",
        rays.len(),
        rays.iter().sum::<u64>(),
        rays.first().unwrap_or(&0)
    ));
    if moves_scene && args.light_mesh.updates() {
        reporter.line("warning: the light mesh is not updated, since more than cameras moved");
        return Ok(());
    }
    args.light_mesh.update(&job.ready.session, &job.ready.settings)
}
