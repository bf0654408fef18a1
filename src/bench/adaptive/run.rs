//! All scenes, one after the other.

use super::measure::measure;
use super::show::{goal, plots, tables};
use crate::bench::opened::Opened;
use crate::bench::report::Report;
use crate::bench::scenes::{Failure, SceneResults, scene_files};
use crate::bench::setup::{PAPER_LIGHTS, PAPER_TRIANGLES, Setup, forest, interior, new_report};
use crate::bench::{BenchError, BenchOptions};

/// The hall that is made where no scenes are given: pairs of columns, and lamps for each.
const HALL: (u32, u32) = (6, 40);

/// Measures the scenes of [`BenchOptions::scenes`], or without any a forest and a hall, one after the other. One that can't be measured is
/// reported, and takes nothing from the others.
pub fn run(options: &BenchOptions, log: &dyn Fn(&str)) -> Result<Report, BenchError> {
    let mut report = new_report("adaptive", options.backend.to_string(), options);
    let mut failures = Vec::new();
    if options.scenes.is_empty() {
        for (name, setup) in made(options)? {
            let scene = measure(name, &Opened::made(setup, options)?, options, &mut report, log)?;
            report.adaptive.push(scene);
        }
    }
    for file in scene_files(&options.scenes, &mut failures) {
        let name = file.display().to_string();
        let measured = Opened::new(&file, options, Some(1))
            .and_then(|opened| measure(&name, &opened, options, &mut report, log));
        match measured {
            Ok(scene) => report.adaptive.push(scene),
            Err(error) => failures.push(Failure::new(&file, &error)),
        }
    }
    report.tables = tables(&report.adaptive);
    report.plots = report.adaptive.iter().flat_map(plots).collect();
    report.goals = report.adaptive.iter().filter_map(goal).collect();
    report.results = Some(SceneResults { scenes: Vec::new(), failures });
    Ok(report)
}

/// The scenes that the benchmark makes.
fn made(options: &BenchOptions) -> Result<[(&'static str, Setup); 2], BenchError> {
    let (triangles, lights) = if options.quick { (2_000, 10) } else { (PAPER_TRIANGLES, PAPER_LIGHTS) };
    let (bays, lamps) = if options.quick { (1, 4) } else { HALL };
    Ok([("forest", forest(triangles, lights)?), ("hall", interior(bays, lamps)?)])
}
