//! `lightmesh render`: a scene file to an image, or to the frames of an animation, as one camera or several see them.

use std::path::PathBuf;
use std::time::Instant;

use super::cameras::{ChosenCamera, PictureName};
use super::error::{CommandError, Outcome};
use super::frames;
use super::job::Job;
use super::ready::{ReadyScene, ready_scene};
use super::render_args::RenderArgs;

/// Renders a scene file.
///
/// # Errors
/// See [`CommandError`]; then no output file has changed, but those of frames and cameras that were finished.
pub fn run(args: &RenderArgs) -> Result<Outcome, CommandError> {
    let files = || args.output.iter().chain(&args.stats).map(PathBuf::as_path);
    args.frames.check(files())?;
    args.cameras.check(files())?;
    // Before anything is loaded: what can't be written is an error at once.
    let camera = args.cameras.first();
    let first = PictureName { camera: camera.as_deref(), frame: args.frames.first() };
    first.targets(&args.output)?;
    first.file(args.stats.as_deref())?;
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
    let chosen = args.cameras.choose(&args.scene, &ready.cameras)?;
    let numbers = args.frames.numbers(&ready.animation, &args.scene.path)?;
    let (bare, exposure) = (ready.bare, ready.settings.output.exposure);
    let mut job = Job { args, reporter: &reporter, start, ready };
    let mut rays = Vec::new();
    for camera in &chosen {
        if chosen.len() > 1 {
            reporter.line(&format!("camera `{}`", camera.camera.name));
        }
        // What was chosen for another camera is none of this one's matter: its images are those of a render of it alone.
        (job.ready.bare, job.ready.settings.output.exposure) = (bare, exposure);
        job.ready.session.unsettle();
        rays.push(match &numbers {
            None => {
                job.run(PictureName { camera: camera.file_name.as_deref(), frame: None }, &camera.camera)?
            }
            Some(numbers) => render_frames(&mut job, camera, numbers)?,
        });
    }
    if let [first, _, ..] = rays.as_slice() {
        reporter.line(&format!(
            "{} cameras: {} shadow rays, {first} of them for the first one",
            rays.len(),
            rays.iter().sum::<u64>(),
        ));
    }
    if numbers.is_some() && job.ready.animation.moves_scene() && args.light_mesh.updates() {
        reporter.line("warning: the light mesh is not updated, since more than cameras moved");
        return Ok(());
    }
    args.light_mesh.update(&job.ready.session, &job.ready.settings)
}

/// Renders frames as a camera sees them; returns the number of shadow rays.
fn render_frames(job: &mut Job, camera: &ChosenCamera, numbers: &[i64]) -> Result<u64, CommandError> {
    let Job { args, reporter, .. } = *job;
    let ReadyScene { session, settings, animation, .. } = &mut job.ready;
    let animation = animation.clone();
    let still = (camera.index, &camera.camera);
    let is_known = |&number: &i64| {
        let view = animation.frame(number).camera(camera.index, &camera.camera);
        !animation.moves_scene() && session.knows_view(&view, settings)
    };
    let for_all = if numbers.iter().all(is_known) {
        0
    } else {
        frames::settle(session, &animation, still, settings, &args.scene.path, reporter)?
    };
    let mut rays = Vec::new();
    for &number in numbers {
        let moved = frames::move_to(&mut job.ready.session, &animation, Some(number), still, reporter);
        let moved =
            moved.map_err(|source| CommandError::Session { scene: args.scene.path.clone(), source })?;
        let name = PictureName { camera: camera.file_name.as_deref(), frame: Some(number) };
        rays.push(job.run(name, &moved)?);
    }
    let all = for_all + rays.iter().sum::<u64>();
    reporter.line(&format!(
        "{} frames: {all} shadow rays, {} of them for the first one",
        rays.len(),
        rays.first().unwrap_or(&0)
    ));
    Ok(all)
}
