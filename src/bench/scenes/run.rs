//! All scenes, one after the other.

use super::find::scene_files;
use super::measure::measure;
use super::result::{Failure, SceneResults};
use super::show::{bars, tables};
use crate::bench::report::Report;
use crate::bench::setup::new_report;
use crate::bench::{BenchError, BenchOptions};

/// Measures the scenes of [`BenchOptions::scenes`], one after the other. One that can't be measured is reported, and
/// takes nothing from the others.
pub fn run(options: &BenchOptions, log: &dyn Fn(&str)) -> Result<Report, BenchError> {
    let mut report = new_report("scenes", options.backend.to_string(), options);
    let mut results = SceneResults::default();
    let files = scene_files(&options.scenes, &mut results.failures);
    for (index, file) in files.iter().enumerate() {
        log(&format!("{} ({} of {})", file.display(), index + 1, files.len()));
        match measure(file, options, &mut report) {
            Ok(result) => results.scenes.push(result),
            Err(error) => {
                let failure = Failure::new(file, &error);
                log(&format!("failed: {}", failure.error));
                results.failures.push(failure);
            }
        }
    }
    if let Some(first) = results.scenes.first() {
        report.backend.clone_from(&first.backend);
        report.tables = tables(&results.scenes);
        report.bars = bars(&results.scenes);
    }
    report.results = Some(results);
    Ok(report)
}
