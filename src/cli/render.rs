//! `lightmesh render`: a scene file to a picture.

use std::path::PathBuf;
use std::time::Instant;

use clap::{Args, ValueEnum};
use glam::Vec3;

use super::progress::Reporter;
use super::stats_file::{BackendStats, Seconds, StatsFile, peak_rss_bytes};
use crate::accel::{Accel, Backend, BackendChoice, BackendError, MemoryLimitError, check_memory, parse_size};
use crate::framing::choose_view;
use crate::image::output::{ImageOptions, OutputFile, OutputTarget};
use crate::image::{Image, ImageError, exr::SampleType, tone::auto_exposure};
use crate::light_mesh::MeshError;
use crate::render::{Film, RenderStats, render};
use crate::scene::load::{LoadError, LoadedScene, OpenedScene, open_scene};
use crate::settings::{Estimator, Integrator, Neighbourhood, Radius, Resolve, Settings, Spacing};
use crate::with_accel;

/// What `render` takes. Flags override the scene file.
#[derive(Debug, Default, Args)]
pub struct RenderArgs {
    /// Scene file (TOML) or model (.glb, .gltf, .obj, .ply; also .gz and .zst)
    pub scene: PathBuf,
    /// Picture to write, .exr or .png; may be given several times
    #[arg(short, long = "output", value_name = "FILE", required = true)]
    pub output: Vec<PathBuf>,
    /// Write what was counted and measured as JSON
    #[arg(long, value_name = "FILE")]
    pub stats: Option<PathBuf>,
    /// Say nothing but errors
    #[arg(short, long)]
    pub quiet: bool,
    /// Library that traces the rays
    #[arg(long, value_enum, default_value_t)]
    pub backend: BackendChoice,
    /// Refuse a scene that would take more memory while it is built, by an estimate: 500M, 8G
    #[arg(long, value_name = "SIZE", value_parser = parse_size)]
    pub memory_limit: Option<u64>,
    /// Threads; 0 for one per processor
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u16).range(..=1024))]
    pub threads: u16,
    /// Store EXR files as 32-bit float instead of 16-bit half
    #[arg(long)]
    pub float: bool,
    /// Camera to look through, by name
    #[arg(long, value_name = "NAME")]
    pub camera: Option<String>,
    /// Settings that override the scene's.
    #[command(flatten)]
    pub overrides: Overrides,
}

/// Settings of the scene file that flags can override.
#[derive(Debug, Default, Args)]
#[command(next_help_heading = "Instead of the scene file's settings")]
pub struct Overrides {
    /// What computes the light at surfaces
    #[arg(long, value_enum)]
    integrator: Option<IntegratorName>,
    /// With the integrator `reference`: positions around each surface point at which the light is evaluated
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65536))]
    reference_samples: Option<u32>,
    /// How direct light follows from the light mesh
    #[arg(long, value_enum)]
    estimator: Option<EstimatorName>,
    /// Which mesh points a surface point takes
    #[arg(long, value_enum)]
    neighbourhood: Option<NeighbourhoodName>,
    /// What per-light does where mesh points disagree
    #[arg(long, value_enum)]
    resolve: Option<ResolveName>,
    /// Radius of the neighbourhood in scene units, or in spacings: 2.5s
    #[arg(long, value_name = "R", value_parser = parse_radius)]
    radius: Option<Radius>,
    /// Distance between mesh points: one number, X,Y,Z, or auto
    #[arg(long, value_name = "S", value_parser = parse_spacing)]
    spacing: Option<Spacing>,
    /// Size of the picture
    #[arg(long, value_name = "WxH", value_parser = parse_resolution)]
    resolution: Option<(u32, u32)>,
    /// Camera rays per pixel
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65536))]
    spp: Option<u32>,
    /// Brightness of PNG pictures in stops
    #[arg(long, value_name = "STOPS", allow_negative_numbers = true, value_parser = parse_exposure)]
    exposure: Option<f32>,
}

/// Declares a command-line name for each value of a setting.
macro_rules! names {
    ($name:ident for $setting:ident { $($variant:ident),+ $(,)? }) => {
        #[derive(Clone, Copy, Debug, ValueEnum)]
        #[allow(missing_docs)]
        pub enum $name { $($variant),+ }

        impl From<$name> for $setting {
            fn from(name: $name) -> Self {
                match name { $($name::$variant => Self::$variant),+ }
            }
        }
    };
}

names!(IntegratorName for Integrator { LightMesh, Conventional, Reference });
names!(EstimatorName for Estimator { Paper, Ratio, PerLight, Directional });
names!(NeighbourhoodName for Neighbourhood { Nearest, Sphere, SmoothSphere });
names!(ResolveName for Resolve { Average, Trace });

fn positive(text: &str) -> Result<f32, String> {
    match text.trim().parse::<f32>() {
        Ok(value) if value.is_finite() && value > 0.0 => Ok(value),
        _ => Err(format!("`{text}` is not a number above 0")),
    }
}

fn parse_radius(text: &str) -> Result<Radius, String> {
    match text.strip_suffix('s') {
        Some(spacings) => positive(spacings).map(Radius::Spacings),
        None => positive(text).map(Radius::Units),
    }
}

fn parse_spacing(text: &str) -> Result<Spacing, String> {
    if text == "auto" {
        return Ok(Spacing::Auto);
    }
    let numbers = text.split(',').map(positive).collect::<Result<Vec<_>, _>>()?;
    match numbers[..] {
        [all] => Ok(Spacing::Units(Vec3::splat(all))),
        [x, y, z] => Ok(Spacing::Units(Vec3::new(x, y, z))),
        _ => Err("one number or three".to_owned()),
    }
}

fn parse_resolution(text: &str) -> Result<(u32, u32), String> {
    let sides = text.split_once(['x', 'X']).and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    match sides {
        Some((width, height)) if (1..=65536).contains(&width) && (1..=65536).contains(&height) => {
            Ok((width, height))
        }
        _ => Err("width and height from 1 to 65536, such as 640x480".to_owned()),
    }
}

fn parse_exposure(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(stops) if stops.abs() <= 64.0 => Ok(stops),
        _ => Err("a number from −64 to 64".to_owned()),
    }
}

impl Overrides {
    fn apply(&self, settings: &mut Settings) {
        let mesh = &mut settings.light_mesh;
        set(&mut settings.integrator, self.integrator);
        set(&mut settings.reference_samples, self.reference_samples);
        set(&mut mesh.estimator, self.estimator);
        set(&mut mesh.resolve, self.resolve);
        set(&mut mesh.points.neighbourhood, self.neighbourhood);
        set(&mut mesh.points.radius, self.radius);
        set(&mut mesh.points.spacing, self.spacing);
        set(&mut settings.resolution, self.resolution);
        set(&mut settings.samples_per_pixel, self.spp);
        set(&mut settings.exposure, self.exposure);
    }
}

fn set<T>(setting: &mut T, value: Option<impl Into<T>>) {
    if let Some(value) = value {
        *setting = value.into();
    }
}

/// Why nothing was rendered.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// The scene can't be read.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// A picture can't be written.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// No backend.
    #[error(transparent)]
    Backend(#[from] BackendError),
    /// The scene is larger than allowed.
    #[error("{}: {error}", scene.display())]
    MemoryLimit {
        /// The scene file.
        scene: PathBuf,
        /// The estimate.
        error: MemoryLimitError,
    },
    /// The light meshes don't fit the scene.
    #[error("{}: {error}", scene.display())]
    Mesh {
        /// The scene file.
        scene: PathBuf,
        /// Why.
        error: MeshError,
    },
    /// No camera of that name.
    #[error("{}: no camera is named `{name}`; there are: {names}", scene.display())]
    NoSuchCamera {
        /// The scene file.
        scene: PathBuf,
        /// The name.
        name: String,
        /// Those that exist.
        names: String,
    },
    /// Threads can't be started.
    #[error("cannot start the threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}

/// Renders a scene file.
///
/// # Errors
/// See [`RenderError`]; then no output file has changed.
pub fn run(args: &RenderArgs) -> Result<(), RenderError> {
    let targets = args.output.iter().map(|path| OutputTarget::new(path)).collect::<Result<Vec<_>, _>>()?;
    let stats_target = args.stats.as_deref().map(OutputFile::new).transpose()?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(usize::from(args.threads)).build()?;
    pool.install(|| render_to(args, &targets, stats_target.as_ref()))
}

fn render_to(
    args: &RenderArgs,
    targets: &[OutputTarget],
    stats_target: Option<&OutputFile>,
) -> Result<(), RenderError> {
    let start = Instant::now();
    let reporter = Reporter::new(args.quiet);
    let mut seconds = Seconds::default();

    let spinner = reporter.spinner("reading");
    let mut opened = open_scene(&args.scene)?;
    spinner.finish_and_clear();
    for warning in &opened.loaded.warnings {
        reporter.line(&format!("warning: {warning}"));
    }
    if !opened.loaded.skipped.is_empty() {
        reporter.line(&format!("warning: {}: left out {}", args.scene.display(), opened.loaded.skipped));
    }
    args.overrides.apply(&mut opened.loaded.settings);
    seconds.load = start.elapsed().as_secs_f64();

    let stage = Instant::now();
    let spinner = reporter.spinner("building");
    check_memory(&opened.loaded.scene, &[args.backend], args.memory_limit)
        .map_err(|error| RenderError::MemoryLimit { scene: args.scene.clone(), error })?;
    let chosen = Backend::build(args.backend, &opened.loaded.scene)?;
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
    .ok_or_else(|| RenderError::NoSuchCamera {
        scene: args.scene.clone(),
        name: args.camera.clone().unwrap_or_default(),
        names: cameras.iter().map(|camera| camera.name.as_str()).collect::<Vec<_>>().join(", "),
    })?;
    seconds.view = stage.elapsed().as_secs_f64();

    let bar = reporter.bar("rendering");
    let rendered = render(&chosen.backend, &scene, camera, &settings, &bar);
    let (film, stats) = rendered.map_err(|error| RenderError::Mesh { scene: args.scene.clone(), error })?;
    bar.finish();
    seconds.paths = stats.seconds.paths;
    seconds.mesh = stats.seconds.mesh;
    seconds.shade = stats.seconds.shade;

    let stage = Instant::now();
    let Film { resolution: (width, height), pixels } = film;
    if bare && args.overrides.exposure.is_none() {
        settings.exposure = auto_exposure(&pixels);
        reporter.line(&format!("note: exposure {:+} stops", settings.exposure));
    }
    let image = Image::from_pixels(width, height, pixels)?;
    let non_finite_pixels = image.non_finite_pixels();
    if non_finite_pixels > 0 {
        reporter.line(&format!("warning: {non_finite_pixels} pixels are not finite"));
    }
    let options = ImageOptions {
        sample_type: if args.float { SampleType::Float } else { SampleType::Half },
        exposure: settings.exposure,
        metadata: metadata(&chosen.backend, &settings, &stats, start.elapsed().as_secs_f64()),
    };
    for target in targets {
        target.write(&image, &options)?;
    }
    seconds.write = stage.elapsed().as_secs_f64();
    seconds.total = start.elapsed().as_secs_f64();

    let stats_file = StatsFile {
        version: env!("CARGO_PKG_VERSION"),
        backend: BackendStats { name: chosen.backend.name(), version: chosen.backend.version() },
        triangles: scene.triangle_count(),
        unique_triangles: scene.meshes.iter().map(|mesh| mesh.triangles.len() as u64).sum(),
        lights: scene.lights.len(),
        resolution: [width, height],
        samples_per_pixel: settings.samples_per_pixel,
        threads: rayon::current_num_threads(),
        seconds,
        rays: stats.rays,
        mesh_points: stats.mesh_points,
        light_mesh_bytes: stats.light_mesh_bytes,
        acceleration_bytes: with_accel!(&chosen.backend, accel => accel.memory_bytes()),
        peak_rss_bytes: peak_rss_bytes(),
        non_finite_pixels,
    };
    if let Some(target) = stats_target {
        target.write(format!("{}\n", serde_json::json!(stats_file)).as_bytes())?;
    }
    reporter.line(&summary(&stats_file));
    Ok(())
}

/// What is stored in the picture.
fn metadata(
    backend: &Backend,
    settings: &Settings,
    stats: &RenderStats,
    seconds: f64,
) -> Vec<(String, String)> {
    let entry = |key: &str, value: String| (key.to_owned(), value);
    vec![
        entry("Software", format!("lightmesh {}", env!("CARGO_PKG_VERSION"))),
        entry("lightmesh:backend", backend.to_string()),
        entry("lightmesh:settings", format!("{settings:?}")),
        entry("lightmesh:seconds", format!("{seconds:.3}")),
        entry("lightmesh:shadow_rays", stats.rays.shadow.to_string()),
    ]
}

/// One line on what was done.
fn summary(stats: &StatsFile) -> String {
    let seconds = &stats.seconds;
    let mut line = format!(
        "{} triangles, {} lights, {}×{} in {:.2} s ({} {}, {} threads; load {:.2}, build {:.2}, paths {:.2}, mesh {:.2}, \
         shade {:.2}); {} shadow rays",
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
        stats.rays.shadow,
    );
    let direct = &stats.mesh_points.direct;
    if direct.total > 0 {
        line += &format!(", {} of {} mesh points evaluated", direct.evaluated, direct.total);
    }
    line
}
