//! `lightmesh render`: a scene file to an image, or to the frames of an animation.

use std::path::PathBuf;
use std::time::Instant;

use super::error::{CommandError, Outcome};
use super::frames;
use super::job::Job;
use super::ready::{ReadyScene, camera_of, ready_scene};
use super::render_args::RenderArgs;

/// Renders a scene file.
///
/// # Errors
/// See [`CommandError`]; then no output file has changed, but those of frames that were finished.
pub fn run(args: &RenderArgs) -> Result<Outcome, CommandError> {
    args.frames.check(args.output.iter().chain(&args.stats).map(PathBuf::as_path))?;
    // Before anything is loaded: what can't be written is an error at once.
    args.frames.targets(&args.output, args.frames.first())?;
    args.frames.file(args.stats.as_deref(), args.frames.first())?;
    args.light_mesh.check()?;
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
    let still = (index, &camera);
    let ReadyScene { session, settings, .. } = &mut job.ready;
    let is_known = |&number: &i64| {
        !moves_scene && session.knows_view(&animation.frame(number).camera(index, &camera), settings)
    };
    let for_all = if numbers.iter().all(is_known) {
        0
    } else {
        frames::settle(session, &animation, still, settings, &args.scene.path, &reporter)?
    };
    let mut rays = Vec::new();
    for number in numbers {
        let moved = frames::move_to(&mut job.ready.session, &animation, Some(number), still, &reporter);
        let moved =
            moved.map_err(|source| CommandError::Session { scene: args.scene.path.clone(), source })?;
        rays.push(job.run(Some(number), &moved)?);
    }
    reporter.line(&format!(
        "{} frames: {} shadow rays, {} of them for the first one",
        rays.len(),
        for_all + rays.iter().sum::<u64>(),
        rays.first().unwrap_or(&0)
    ));
    if moves_scene && args.light_mesh.updates() {
        reporter.line("warning: the light mesh is not updated, since more than cameras moved");
        return Ok(());
    }
    args.light_mesh.update(&job.ready.session, &job.ready.settings)
}
