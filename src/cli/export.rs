//! `lightmesh export`: the known points of a light mesh with their light, for other programs.

use std::path::{Path, PathBuf};

use clap::Args;

use super::error::{CommandError, Outcome};
use super::frames::FrameArgs;
use super::overrides::Overrides;
use super::parse;
use super::ready::{ReadyScene, cameras_of, ready_scene};
use super::shared::{BackendArgs, MemoryArgs, QuietArgs, SceneArgs, ThreadArgs};
use crate::export::{GridField, PointField, encode_ply, encode_vti, encode_vtu};
use crate::image::{ImageError, OutputFile};
use crate::light_mesh::direct::KnownPoints;
use crate::render::read_known_points;
use crate::settings::Integrator;

/// What `export` takes.
///
/// Points are those of the direct light mesh. Arrays: DirectLight and Unoccluded (RGB), VisibleLights, Layer; of a .vti also Known, 0 where nothing is.
#[derive(Args, Debug)]
pub struct ExportArgs {
    /// Light mesh that `lightmesh bake` wrote (.lmesh), or a scene or model, of which the points are evaluated that its cameras need
    #[arg(value_name = "FILE")]
    input: PathBuf,
    /// File to write, .vtu (VTK, ParaView), .ply, or .vti, a regular grid for volumes; may be given several times
    #[arg(short, long = "output", value_name = "FILE", required = true)]
    output: Vec<PathBuf>,
    /// Of a scene: camera whose points are exported, by name; may be repeated [default: all]
    #[arg(long, value_name = "NAME")]
    camera: Vec<String>,
    /// Of mesh points of several spacings: the spacing of the grid of a .vti [default: that of most points]
    #[arg(long, value_name = "X", value_parser = parse::positive::<f32>)]
    spacing: Option<f32>,
    #[command(flatten)]
    quiet: QuietArgs,
    #[command(flatten)]
    backend: BackendArgs,
    #[command(flatten)]
    memory: MemoryArgs,
    #[command(flatten)]
    threads: ThreadArgs,
}

/// How points are written.
#[derive(Clone, Copy, PartialEq)]
enum Format {
    Vtu,
    Ply,
    Vti,
}

impl Format {
    fn of(path: &Path) -> Result<Self, ImageError> {
        let extension = path.extension().map(|extension| extension.to_string_lossy().to_ascii_lowercase());
        match extension.as_deref() {
            Some("vtu") => Ok(Self::Vtu),
            Some("ply") => Ok(Self::Ply),
            Some("vti") => Ok(Self::Vti),
            _ => Err(ImageError::Write {
                path: path.to_owned(),
                cause: "the name of exported points ends in .vtu, .ply or .vti".to_owned(),
            }),
        }
    }
}

impl ExportArgs {
    /// Refuses what the declarations of the flags can't express.
    pub fn check(&self) -> Result<(), String> {
        let is_grid = |path: &PathBuf| matches!(Format::of(path), Ok(Format::Vti));
        if self.spacing.is_some() && !self.output.iter().any(is_grid) {
            return Err("--spacing goes with an output that ends in .vti".to_owned());
        }
        Ok(())
    }
}

/// Writes the points.
///
/// # Errors
/// See [`CommandError`]; then no output file has changed.
pub fn run(args: &ExportArgs) -> Result<Outcome, CommandError> {
    let target = |path: &PathBuf| Ok((Format::of(path)?, OutputFile::new(path)?));
    let targets = args.output.iter().map(target).collect::<Result<Vec<_>, ImageError>>()?;
    let reporter = args.quiet.reporter();
    let is_mesh = args.input.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("lmesh"));
    let known = args
        .threads
        .pool()?
        .install(|| if is_mesh { baked_points(&args.input) } else { points_of_views(args) })?;
    let refused = |source| CommandError::Grid { file: args.input.clone(), source };
    let is_grid = |target: &(Format, OutputFile)| target.0 == Format::Vti;
    let grid =
        targets.iter().any(is_grid).then(|| GridField::of_known(&known, args.spacing).map_err(refused));
    let grid = grid.transpose()?;
    let field = PointField::of_known(known);
    reporter.line(&format!("{} points", field.positions.len()));
    if let Some(GridField { grid, known, .. }) = &grid {
        let [x, y, z] = grid.counts.to_array();
        reporter.line(&format!(
            "grid of {x}×{y}×{z} places, spacing {}: {known} are known",
            grid.step.max_element()
        ));
    }
    for (format, target) in targets {
        let bytes = match (format, &grid) {
            (Format::Vti, Some(field)) => encode_vti(&field.grid, &field.arrays),
            (Format::Ply, _) => encode_ply(&field),
            _ => encode_vtu(&field),
        };
        target.write(&bytes)?;
    }
    Ok(Outcome::Passed)
}

/// The points of a file.
fn baked_points(path: &Path) -> Result<KnownPoints, CommandError> {
    read_known_points(path).map_err(|source| CommandError::LightMesh { file: path.to_owned(), source })
}

/// The points that cameras of a scene need.
fn points_of_views(args: &ExportArgs) -> Result<KnownPoints, CommandError> {
    let reporter = args.quiet.reporter();
    let scene = SceneArgs { path: args.input.clone() };
    let (overrides, frames) = (Overrides::default(), FrameArgs::default());
    let ready = ready_scene(&scene, args.backend, args.memory, &overrides, &frames, &reporter)?;
    let ReadyScene { mut session, cameras, mut settings, .. } = ready;
    settings.shading.integrator = Integrator::LightMesh;
    settings.mesh.indirect = None;
    settings.limits.max_error = None;
    for camera in cameras_of(&scene, &cameras, &args.camera)? {
        let spinner = reporter.spinner("evaluating");
        let rendered = session.render(camera, &settings);
        spinner.finish_and_clear();
        rendered.map_err(|source| CommandError::Render { scene: scene.path.clone(), source })?;
    }
    Ok(session.known_points())
}
