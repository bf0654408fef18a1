//! `lightmesh render`: a scene file to an image.

use std::path::PathBuf;
use std::time::Instant;

use clap::Args;

use super::error::{CommandError, Outcome};
use super::interrupt::Interrupt;
use super::light_mesh::LightMeshArgs;
use super::overrides::Overrides;
use super::partial::PartialPictures;
use super::progress::Reporter;
use super::ready::{ReadyScene, camera_of, ready_scene};
use super::region::RegionArgs;
use super::resume::{ResumableTiles, Resumed};
use super::shared::{BackendArgs, MemoryArgs, QuietArgs, SceneArgs, ThreadArgs};
use super::sinks::Sinks;
use super::stats_file::{BackendStats, Seconds, StatsFile, peak_rss_bytes};
use super::written::{Written, is_written};
use crate::accel::Accel;
use crate::image::output::{ImageOptions, OutputFile, OutputTarget};
use crate::image::{Image, exr::SampleType, tone::auto_exposure};
use crate::render::{RenderError, RenderStats};
use crate::scene::Camera;

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
    pub region: RegionArgs,
    #[command(flatten)]
    pub light_mesh: LightMeshArgs,
    #[command(flatten)]
    pub overrides: Overrides,
}

/// Renders a scene file.
///
/// # Errors
/// See [`CommandError`]; then no output file has changed.
pub fn run(args: &RenderArgs) -> Result<Outcome, CommandError> {
    let targets = args.output.iter().map(|path| OutputTarget::new(path)).collect::<Result<Vec<_>, _>>()?;
    let stats_target = args.stats.as_deref().map(OutputFile::new).transpose()?;
    args.threads.pool()?.install(|| render_to(args, &targets, stats_target.as_ref()))?;
    Ok(Outcome::Passed)
}

fn render_to(
    args: &RenderArgs,
    targets: &[OutputTarget],
    stats_target: Option<&OutputFile>,
) -> Result<(), CommandError> {
    let start = Instant::now();
    let reporter = args.quiet.reporter();
    let mut ready = ready_scene(&args.scene, args.backend, args.memory, &args.overrides, &reporter)?;
    ready.settings.view.crop = args.region.window(ready.settings.view.resolution)?;
    args.light_mesh.read(&mut ready.session, &ready.settings, &reporter)?;
    let camera = camera_of(&args.scene, &ready.cameras, args.camera.as_deref())?.clone();

    let written = Written::of(&ready.session, &camera, &ready.settings);
    if args.resume && targets.iter().all(|target| is_written(target.path(), &written)) {
        reporter.line("note: the image is finished, and stays as it is");
        return Ok(());
    }
    let (image, stats) = render_view(args, &mut ready, &camera, targets, &written, &reporter)?;
    let ReadyScene { session, settings, bare, mut seconds, .. } = ready;
    if let Some(choice) = &stats.choice {
        reporter.line(&format!("note: {choice}"));
    }
    if let Some(error) = stats.hybrid_error.share().filter(|&error| error > settings.shading.tolerance) {
        reporter.line(&format!(
            "warning: shadows are estimated to be wrong by {:.1} % of the light: `--integrator conventional` traces them all",
            100.0 * error
        ));
    }
    seconds.paths = stats.seconds.paths;
    seconds.mesh = stats.seconds.mesh;
    seconds.shade = stats.seconds.shade;
    seconds.check = stats.seconds.check;

    let stage = Instant::now();
    let mut exposure = settings.output.exposure;
    if bare && args.overrides.exposure.is_none() {
        let shown = settings.view.crop.and_then(|crop| image.crop(crop));
        exposure = auto_exposure(shown.as_ref().unwrap_or(&image).pixels());
        reporter.line(&format!("note: exposure {exposure:+} stops"));
    }
    let non_finite_pixels = image.non_finite_pixels();
    if non_finite_pixels > 0 {
        reporter.line(&format!("warning: {non_finite_pixels} pixels are not finite"));
    }
    let options = ImageOptions {
        sample_type: sample_type(args),
        exposure,
        window: settings.view.crop,
        metadata: written.metadata(exposure, &stats),
    };
    for target in targets {
        target.write(&image, &options)?;
    }
    remove_partial(targets, &written);
    args.light_mesh.update(&session, &settings)?;
    seconds.write = stage.elapsed().as_secs_f64();
    seconds.total = start.elapsed().as_secs_f64();

    let (scene, backend) = (session.scene(), session.backend());
    let (width, height) = settings.view.resolution;
    let stats_file = StatsFile {
        version: env!("CARGO_PKG_VERSION"),
        backend: BackendStats { name: backend.name(), version: backend.version() },
        triangles: scene.triangle_count(),
        unique_triangles: scene.meshes.iter().map(|mesh| mesh.triangles.len() as u64).sum(),
        lights: scene.lights.len(),
        resolution: [width, height],
        samples_per_pixel: settings.view.samples_per_pixel,
        threads: rayon::current_num_threads(),
        seconds,
        integrator: stats.integrator,
        choice: stats.choice,
        hybrid_error: stats.hybrid_error,
        accuracy: stats.accuracy,
        rays: stats.rays,
        mesh_points: stats.mesh_points,
        light_mesh_bytes: stats.light_mesh_bytes,
        acceleration_bytes: backend.memory_bytes(),
        peak_rss_bytes: peak_rss_bytes(),
        non_finite_pixels,
    };
    if let Some(target) = stats_target {
        target.write(format!("{}\n", serde_json::json!(stats_file)).as_bytes())?;
    }
    reporter.line(&summary(&stats_file));
    if let Some(accuracy) = &stats_file.accuracy {
        reporter.line(&accuracy.to_string());
    }
    Ok(())
}

/// Renders a view; a signal ends that, and keeps what is done.
fn render_view(
    args: &RenderArgs,
    ready: &mut ReadyScene,
    camera: &Camera,
    targets: &[OutputTarget],
    written: &Written,
    reporter: &Reporter,
) -> Result<(Image, RenderStats), CommandError> {
    let ReadyScene { session, settings, bare, .. } = ready;
    let partial_file = targets.first().map(|target| ResumableTiles::path(target.path()));
    let mut tiles = ResumableTiles::new(written.render);
    if let Some(path) = partial_file.as_deref().filter(|_| args.resume) {
        match tiles.read(path) {
            Ok(Resumed::Nothing) => {}
            Ok(Resumed::Tiles(count)) => reporter.line(&format!("note: {count} tiles are done already")),
            Ok(Resumed::Other) => {
                reporter.line(&format!("note: {} is of another render", path.display()));
            }
            Err(source) => return Err(CommandError::LightMesh { file: path.to_path_buf(), source }),
        }
    }
    // What a bare model's exposure is, its picture says.
    let exposure = (!*bare || args.overrides.exposure.is_some()).then_some(settings.output.exposure);
    let partial_targets = if args.write_partial { targets } else { &[] };
    let partial = PartialPictures::new(partial_targets, sample_type(args), settings.view.crop, exposure);
    let bar = reporter.bar("rendering");
    let (width, height) = settings.view.resolution;
    bar.set(0, u64::from(width) * u64::from(height));
    let sinks = Sinks(vec![&bar, &partial, &tiles]);
    let interrupt = Interrupt::catch().map_err(CommandError::Signals)?;
    let rendered = session.render_to(camera, settings, &sinks, &interrupt.stop);
    drop(sinks);
    bar.finish();
    if let (Err(RenderError::Stopped), Some(exit_code)) = (&rendered, interrupt.exit_code()) {
        args.light_mesh.update(session, settings)?;
        let kept = match &partial_file {
            Some(path) => format!(
                "{} tiles are kept in {}; the same command with --resume goes on",
                tiles.write(path)?,
                path.display()
            ),
            None => "nothing was kept".to_owned(),
        };
        return Err(CommandError::Interrupted { exit_code, kept });
    }
    partial.finish()?;
    rendered.map_err(|source| CommandError::Render { scene: args.scene.path.clone(), source })
}

fn sample_type(args: &RenderArgs) -> SampleType {
    if args.float { SampleType::Float } else { SampleType::Half }
}

/// Removes the tiles of an image that is finished; who can't remove them can leave them.
fn remove_partial(targets: &[OutputTarget], written: &Written) {
    let Some(path) = targets.first().map(|target| ResumableTiles::path(target.path())) else { return };
    if matches!(ResumableTiles::new(written.render).read(&path), Ok(Resumed::Tiles(_))) {
        let _ = std::fs::remove_file(path);
    }
}

/// One line on what was done.
fn summary(stats: &StatsFile) -> String {
    let seconds: &Seconds = &stats.seconds;
    let mut line = format!(
        "{} triangles, {} lights, {}×{} in {:.2} s ({} {}, {} threads; load {:.2}, build {:.2}, paths {:.2}, mesh {:.2}, \
         shade {:.2}, check {:.2}); {} shadow rays",
        stats.triangles,
        stats.lights,
        stats.resolution[0],
        stats.resolution[1],
        seconds.total,
        stats.backend.name,
        stats.backend.version,
        stats.threads,
        seconds.load,
        seconds.build,
        seconds.paths,
        seconds.mesh,
        seconds.shade,
        seconds.check,
        stats.rays.shadow,
    );
    let direct = &stats.mesh_points.direct;
    if direct.total > 0 {
        line += &format!(", {} of {} mesh points evaluated", direct.evaluated, direct.total);
    }
    line
}
