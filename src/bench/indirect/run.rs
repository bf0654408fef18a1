//! All scenes, one after the other.

use std::path::Path;

use super::result::{IndirectCurve, IndirectPoint};
use crate::bench::opened::Opened;
use crate::bench::report::{Plot, Report, Series, Table};
use crate::bench::scenes::{Failure, SceneResults, scene_files};
use crate::bench::setup::new_report;
use crate::bench::{BenchError, BenchOptions};
use crate::image::Image;
use crate::image::metrics::{MetricsOptions, compare};
use crate::image::tone::auto_exposure;
use crate::render::{RenderStats, StageSeconds};
use crate::settings::{IndirectForm, IndirectSettings, Settings};

/// Numbers of directions, the default among them, and that of the reference.
const DIRECTIONS: ([u32; 4], u32) = ([16, 64, 256, 1024], 4096);
/// The same for quick runs.
const FEW_DIRECTIONS: ([u32; 4], u32) = ([2, 4, 8, 16], 32);

/// Measures the scenes of [`BenchOptions::scenes`], one after the other. One that can't be measured is reported, and takes nothing from
/// the others.
pub fn run(options: &BenchOptions, log: &dyn Fn(&str)) -> Result<Report, BenchError> {
    let mut report = new_report("indirect", options.backend.to_string(), options);
    let mut failures = Vec::new();
    let files = scene_files(&options.scenes, &mut failures);
    for (index, file) in files.iter().enumerate() {
        log(&format!("{} ({} of {})", file.display(), index + 1, files.len()));
        match measure(file, options, &mut report) {
            Ok(curve) => report.curves.push(curve),
            Err(error) => failures.push(Failure::new(file, &error)),
        }
    }
    report.tables = vec![table(&report.curves)];
    report.plots = vec![plot(&report.curves)];
    report.results = Some(SceneResults { scenes: Vec::new(), failures });
    Ok(report)
}

/// Settings with light from surfaces by so many directions; where a scene has none, all bounces of it are added.
fn with_directions(settings: &Settings, directions: u32) -> Settings {
    let mut settings = settings.clone();
    let bounces = settings.mesh.indirect.as_ref().map(|indirect| indirect.bounces);
    let indirect = settings.mesh.indirect.get_or_insert_with(|| IndirectSettings {
        form: IndirectForm::Surface,
        ..IndirectSettings::default()
    });
    indirect.bounces = bounces.unwrap_or(IndirectSettings::ALL_BOUNCES);
    indirect.directions = directions;
    settings
}

fn measure(file: &Path, options: &BenchOptions, report: &mut Report) -> Result<IndirectCurve, BenchError> {
    let opened = Opened::new(file, options, None)?;
    let name = file.display().to_string();
    let (counts, reference_directions) = if options.quick { FEW_DIRECTIONS } else { DIRECTIONS };
    let base = &opened.setup.settings;
    let frame = |settings: &Settings| opened.setup.frame(&opened.backend, settings);
    let reference = frame(&with_directions(base, reference_directions))?.image;

    let mut direct = base.clone();
    direct.mesh.indirect = None;
    let mut images: [Option<Image>; 4] = Default::default();
    let runs = options.budget().alternate(1 + counts.len(), |variant| {
        let settings = match variant.checked_sub(1).map(|variant| counts[variant]) {
            Some(directions) => with_directions(base, directions),
            None => direct.clone(),
        };
        let frame = frame(&settings)?;
        if let Some(image) = variant.checked_sub(1).and_then(|variant| images.get_mut(variant)) {
            *image = Some(frame.image);
        }
        Ok::<_, BenchError>(frame.stats)
    })?;
    let mut record = |what: &str, runs: &[RenderStats]| {
        let seconds = runs.iter().map(|stats| total(&stats.seconds)).collect();
        report.record(format!("{name}: {what}"), seconds)
    };
    let direct_seconds = record("direct light alone", &runs[0]);
    let exposure = if opened.bare { auto_exposure(reference.pixels()) } else { base.output.exposure };
    let options = MetricsOptions { exposure, threshold: None };
    let mut points = Vec::new();
    for ((&directions, runs), image) in counts.iter().zip(&runs[1..]).zip(&images) {
        let seconds = record(&format!("{directions} directions"), runs);
        // Images of one size can be compared.
        let metrics = image.as_ref().and_then(|image| compare(image, &reference, options).ok());
        let stats = &runs[0];
        points.push(IndirectPoint {
            directions,
            seconds,
            stages: stats.seconds,
            rays: stats.rays,
            evaluated: stats.mesh_points.indirect.evaluated,
            flip: metrics.as_ref().and_then(|metrics| metrics.flip),
            block_mean_relative_error: metrics.and_then(|metrics| metrics.block_mean_relative_error),
        });
    }
    let (width, height) = base.view.resolution;
    report.backend = opened.backend.to_string();
    Ok(IndirectCurve {
        name,
        lights: opened.setup.scene.lights.len(),
        triangles: opened.setup.scene.triangle_count(),
        resolution: [width, height],
        reference_directions,
        direct_seconds,
        points,
    })
}

fn total(StageSeconds { paths, mesh, shade, .. }: &StageSeconds) -> f64 {
    paths + mesh + shade
}

fn table(curves: &[IndirectCurve]) -> Table {
    let mut table = Table::new(
        "Light from surfaces by number of directions: seconds of paths, mesh and shade, by stage, millions of rays, and the error against many \
         directions",
        &[
            "scene",
            "size",
            "direct alone",
            "directions",
            "seconds",
            "paths",
            "mesh",
            "shade",
            "gathering",
            "shadow",
            "points",
            "FLIP",
            "block error %",
        ],
    );
    for curve in curves {
        for point in &curve.points {
            let StageSeconds { paths, mesh, shade, .. } = point.stages;
            let seconds = [point.seconds, paths, mesh, shade].map(|seconds| format!("{seconds:.3}"));
            let rays = [point.rays.indirect, point.rays.shadow];
            let rays = rays.map(|count| format!("{:.2}", count as f64 / 1e6));
            let error = |value: Option<f64>, scale: f64| {
                value.map_or_else(|| "–".to_owned(), |value| format!("{:.4}", scale * value))
            };
            let [width, height] = curve.resolution;
            let mut row = vec![
                curve.name.clone(),
                format!("{width}×{height}"),
                format!("{:.3}", curve.direct_seconds),
                point.directions.to_string(),
            ];
            row.extend(seconds);
            row.extend(rays);
            row.push(point.evaluated.to_string());
            row.push(error(point.flip, 1.0));
            row.push(error(point.block_mean_relative_error, 100.0));
            table.rows.push(row);
        }
    }
    table
}

fn plot(curves: &[IndirectCurve]) -> Plot {
    let series = curves.iter().map(|curve| Series {
        label: curve.name.clone(),
        points: curve
            .points
            .iter()
            .filter_map(|point| point.flip.filter(|&flip| flip > 0.0).map(|flip| (point.seconds, flip)))
            .collect(),
    });
    Plot {
        title: "Error over time, by number of directions".to_owned(),
        x: "seconds of paths, mesh and shade".to_owned(),
        y: "FLIP against many directions".to_owned(),
        series: series.collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a scene file says about its indirect light stays; where it has none, surfaces send each other all of it.
    #[test]
    fn the_form_of_a_scene_is_measured() {
        let mut own = Settings::default();
        own.derive_indirect().bounces = 3;
        let form = own.mesh.indirect.as_ref().map(|indirect| indirect.form);
        let indirect = |settings: &Settings| with_directions(settings, 64).mesh.indirect.unwrap_or_default();
        assert_eq!(
            (indirect(&own).bounces, Some(indirect(&own).form), indirect(&own).directions),
            (3, form, 64)
        );
        let added = indirect(&Settings::default());
        assert_eq!((added.form, added.bounces), (IndirectForm::Surface, IndirectSettings::ALL_BOUNCES));
    }
}
