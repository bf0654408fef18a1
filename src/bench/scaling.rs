//! Time over resolution, lights, triangles, spacing and threads.

use std::process::{Command, Stdio};

use super::configuration::{Configuration, conventional};
use super::report::{Aim, Goal, Plot, Report, Series, Table};
use super::setup::{Frame, PAPER_LIGHTS, PAPER_TRIANGLES, Setup, forest, new_report, temporary_folder};
use super::timing::timed;
use super::{BenchError, BenchOptions, shading, threads};
use crate::accel::Backend;
use crate::scene::generate::forest::Forest;
use crate::settings::{Estimator, Named, PointLayout, Settings};

/// Conventional tracing is left out above this number of (pixel, light) pairs: it would take minutes.
const MAX_PAIRS: u64 = 600_000_000;

/// Numbers along each axis.
struct Sizes {
    sides: &'static [u32],
    lights: &'static [u32],
    triangles: &'static [u32],
    spacings: &'static [f32],
    side: u32,
    process: (u32, (u32, u32)),
}

impl Sizes {
    fn of(options: &BenchOptions) -> Self {
        if options.quick {
            Self {
                sides: &[16, 32],
                lights: &[2, 20],
                triangles: &[1_000, 2_000],
                spacings: &[1.0],
                side: 24,
                process: (2_000, (32, 18)),
            }
        } else {
            Self {
                sides: &[300, 600, 1200, 2400],
                lights: &[10, 100, 1_000, 10_000],
                triangles: &[20_000, 200_000, 2_000_000],
                spacings: &[1.0, 0.75, 0.5, 0.35, 0.25],
                side: 600,
                process: (10_000_000, (1920, 1080)),
            }
        }
    }
}

/// The meshes that are timed beside conventional tracing.
fn configurations(spacing: f32) -> [Configuration; 2] {
    [Estimator::Directional, Estimator::PerLight].map(|estimator| Configuration {
        estimator,
        layout: PointLayout::Regular,
        spacing,
        radius: 1.5 * spacing,
        levels: 0,
    })
}

/// Runs the measurement.
pub fn run(options: &BenchOptions, log: &dyn Fn(&str)) -> Result<Report, BenchError> {
    let sizes = Sizes::of(options);
    let (triangles, lights) = if options.quick { (2_000, 10) } else { (PAPER_TRIANGLES, PAPER_LIGHTS) };
    let setup = forest(triangles, lights)?;
    let backend = Backend::build(options.backend, &setup.scene)?.backend;
    let mut report = new_report("scaling", backend.to_string(), options);

    log("resolution");
    let mut axis = Axis::new("resolution", "pixels per side");
    for &side in sizes.sides {
        axis.measure(f64::from(side), &setup, &backend, side, 0.5, options, &mut report)?;
    }
    axis.finish(&mut report);

    log("spacing");
    let mut axis = Axis::new("spacing", "spacing, scene units (R = 1.5 spacings)");
    for &spacing in sizes.spacings {
        axis.measure(f64::from(spacing), &setup, &backend, sizes.side, spacing, options, &mut report)?;
    }
    axis.finish(&mut report);

    log("threads");
    threads::measure(&setup, &backend, &configurations(0.5)[0], sizes.side, options, &mut report)?;
    drop(backend);

    log("lights");
    let mut axis = Axis::new("lights", "lights");
    for &lights in sizes.lights {
        let setup = forest(triangles, lights)?;
        let backend = Backend::build(options.backend, &setup.scene)?.backend;
        axis.measure(f64::from(lights), &setup, &backend, sizes.side, 0.5, options, &mut report)?;
    }
    axis.finish(&mut report);
    if let [few, .., many] = *sizes.lights {
        let configuration = &configurations(0.5)[0];
        shading::measure(triangles, [few, many], configuration, sizes.side, options, &mut report)?;
    }

    log("triangles");
    let mut axis = Axis::new("triangles", "triangles");
    for &triangles in sizes.triangles {
        let setup = forest(triangles, lights)?;
        let (seconds, chosen) = timed(|| Backend::build(options.backend, &setup.scene));
        let backend = chosen?.backend;
        report.record(format!("triangles {triangles}: load"), vec![setup.load_seconds]);
        report.record(format!("triangles {triangles}: build"), vec![seconds]);
        axis.measure(f64::from(triangles), &setup, &backend, sizes.side, 0.5, options, &mut report)?;
    }
    axis.finish(&mut report);
    drop(setup);
    whole_process(options, &sizes, &mut report, log)?;
    Ok(report)
}

/// Times along one variable.
struct Axis {
    name: &'static str,
    table: Table,
    plot: Plot,
}

impl Axis {
    fn new(name: &'static str, unit: &str) -> Self {
        Self {
            name,
            table: Table::new(
                format!("Seconds over {name}"),
                &[unit, "integrator", "frame", "paths", "mesh", "shade", "evaluated points"],
            ),
            plot: Plot {
                title: format!("Frame time over {name}"),
                x: unit.to_owned(),
                y: "seconds".to_owned(),
                series: Vec::new(),
            },
        }
    }

    /// Times conventional tracing and light meshes at one value of the variable.
    #[allow(clippy::too_many_arguments, reason = "one row of a table has as many inputs")]
    fn measure(
        &mut self,
        value: f64,
        setup: &Setup,
        backend: &Backend,
        side: u32,
        spacing: f32,
        options: &BenchOptions,
        report: &mut Report,
    ) -> Result<(), BenchError> {
        let resolution = (side, side);
        let mut variants: Vec<(&str, Settings)> = configurations(spacing)
            .iter()
            .map(|mesh| (mesh.estimator.name(), mesh.settings(&setup.settings, resolution)))
            .collect();
        let pairs = u64::from(side) * u64::from(side) * setup.scene.lights.len() as u64;
        if pairs <= MAX_PAIRS {
            variants.push(("conventional", conventional(&setup.settings, resolution)));
        }
        let frames = options
            .budget()
            .alternate(variants.len(), |variant| setup.frame(backend, &variants[variant].1))?;
        for ((name, _), frames) in variants.iter().zip(&frames) {
            let mut record = |stage: &str, seconds: &dyn Fn(&Frame) -> f64| {
                let label = format!("{} {value}: {name}: {stage}", self.name);
                report.record(label, frames.iter().map(seconds).collect())
            };
            let frame = record("frame", &|frame| frame.seconds);
            let stages = [
                record("paths", &|frame| frame.stats.seconds.paths),
                record("mesh", &|frame| frame.stats.seconds.mesh),
                record("shade", &|frame| frame.stats.seconds.shade),
            ];
            let mut row = vec![value.to_string(), (*name).to_owned(), format!("{frame:.4}")];
            row.extend(stages.iter().map(|seconds| format!("{seconds:.4}")));
            row.push(frames[0].stats.mesh_points.direct.evaluated.to_string());
            self.table.rows.push(row);
            match self.plot.series.iter_mut().find(|series| series.label == *name) {
                Some(series) => series.points.push((value, frame)),
                None => {
                    let points = vec![(value, frame)];
                    self.plot.series.push(Series { label: (*name).to_owned(), points });
                }
            }
        }
        Ok(())
    }

    fn finish(self, report: &mut Report) {
        report.tables.push(self.table);
        report.plots.push(self.plot);
    }
}

/// Renders a large scene in a process of its own: memory at its peak, and reading against the rest.
fn whole_process(
    options: &BenchOptions,
    sizes: &Sizes,
    report: &mut Report,
    log: &dyn Fn(&str),
) -> Result<(), BenchError> {
    let Some(program) = &options.program else { return Ok(()) };
    let (triangles, (width, height)) = sizes.process;
    log(&format!("{triangles} triangles in a process of its own"));
    let failed = |reason: String| BenchError::Process { program: program.clone(), reason };
    let folder = temporary_folder()?;
    Forest { triangles, lights: PAPER_LIGHTS, seed: 1 }.write(folder.path())?;
    let stats_path = folder.path().join("stats.json");
    let output = Command::new(program)
        .arg("render")
        .arg(folder.path().join("forest.toml"))
        .arg("--quiet")
        .arg("--output")
        .arg(folder.path().join("forest.exr"))
        .arg("--stats")
        .arg(&stats_path)
        .args(["--resolution", &format!("{width}x{height}")])
        .args(["--threads", &rayon::current_num_threads().to_string()])
        .stdin(Stdio::null())
        .output()
        .map_err(|error| failed(error.to_string()))?;
    if !output.status.success() {
        let message = String::from_utf8_lossy(&output.stderr);
        return Err(failed(format!("render: {}: {}", output.status, message.trim())));
    }
    let text = std::fs::read_to_string(&stats_path).map_err(|error| failed(error.to_string()))?;
    let stats: serde_json::Value =
        serde_json::from_str(&text).map_err(|error| failed(format!("statistics: {error}")))?;
    let second = |stage: &str| stats["seconds"][stage].as_f64().unwrap_or(f64::NAN);
    let stages = ["load", "build", "paths", "mesh", "shade", "write", "total"];
    let mut table = Table::new(
        format!("{triangles} triangles, {PAPER_LIGHTS} lights, {width}×{height}, whole process"),
        &["stage", "seconds"],
    );
    for stage in stages {
        report.record(format!("process {triangles}: {stage}"), vec![second(stage)]);
        table.rows.push(vec![stage.to_owned(), format!("{:.3}", second(stage))]);
    }
    // The image in memory: three floats per pixel.
    let image = f64::from(width) * f64::from(height) * 12.0;
    let peak = stats["peak_rss_bytes"].as_f64().unwrap_or(f64::NAN);
    let per_triangle = (peak - image) / f64::from(triangles);
    table.rows.push(vec!["peak memory, bytes".to_owned(), format!("{peak:.0}")]);
    report.tables.push(table);
    report.goals.push(Goal::new(
        format!("peak bytes per triangle beyond the image, {triangles} triangles"),
        per_triangle,
        Aim::AtMost,
        250.0,
    ));
    let rest = second("build") + second("paths") + second("mesh") + second("shade");
    report.goals.push(Goal::new(
        format!("reading over building and rendering, {triangles} triangles (OBJ)"),
        second("load") / rest,
        Aim::AtMost,
        1.0,
    ));
    Ok(())
}
