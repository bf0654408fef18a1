//! `lightmesh render`: a scene file to an image.

use std::path::PathBuf;
use std::time::Instant;

use clap::Args;

use super::error::{CommandError, Outcome};
use super::frames::{self, FrameArgs};
use super::overrides::Overrides;
use super::partial::PartialPictures;
use super::progress::Reporter;
use super::shared::{BackendArgs, MemoryArgs, QuietArgs, SceneArgs, ThreadArgs};
use super::stats_file::{BackendStats, Seconds, StatsFile, peak_rss_bytes};
use crate::accel::{Accel, Backend};
use crate::framing::choose_view;
use crate::image::output::ImageOptions;
use crate::image::{exr::SampleType, tone::auto_exposure};
use crate::render::{RenderStats, Session, StopToken};
use crate::scene::Camera;
use crate::scene::load::{LoadedScene, OpenedScene};
use crate::settings::{Limits, Settings};

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
    #[command(flatten)]
    pub frames: FrameArgs,
    #[command(flatten)]
    pub overrides: Overrides,
}

/// Renders a scene file.
///
/// # Errors
/// See [`CommandError`]; then no output file has changed.
pub fn run(args: &RenderArgs) -> Result<Outcome, CommandError> {
    args.frames.check(args.output.iter().chain(&args.stats).map(PathBuf::as_path))?;
    // Before anything is loaded: what can't be written is an error at once.
    args.frames.targets(&args.output, args.frames.first())?;
    args.frames.file(args.stats.as_deref(), args.frames.first())?;
    args.threads.pool()?.install(|| render_to(args))?;
    Ok(Outcome::Passed)
}

fn render_to(args: &RenderArgs) -> Result<(), CommandError> {
    let start = Instant::now();
    let reporter = args.quiet.reporter();
    let mut seconds = Seconds::default();

    let mut opened = args.scene.open(&reporter)?;
    args.overrides.apply(&mut opened.loaded.settings);
    opened.loaded.settings.limits.max_error.get_or_insert(Limits::USUAL_ERROR);
    seconds.load = start.elapsed().as_secs_f64();

    let stage = Instant::now();
    let spinner = reporter.spinner("building");
    let choice = args.backend.backend;
    args.memory.check(&args.scene, &opened.loaded.scene, &[choice])?;
    let chosen = Backend::build(choice, &opened.loaded.scene)?;
    spinner.finish_and_clear();
    if let Some(notice) = &chosen.notice {
        reporter.line(&format!("note: {notice}"));
    }
    seconds.build = stage.elapsed().as_secs_f64();

    let stage = Instant::now();
    let view = choose_view(&opened, &chosen.backend);
    let OpenedScene { loaded, choices, bare } = view.complete(opened);
    let LoadedScene { mut scene, cameras, animation, settings, .. } = loaded;
    for choice in &choices {
        reporter.line(&format!("note: {choice}"));
    }
    let camera = match &args.camera {
        None => cameras.first().map(|camera| (0, camera)),
        Some(name) => cameras.iter().enumerate().find(|(_, camera)| camera.name == *name),
    }
    .ok_or_else(|| CommandError::NoSuchCamera {
        scene: args.scene.path.clone(),
        name: args.camera.clone().unwrap_or_default(),
        names: cameras.iter().map(|camera| camera.name.as_str()).collect::<Vec<_>>().join(", "),
    })?;
    seconds.view = stage.elapsed().as_secs_f64();

    let numbers = args.frames.numbers(&animation, &args.scene.path)?;
    args.frames.prepare(&mut scene, &animation, &reporter);
    let session_error = |source| CommandError::Session { scene: args.scene.path.clone(), source };
    let mut session = Session::with_backend(scene, chosen.backend).map_err(session_error)?;
    let mut job = Job { args, reporter: &reporter, start, seconds, settings, bare, session: &mut session };
    let Some(numbers) = numbers else { return job.render(None, camera.1).map(|_| ()) };
    let mut rays = Vec::new();
    for number in numbers {
        let camera = frames::move_to(job.session, &animation, Some(number), camera, &reporter)
            .map_err(session_error)?;
        rays.push(job.render(Some(number), &camera)?);
    }
    reporter.line(&format!(
        "{} frames: {} shadow rays, {} of them for the first one",
        rays.len(),
        rays.iter().sum::<u64>(),
        rays.first().unwrap_or(&0)
    ));
    Ok(())
}

/// What renders one image after the other.
struct Job<'a> {
    args: &'a RenderArgs,
    reporter: &'a Reporter,
    start: Instant,
    seconds: Seconds,
    settings: Settings,
    /// Whether the exposure is still to be chosen.
    bare: bool,
    session: &'a mut Session,
}

impl Job<'_> {
    /// Renders a still image or a frame, and writes what was asked for; returns the number of shadow rays.
    fn render(&mut self, number: Option<i64>, camera: &Camera) -> Result<u64, CommandError> {
        let Self { args, reporter, start, ref mut seconds, ref mut settings, ref mut bare, ref mut session } =
            *self;
        let targets = args.frames.targets(&args.output, number)?;
        let stats_target = args.frames.file(args.stats.as_deref(), number)?;
        let bar = reporter.bar("rendering");
        let (width, height) = settings.view.resolution;
        bar.set(0, u64::from(width) * u64::from(height));
        let sample_type = if args.float { SampleType::Float } else { SampleType::Half };
        // What a bare model's exposure is, its picture says.
        let exposure = (!*bare || args.overrides.exposure.is_some()).then_some(settings.output.exposure);
        let partial = PartialPictures::new(
            &bar,
            if args.write_partial { &targets } else { &[] },
            sample_type,
            exposure,
        );
        let rendered = session.render_to(camera, settings, &partial, &StopToken::default());
        partial.finish()?;
        let (image, stats) =
            rendered.map_err(|source| CommandError::Render { scene: args.scene.path.clone(), source })?;
        bar.finish();
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
        if std::mem::take(bare) && args.overrides.exposure.is_none() {
            // Frames share that of the first one, so that their brightness doesn't jump.
            settings.output.exposure = auto_exposure(image.pixels());
            reporter.line(&format!("note: exposure {:+} stops", settings.output.exposure));
        }
        let non_finite_pixels = image.non_finite_pixels();
        if non_finite_pixels > 0 {
            reporter.line(&format!("warning: {non_finite_pixels} pixels are not finite"));
        }
        let (scene, backend) = (session.scene(), session.backend());
        let options = ImageOptions {
            sample_type,
            exposure: settings.output.exposure,
            metadata: metadata(backend, settings, number.is_none().then_some(&stats)),
        };
        for target in &targets {
            target.write(&image, &options)?;
        }
        seconds.write = stage.elapsed().as_secs_f64();
        seconds.total = start.elapsed().as_secs_f64();

        let stats_file = StatsFile {
            version: env!("CARGO_PKG_VERSION"),
            backend: BackendStats { name: backend.name(), version: backend.version() },
            triangles: scene.triangle_count(),
            unique_triangles: scene.meshes.iter().map(|mesh| mesh.triangles.len() as u64).sum(),
            lights: scene.lights.len(),
            resolution: [width, height],
            samples_per_pixel: settings.view.samples_per_pixel,
            threads: rayon::current_num_threads(),
            seconds: *seconds,
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
        // The next frame begins here.
        (self.start, self.seconds) = (Instant::now(), Seconds::default());
        Ok(stats_file.rays.shadow)
    }
}

/// What is stored in the image: nothing that differs from run to run. How many rays a frame took follows from the frames before it.
fn metadata(backend: &Backend, settings: &Settings, still: Option<&RenderStats>) -> Vec<(String, String)> {
    let entry = |key: &str, value: String| (key.to_owned(), value);
    let mut entries = vec![
        entry("Software", format!("lightmesh {}", env!("CARGO_PKG_VERSION"))),
        entry("lightmesh:backend", backend.to_string()),
        entry("lightmesh:settings", format!("{settings:?}")),
    ];
    entries.extend(still.map(|stats| entry("lightmesh:shadow_rays", stats.rays.shadow.to_string())));
    entries
}

/// One line on what was done.
fn summary(stats: &StatsFile) -> String {
    let seconds = &stats.seconds;
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
