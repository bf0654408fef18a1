//! One image after the other: still images and frames are rendered, written and reported here.

use std::path::Path;
use std::time::Instant;

use super::cameras::PictureName;
use super::display::LiveDisplay;
use super::error::CommandError;
use super::interrupt::Interrupt;
use super::layers;
use super::partial::PartialPictures;
use super::progress::Reporter;
use super::ready::ReadyScene;
use super::render_args::RenderArgs;
use super::resume::{ResumableTiles, Resumed};
use super::sinks::Sinks;
use super::stats_file::{BackendStats, Seconds, StatsFile, peak_rss_bytes};
use super::written::{Written, is_written};
use crate::accel::Accel;
use crate::image::output::{ImageOptions, OutputTarget};
use crate::image::{Image, Window, exr::SampleType, tone::auto_exposure};
use crate::render::{LayerCollector, LayerImage, RenderError, RenderStats, TILE, TileSink};
use crate::scene::Camera;

/// What renders one image after the other.
pub struct Job<'a> {
    /// The command line.
    pub args: &'a RenderArgs,
    /// Whom to report to.
    pub reporter: &'a Reporter,
    /// When the work at the next image began.
    pub start: Instant,
    /// The scene.
    pub ready: ReadyScene,
}

impl Job<'_> {
    /// Renders a still image, or a frame, and writes what was asked for; returns the number of shadow rays. Nothing is done for an image that is
    /// finished, if the command resumes.
    ///
    /// # Errors
    /// See [`CommandError`]; then no file of the image has changed.
    pub fn run(&mut self, name: PictureName, camera: &Camera) -> Result<u64, CommandError> {
        let Self { args, reporter, .. } = *self;
        let targets = name.targets(&args.output)?;
        let stats_target = name.file(args.stats.as_deref())?;
        let written = Written::of(args, &self.ready.session, camera, &self.ready.settings);
        if args.resume && targets.iter().all(|target| is_written(target.path(), &written)) {
            let names: Vec<String> =
                targets.iter().map(|target| target.path().display().to_string()).collect();
            reporter.line(&format!("note: {}: finished, stays as it is", names.join(", ")));
            reporter.bar("rendering").set(1, 1);
            return Ok(0);
        }
        let collector = args.layers.collector(&targets)?;
        let (image, stats) = self.render(camera, &targets, &written, collector.as_ref())?;
        let layers = collector.and_then(|collector| collector.take(&image));
        let stats_file = self.write(&targets, &written, &image, layers.as_ref(), stats)?;
        if let Some(target) = stats_target {
            target.write(format!("{}\n", serde_json::json!(stats_file)).as_bytes())?;
        }
        reporter.line(&summary(&stats_file));
        if let Some(accuracy) = &stats_file.accuracy {
            reporter.line(&accuracy.to_string());
        }
        // The next image begins here.
        self.start = Instant::now();
        self.ready.seconds = Seconds::default();
        Ok(stats_file.rays.shadow)
    }

    /// Renders a view; a signal ends that, and keeps what is done.
    fn render(
        &mut self,
        camera: &Camera,
        targets: &[OutputTarget],
        written: &Written,
        layers: Option<&LayerCollector>,
    ) -> Result<(Image, RenderStats), CommandError> {
        let Self { args, reporter, ref mut ready, .. } = *self;
        let ReadyScene { session, settings, bare, animation, .. } = ready;
        let partial_file = targets.first().map(|target| ResumableTiles::path(target.path()));
        let mut tiles = ResumableTiles::new(written.render);
        if let Some(path) = partial_file.as_deref().filter(|_| args.resume) {
            take_tiles(&mut tiles, path, reporter)?;
        }
        // What a bare model's exposure is, its picture says.
        let exposure = (!*bare || args.overrides.exposure.is_some()).then_some(settings.output.exposure);
        let partial_targets = if args.write_partial { targets } else { &[] };
        let partial = PartialPictures::new(partial_targets, sample_type(args), settings.view.crop, exposure);
        let bar = reporter.bar("rendering");
        let whole = Window::whole(settings.view.resolution);
        // A part is rendered tile by tile.
        let part = settings.view.crop.map_or(whole, |crop| crop.on_raster(TILE, settings.view.resolution));
        let pixels = u64::from(part.width) * u64::from(part.height);
        bar.set(0, pixels);
        let server = args.display_server.as_deref();
        let display = LiveDisplay::new(server, &args.scene.path, settings.view.resolution, args.quiet);
        let sinks: Vec<&dyn TileSink> = vec![&bar, &partial, &tiles, &display];
        reporter.detail(&format!("camera: {camera:?}"));
        reporter.detail(&format!("settings: {settings:?}"));
        let interrupt = Interrupt::catch().map_err(CommandError::Signals)?;
        let rendered = session.render_layers(camera, settings, &Sinks(sinks), &interrupt.stop, layers);
        display.finish();
        if rendered.is_ok() {
            bar.set(pixels, pixels);
        }
        bar.finish();
        if let (Err(RenderError::Stopped), Some(exit_code)) = (&rendered, interrupt.exit_code()) {
            if !(args.frames.frames.is_some() && animation.moves_scene()) {
                args.light_mesh.update(session, settings)?;
            }
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

    /// Writes an image; what is to be reported of it.
    fn write(
        &mut self,
        targets: &[OutputTarget],
        written: &Written,
        image: &Image,
        layers: Option<&LayerImage>,
        stats: RenderStats,
    ) -> Result<StatsFile, CommandError> {
        let Self { args, reporter, start, ref mut ready } = *self;
        let ReadyScene { session, settings, bare, seconds, .. } = ready;
        if let Some(choice) = &stats.choice {
            reporter.line(&format!("note: {choice}"));
        }
        // Where the error was measured, that is known better.
        let is_measured = stats.accuracy.is_some_and(|accuracy| accuracy.found.is_some());
        let is_much = |&error: &f32| error > settings.shading.tolerance && !is_measured;
        if let Some(error) = stats.hybrid_error.share().filter(is_much) {
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
            let shown = settings.view.crop.and_then(|crop| image.crop(crop));
            settings.output.exposure = auto_exposure(shown.as_ref().unwrap_or(image).pixels());
            reporter.line(&format!("note: exposure {:+} stops", settings.output.exposure));
        }
        let non_finite_pixels = image.non_finite_pixels();
        if non_finite_pixels > 0 {
            reporter.line(&format!("warning: {non_finite_pixels} pixels are not finite"));
        }
        let options = ImageOptions {
            sample_type: sample_type(args),
            exposure: settings.output.exposure,
            window: settings.view.crop,
            metadata: written.metadata(settings.output.exposure, &stats),
        };
        for target in targets {
            layers::write(target, image, layers, &options)?;
        }
        remove_partial(targets, written);
        seconds.write = stage.elapsed().as_secs_f64();
        seconds.total = start.elapsed().as_secs_f64();

        let (scene, backend) = (session.scene(), session.backend());
        let (width, height) = settings.view.resolution;
        Ok(StatsFile {
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
        })
    }
}

/// Takes the tiles that an interrupted render kept.
fn take_tiles(tiles: &mut ResumableTiles, path: &Path, reporter: &Reporter) -> Result<(), CommandError> {
    match tiles.read(path) {
        Ok(Resumed::Nothing) => {}
        Ok(Resumed::Tiles(count)) => reporter.line(&format!("note: {count} tiles are done already")),
        Ok(Resumed::Other) => reporter.line(&format!("note: {} is of another render", path.display())),
        Err(source) => return Err(CommandError::LightMesh { file: path.to_path_buf(), source }),
    }
    Ok(())
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
