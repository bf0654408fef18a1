//! The paper's comparison: one forest, by light mesh and by conventional tracing.

use super::configuration::{Configuration, as_it_is, conventional, reference};
use super::curve::{self, Tried, fastest_within};
use super::lamps;
use super::report::{Aim, Goal, Report, Table};
use super::setup::{Frame, PAPER_LIGHTS, PAPER_TRIANGLES, Setup, forest, new_report, relative_rmse};
use super::timing::Samples;
use super::{BenchError, BenchOptions};
use crate::accel::Backend;
use crate::settings::Settings;

/// Side in pixels, lights, goals for the two meshes, goal in units of the camera rays.
type CaseGoals = (u32, u32, [Option<f64>; 2], Option<f64>);

/// Images that are compared: side in pixels, lights, goals for the two meshes (times faster), and the goal for the
/// light-mesh frame in units of the camera rays alone.
const CASES: [CaseGoals; 3] = [
    (600, 100, [Some(10.0), Some(4.0)], Some(4.0)),
    (2400, 100, [Some(20.0), None], Some(2.0)),
    (1200, 1000, [Some(25.0), None], None),
];

/// Errors that the two meshes may have.
const LIMITS: [f64; 2] = [0.10, 0.05];

/// The light mesh of somebody who sets nothing.
const AS_GENERATED: &str = "light mesh, nothing set, no error asked for";

/// Runs the comparison.
pub fn run(options: &BenchOptions, log: &dyn Fn(&str)) -> Result<Report, BenchError> {
    let triangles = if options.quick { 2_000 } else { PAPER_TRIANGLES };
    let lights = if options.quick { 10 } else { PAPER_LIGHTS };
    let setup = forest(triangles, lights)?;
    let backend = Backend::build(options.backend, &setup.scene)?.backend;
    let mut report = new_report("headline", backend.to_string(), options);

    log("error over time");
    let tried = curve::measure(&setup, &backend, options, &mut report, log)?;
    let chosen: Vec<&Tried> = LIMITS.iter().filter_map(|&limit| fastest_within(&tried, limit)).collect();
    for (tried, limit) in chosen.iter().zip(LIMITS) {
        let name = format!("error of the mesh for ≤ {:.0} %", 100.0 * limit);
        report.goals.push(Goal::new(name, tried.own_error.max(tried.exact_error), Aim::AtMost, limit));
    }
    let configurations: Vec<Configuration> = chosen.iter().map(|tried| tried.configuration.clone()).collect();
    drop(backend);

    log("lamps with a size");
    lamps::measure(
        &setup,
        &Backend::build(options.backend, &setup.scene)?.backend,
        if options.quick { 12 } else { 600 },
        options,
        &mut report,
    )?;

    for (side, case_lights, goals, camera_goal) in CASES {
        let (side, case_lights) =
            if options.quick { (side / 20, case_lights / 10) } else { (side, case_lights) };
        let other;
        let setup = if case_lights == lights {
            &setup
        } else {
            other = forest(triangles, case_lights)?;
            &other
        };
        let backend = Backend::build(options.backend, &setup.scene)?.backend;
        log(&format!("{side}×{side} with {case_lights} lights"));
        let case = Case { setup, backend: &backend, side, lights: case_lights };
        case.compare(&configurations, goals, camera_goal, options, &mut report)?;
        let others: &[Configuration] = if case_lights == lights { &[] } else { &configurations };
        case.errors(others, options, &mut report)?;
    }
    Ok(report)
}

/// One size of image and number of lights.
struct Case<'a> {
    setup: &'a Setup,
    backend: &'a Backend,
    side: u32,
    lights: u32,
}

/// Times of a series of frames.
struct Times {
    frame: f64,
    stages: [f64; 3],
}

impl Case<'_> {
    fn name(&self) -> String {
        format!("{0}×{0}, {1} lights", self.side, self.lights)
    }

    /// Times conventional tracing and the light meshes in turn.
    fn compare(
        &self,
        configurations: &[Configuration],
        goals: [Option<f64>; 2],
        camera_goal: Option<f64>,
        options: &BenchOptions,
        report: &mut Report,
    ) -> Result<(), BenchError> {
        let resolution = (self.side, self.side);
        let base = &self.setup.settings;
        let mut variants: Vec<(String, Settings)> =
            vec![("conventional".to_owned(), conventional(base, resolution))];
        variants.extend(configurations.iter().zip(LIMITS).map(|(configuration, limit)| {
            let name = format!("light mesh ≤ {:.0} % ({configuration})", 100.0 * limit);
            (name, configuration.settings(base, resolution))
        }));
        variants.push((AS_GENERATED.to_owned(), as_it_is(base, resolution)));
        // Pages and caches are warm for all, or for none.
        for (_, settings) in &variants[1..] {
            self.setup.frame(self.backend, settings)?;
        }
        let frames = options
            .budget()
            .alternate(variants.len(), |variant| self.setup.frame(self.backend, &variants[variant].1))?;

        let mut table = Table::new(
            format!("{} ({} rounds), seconds: medians and spread of the frame", self.name(), frames[0].len()),
            &["", "frame", "least", "most", "paths", "mesh", "shade", "shadow rays", "times faster"],
        );
        let mut times: Vec<Times> = Vec::new();
        for ((name, _), frames) in variants.iter().zip(&frames) {
            let measured = self.record(name, frames, report);
            let (seconds, rays) =
                (Samples(frames.iter().map(|frame| frame.seconds).collect()), &frames[0].stats.rays);
            let conventional = times.first().map_or(measured.frame, |first| first.frame);
            let mut row = vec![name.clone()];
            let numbers = [measured.frame, seconds.min(), seconds.max()];
            row.extend(numbers.iter().chain(&measured.stages).map(|value| format!("{value:.4}")));
            row.push(rays.shadow.to_string());
            row.push(format!("{:.2}", conventional / measured.frame));
            table.rows.push(row);
            times.push(measured);
        }
        report.tables.push(table);

        let Some((conventional, meshes)) = times.split_first() else { return Ok(()) };
        for ((mesh, limit), goal) in meshes.iter().zip(LIMITS).zip(goals) {
            if let Some(goal) = goal {
                let name = format!("times faster at {}, error ≤ {:.0} %", self.name(), 100.0 * limit);
                report.goals.push(Goal::new(name, conventional.frame / mesh.frame, Aim::AtLeast, goal));
            }
        }
        if let (Some(goal), Some(mesh)) = (camera_goal, meshes.first()) {
            let name = format!("light-mesh frame over its camera rays at {}", self.name());
            report.goals.push(Goal::new(name, mesh.frame / mesh.stages[0], Aim::AtMost, goal));
        }
        Ok(())
    }

    /// Medians of the frames, raw times to the report.
    fn record(&self, name: &str, frames: &[Frame], report: &mut Report) -> Times {
        let mut record = |stage: &str, seconds: &dyn Fn(&Frame) -> f64| {
            report.record(format!("{}: {name}: {stage}", self.name()), frames.iter().map(seconds).collect())
        };
        Times {
            frame: record("frame", &|frame| frame.seconds),
            stages: [
                record("paths", &|frame| frame.stats.seconds.paths),
                record("mesh", &|frame| frame.stats.seconds.mesh),
                record("shade", &|frame| frame.stats.seconds.shade),
            ],
        }
    }

    /// Own errors of the scene as generated, and of configurations that were chosen for other lights.
    fn errors(
        &self,
        configurations: &[Configuration],
        options: &BenchOptions,
        report: &mut Report,
    ) -> Result<(), BenchError> {
        let (side, samples) = if options.quick { (8, 16) } else { (24, 128) };
        let base = &self.setup.settings;
        let mut variants = vec![(AS_GENERATED.to_owned(), as_it_is(base, (side, side)))];
        variants.extend(
            configurations
                .iter()
                .map(|configuration| (configuration.to_string(), configuration.settings(base, (side, side)))),
        );
        let mut table = Table::new(format!("Own error: {}", self.name()), &["", "error %"]);
        for (name, settings) in variants {
            let exact = self.setup.frame(self.backend, &reference(&settings, samples))?.image;
            let error = relative_rmse(&self.setup.frame(self.backend, &settings)?.image, &exact);
            table.rows.push(vec![name, format!("{:.2}", 100.0 * error)]);
        }
        report.tables.push(table);
        Ok(())
    }
}
