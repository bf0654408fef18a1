//! `lightmesh probe`: light at points, along lines, on planes and in grids, as a light meter finds it.

use std::path::{Path, PathBuf};

use clap::Args;
use glam::{UVec3, Vec3};

use super::error::{CommandError, Outcome};
use super::frames::FrameArgs;
use super::overrides::Overrides;
use super::parse::{self, Bounces};
use super::ready::{ReadyScene, ready_scene};
use super::shared::{BackendArgs, MemoryArgs, QuietArgs, SceneArgs, ThreadArgs};
use crate::Bounds;
use crate::image::exr::{SampleType, encode};
use crate::image::{ImageError, OutputFile, png};
use crate::probe::{
    GridFile, Plane, Probe, ProbeGrid, ProbeSettings, Unit, encode_grid_bytes, encode_grid_json,
    encode_grid_vti, false_colours, line, load_probes, luminous_map, measure, measure_harmonics, write_table,
};

/// What `probe` takes.
///
/// Points and lines give fluence, light from all directions, or irradiance where there is a normal; planes give irradiance; grids give the spherical
/// harmonics of radiance. Docs: docs/probes.md.
#[derive(Args, Debug)]
pub struct ProbeArgs {
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    place: PlaceArgs,
    /// File to write: .csv; of a plane also .png (false colours) or .exr (linear RGB, float); of a grid .json, .bin or .vti; may be given several times
    #[arg(short, long = "output", value_name = "FILE", required = true)]
    output: Vec<PathBuf>,
    /// Measuring points along the line, both ends included
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u32).range(2..=1 << 24))]
    samples: u32,
    /// Measuring points along the plane's first and second edge
    #[arg(long, value_name = "NxM", default_value = "100x100", value_parser = parse::resolution)]
    resolution: (u32, u32),
    /// Opposite corners of the grid's box [default: the scene's bounds]
    #[arg(long = "box", value_name = "X,Y,Z", num_args = 2, allow_hyphen_values = true, value_parser = parse::point)]
    corners: Option<Vec<Vec3>>,
    /// What points and lines face that bring no normal, for irradiance instead of fluence
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = parse::point)]
    normal: Option<Vec3>,
    /// Times that light passes between surfaces, or off [default: as the scene's settings say]
    #[arg(long, value_name = "BOUNCES", value_parser = parse::bounces)]
    indirect: Option<Bounces>,
    /// Rays from each point that gather light of surfaces
    #[arg(long, value_name = "N", default_value_t = ProbeSettings::default().directions,
          value_parser = clap::value_parser!(u32).range(1..=i64::from(ProbeSettings::MOST_DIRECTIONS)))]
    directions: u32,
    /// Lumens for a watt; 1 where intensities are in candela [default: 683, of a bare model 1]
    #[arg(long, value_name = "LM/W", value_parser = parse::positive::<f32>)]
    lumens_per_watt: Option<f32>,
    /// Lux at the upper end of false colours [default: the largest measured]
    #[arg(long, value_name = "LUX", value_parser = parse::positive::<f32>)]
    full_scale: Option<f32>,
    #[command(flatten)]
    quiet: QuietArgs,
    #[command(flatten)]
    backend: BackendArgs,
    #[command(flatten)]
    memory: MemoryArgs,
    #[command(flatten)]
    threads: ThreadArgs,
}

/// Where light is measured; one of them.
#[derive(Args, Debug)]
#[group(required = true, multiple = false)]
struct PlaceArgs {
    /// Points of a text file: x y z, perhaps with a normal nx ny nz, separated by commas or spaces
    #[arg(long, value_name = "FILE")]
    points: Option<PathBuf>,
    /// A line from one point to another
    #[arg(long, value_name = "X,Y,Z", num_args = 2, allow_hyphen_values = true, value_parser = parse::point)]
    line: Option<Vec<Vec3>>,
    /// A plane: a corner and two edges from there; it faces where their cross product points
    #[arg(long, value_name = "X,Y,Z", num_args = 3, allow_hyphen_values = true, value_parser = parse::point)]
    plane: Option<Vec<Vec3>>,
    /// A grid of so many points in the middles of the cells of a box
    #[arg(long, value_name = "NxMxK", value_parser = parse::counts)]
    grid: Option<UVec3>,
}

/// The formats of readings.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Format {
    Csv,
    Png,
    Exr,
    Json,
    Bytes,
    Vti,
}

impl Format {
    fn of(path: &Path) -> Option<Self> {
        match path.extension()?.to_string_lossy().to_ascii_lowercase().as_str() {
            "csv" => Some(Self::Csv),
            "png" => Some(Self::Png),
            "exr" => Some(Self::Exr),
            "json" => Some(Self::Json),
            "bin" => Some(Self::Bytes),
            "vti" => Some(Self::Vti),
            _ => None,
        }
    }
}

/// Where readings go.
type Targets = Vec<(Format, OutputFile)>;

impl ProbeArgs {
    /// Refuses what the declarations of the flags can't express.
    pub fn check(&self) -> Result<(), String> {
        let (known, names): (&[Format], &str) = if self.place.grid.is_some() {
            (&[Format::Json, Format::Bytes, Format::Vti], ".json, .bin or .vti for a grid")
        } else if self.place.plane.is_some() {
            (&[Format::Csv, Format::Png, Format::Exr], ".csv, .png or .exr for a plane")
        } else {
            (&[Format::Csv], ".csv for points and lines")
        };
        for path in &self.output {
            if !Format::of(path).is_some_and(|format| known.contains(&format)) {
                return Err(format!("{}: the name of an output ends in {names}", path.display()));
            }
        }
        if self.place.plane.is_some() && self.plane().is_none() {
            return Err("the edges of the plane enclose no area".to_owned());
        }
        if self.normal == Some(Vec3::ZERO) {
            return Err("a normal has a length above 0".to_owned());
        }
        let aside = self.place.plane.is_some() || self.place.grid.is_some();
        if aside && self.normal.is_some() {
            return Err("planes and grids take no --normal".to_owned());
        }
        if self.corners.is_some() && self.place.grid.is_none() {
            return Err("--box goes with --grid".to_owned());
        }
        Ok(())
    }

    fn plane(&self) -> Option<Plane> {
        let &[origin, along, across] = self.place.plane.as_deref()? else { return None };
        Plane::new(origin, [along, across], self.resolution)
    }

    /// The probes; none for a grid.
    fn probes(&self) -> Result<Vec<Probe>, CommandError> {
        let normal = self.normal.map(|normal| normal.as_dvec3().normalize().as_vec3());
        if let Some(file) = &self.place.points {
            let mut probes = load_probes(file)?;
            probes.iter_mut().for_each(|probe| probe.normal = probe.normal.or(normal));
            return Ok(probes);
        }
        if let Some(&[from, to]) = self.place.line.as_deref() {
            return Ok(line(from, to, self.samples, normal));
        }
        Ok(self.plane().map(|plane| plane.probes()).unwrap_or_default())
    }
}

/// Measures light.
///
/// # Errors
/// See [`CommandError`]; then no output file has changed.
pub fn run(args: &ProbeArgs) -> Result<Outcome, CommandError> {
    let target = |path: &PathBuf| Ok((Format::of(path).unwrap_or(Format::Csv), OutputFile::new(path)?));
    let targets = args.output.iter().map(target).collect::<Result<Targets, CommandError>>()?;
    let probes = args.probes()?;
    args.threads.pool()?.install(|| run_with(args, &probes, &targets))?;
    Ok(Outcome::Passed)
}

fn run_with(args: &ProbeArgs, probes: &[Probe], targets: &Targets) -> Result<(), CommandError> {
    let reporter = args.quiet.reporter();
    let (overrides, frames) = (Overrides::of_indirect(args.indirect), FrameArgs::default());
    let ready = ready_scene(&args.scene, args.backend, args.memory, &overrides, &frames, &reporter)?;
    let ReadyScene { session, settings, bare, .. } = ready;
    let default_unit = if bare { Unit::LUMEN } else { Unit::WATT };
    let unit = args.lumens_per_watt.map_or(default_unit, |lumens_per_watt| Unit { lumens_per_watt });
    let how = ProbeSettings { directions: args.directions };
    let failed = |source| CommandError::Render { scene: args.scene.path.clone(), source };
    let bar = reporter.bar("measuring");
    let begin = |probes: usize| bar.set(0, probes as u64);
    let done = |probes: usize| bar.add(probes as u64);
    if let Some(counts) = args.place.grid {
        let bounds = match args.corners.as_deref() {
            Some(&[a, b]) => Bounds { min: a.min(b), max: a.max(b) },
            _ => session.scene().bounds(),
        };
        if bounds.is_empty() {
            let problem = "holds no triangles: a grid needs --box".to_owned();
            return Err(CommandError::Malformed { file: args.scene.path.clone(), problem });
        }
        let grid = ProbeGrid::in_box(bounds, counts);
        let positions = grid.positions();
        begin(positions.len());
        let coefficients = measure_harmonics(&session, &positions, &settings, &how, &done).map_err(failed)?;
        bar.finish();
        let file = GridFile { grid: &grid, coefficients: &coefficients };
        for (format, target) in targets {
            match format {
                Format::Bytes => target.write(&encode_grid_bytes(&file))?,
                Format::Vti => target.write(&encode_grid_vti(&file))?,
                _ => {
                    let text = encode_grid_json(&file).map_err(|error| refused(target, &error))?;
                    target.write(text.as_bytes())?;
                }
            }
        }
        return Ok(());
    }
    begin(probes.len());
    let light = measure(&session, probes, &settings, &how, &done).map_err(failed)?;
    bar.finish();
    let lux: Vec<f32> = light.iter().map(|&light| unit.lux(light)).collect();
    let most = lux.iter().copied().fold(0.0, f32::max);
    let mean = lux.iter().map(|&lux| f64::from(lux)).sum::<f64>() / lux.len().max(1) as f64;
    let least = lux.iter().copied().fold(f32::INFINITY, f32::min);
    reporter.line(&format!("{} points, lux: least {least}, mean {mean:.6}, most {most}", lux.len()));
    let scale = args.full_scale.unwrap_or(most.max(f32::MIN_POSITIVE));
    for (format, target) in targets {
        match (format, args.plane()) {
            (Format::Png, Some(plane)) => {
                write_false_colours(&plane, &light, unit, scale, target)?;
                reporter.line(&format!("{}: dark blue 0 to dark red {scale} lux", target.path().display()));
            }
            (Format::Exr, Some(plane)) => write_map(&plane, &light, target)?,
            _ => target.write(write_table(probes, &light, unit).as_bytes())?,
        }
    }
    Ok(())
}

fn refused(target: &OutputFile, cause: &dyn std::error::Error) -> ImageError {
    ImageError::Encode { path: target.path().to_owned(), cause: cause.to_string() }
}

fn write_map(plane: &Plane, light: &[Vec3], target: &OutputFile) -> Result<(), ImageError> {
    let image = luminous_map(plane, light)?;
    let bytes = encode(&image, SampleType::Float, &[]).map_err(|error| refused(target, &error))?;
    target.write(&bytes)
}

fn write_false_colours(
    plane: &Plane,
    light: &[Vec3],
    unit: Unit,
    full_scale: f32,
    target: &OutputFile,
) -> Result<(), ImageError> {
    let (width, height) = plane.resolution();
    let colours = false_colours(plane, light, unit, full_scale);
    let metadata = [("lightmesh:full_scale_lux".to_owned(), full_scale.to_string())];
    let bytes =
        png::encode_rgb8(width, height, &colours, &metadata).map_err(|error| refused(target, &error))?;
    target.write(&bytes)
}
