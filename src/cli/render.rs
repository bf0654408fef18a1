//! `lightmesh render`: a scene file to an image.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;

use super::error::{CommandError, Outcome};
use super::layers::{self, LayerArgs};
use super::overrides::Overrides;
use super::partial::PartialPictures;
use super::shared::{BackendArgs, MemoryArgs, QuietArgs, SceneArgs, ThreadArgs};
use super::stats_file::{BackendStats, Seconds, StatsFile, peak_rss_bytes};
use crate::accel::{Accel, Backend};
use crate::framing::choose_view;
use crate::image::output::{ImageOptions, OutputFile, OutputTarget};
use crate::image::{exr::SampleType, tone::auto_exposure};
use crate::render::{RenderStats, Session, StopToken};
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
    pub layers: LayerArgs,
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
    let collector = args.layers.collector(targets)?;
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
    let LoadedScene { scene, cameras, mut settings, .. } = loaded;
    for choice in &choices {
        reporter.line(&format!("note: {choice}"));
    }
    let camera = match &args.camera {
        None => cameras.first(),
        Some(name) => cameras.iter().find(|camera| camera.name == *name),
    }
    .ok_or_else(|| CommandError::NoSuchCamera {
        scene: args.scene.path.clone(),
        name: args.camera.clone().unwrap_or_default(),
        names: cameras.iter().map(|camera| camera.name.as_str()).collect::<Vec<_>>().join(", "),
    })?;
    seconds.view = stage.elapsed().as_secs_f64();

    let mut session = Session::with_backend(scene, chosen.backend)
        .map_err(|source| CommandError::Session { scene: args.scene.path.clone(), source })?;
    let bar = reporter.bar("rendering");
    let (width, height) = settings.view.resolution;
    bar.set(0, u64::from(width) * u64::from(height));
    let sample_type = if args.float { SampleType::Float } else { SampleType::Half };
    // What a bare model's exposure is, its picture says.
    let exposure = (!bare || args.overrides.exposure.is_some()).then_some(settings.output.exposure);
    let partial =
        PartialPictures::new(&bar, if args.write_partial { targets } else { &[] }, sample_type, exposure);
    let rendered =
        session.render_layers(camera, &settings, &partial, &StopToken::default(), collector.as_ref());
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
    if bare && args.overrides.exposure.is_none() {
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
        metadata: metadata(backend, &args.scene.path, &settings, &stats),
    };
    let layers = collector.as_ref().and_then(|collector| collector.take(&image));
    for target in targets {
        layers::write(target, &image, (width, height), layers.as_ref(), &options)?;
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

/// What is stored in the image: nothing that differs from run to run.
fn metadata(
    backend: &Backend,
    scene: &Path,
    settings: &Settings,
    stats: &RenderStats,
) -> Vec<(String, String)> {
    let entry = |key: &str, value: String| (key.to_owned(), value);
    // The name alone: where the scene lies is a matter of the machine.
    let scene = scene.file_name().unwrap_or_default().to_string_lossy();
    let mut entries = vec![
        entry("Software", format!("lightmesh {}", env!("CARGO_PKG_VERSION"))),
        entry("lightmesh:backend", backend.to_string()),
        entry("lightmesh:settings", format!("{settings:?}")),
        entry("lightmesh:shadow_rays", stats.rays.shadow.to_string()),
        entry("lightmesh:scene", scene.into_owned()),
        entry("lightmesh:exposure", settings.output.exposure.to_string()),
    ];
    if let Some(found) = stats.accuracy.and_then(|accuracy| accuracy.found) {
        entries.push(entry("lightmesh:error", found.error.to_string()));
    }
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
