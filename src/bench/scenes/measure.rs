//! One scene by both ways.

use std::path::Path;

use super::result::{SceneResult, Ways, judge};
use crate::bench::opened::Opened;
use crate::bench::report::Report;
use crate::bench::setup::Setup;
use crate::bench::timing::Samples;
use crate::bench::{BenchError, BenchOptions};
use crate::image::Image;
use crate::image::metrics::{MetricsOptions, compare};
use crate::image::tone::auto_exposure;
use crate::render::{Reason, RenderStats, StageSeconds};
use crate::settings::{IndirectForm, Integrator, Settings};

/// What is kept of a frame.
struct Run {
    stats: RenderStats,
    seconds: f64,
}

/// A frame by one way; light meshes start empty.
fn frame(opened: &Opened, integrator: Integrator) -> Result<(Image, Run), BenchError> {
    let mut settings: Settings = opened.setup.settings.clone();
    settings.shading.integrator = integrator;
    let frame = opened.setup.frame(&opened.backend, &settings)?;
    Ok((frame.image, Run { stats: frame.stats, seconds: frame.seconds }))
}

/// Measures a scene; raw times go to the report.
pub fn measure(file: &Path, options: &BenchOptions, report: &mut Report) -> Result<SceneResult, BenchError> {
    let mut opened = Opened::new(file, options, Some(1))?;
    // Ways to direct light are compared; light from points on surfaces goes with either.
    opened.setup.settings.mesh.indirect.take_if(|indirect| indirect.form == IndirectForm::Surface);
    if opened.setup.scene.lights.is_empty() {
        return Err(BenchError::NoLights);
    }
    let name = file.display().to_string();

    // Pages and caches are warm for both ways. The image is as good as any later one: they are the same to the bit.
    let (image, _) = frame(&opened, Integrator::LightMesh)?;
    let mut reference = None;
    let ways = [Integrator::LightMesh, Integrator::Conventional, Integrator::Auto];
    let runs = options.budget().alternate(ways.len(), |variant| {
        let (rendered, run) = frame(&opened, ways[variant])?;
        if ways[variant] == Integrator::Conventional {
            reference = Some(rendered);
        }
        Ok::<_, BenchError>(run)
    })?;

    let [mesh_runs, conventional_runs, auto_runs] = [&runs[0], &runs[1], &runs[2]];
    let mut record = |way: Integrator, runs: &[Run]| {
        let mut record = |part: &str, seconds: &dyn Fn(&Run) -> f64| {
            report.record(format!("{name}: {way}: {part}"), runs.iter().map(seconds).collect())
        };
        Medians {
            frame: record("frame", &|run| run.seconds),
            stages: record("paths, mesh and shade", &|run| total(&run.stats.seconds)),
        }
    };
    let mesh = record(Integrator::LightMesh, mesh_runs);
    let conventional = record(Integrator::Conventional, conventional_runs);
    let auto = record(Integrator::Auto, auto_runs);

    let Opened { setup: Setup { scene, settings, load_seconds, .. }, backend, build_seconds, bare } = opened;
    let exposure = match &reference {
        Some(reference) if bare => auto_exposure(reference.pixels()),
        _ => settings.output.exposure,
    };
    let metrics = reference.and_then(|reference| {
        // Images of one size can be compared.
        compare(&image, &reference, MetricsOptions { exposure, threshold: None }).ok()
    });
    let (mesh_stats, conventional_stats) = (&mesh_runs[0].stats, &conventional_runs[0].stats);
    let auto_stats = &auto_runs[0].stats;
    let chosen = auto_stats.integrator;
    let (cheaper, is_cheap) = judge(mesh.stages, conventional.stages, chosen);
    // Settings that only a light mesh meets leave no choice.
    let reason = auto_stats.choice.map(|choice| choice.reason);
    let auto_right = is_cheap || reason == Some(Reason::Settings);
    let (width, height) = settings.view.resolution;
    Ok(SceneResult {
        name,
        lights: scene.lights.len(),
        triangles: scene.triangle_count(),
        resolution: [width, height],
        samples_per_pixel: settings.view.samples_per_pixel,
        indirect_light: settings.mesh.indirect.is_some(),
        backend: backend.to_string(),
        load_seconds,
        build_seconds,
        rounds: mesh_runs.len(),
        ratio: conventional.stages / mesh.stages,
        seconds: mesh.stages,
        conventional_seconds: conventional.stages,
        frame_seconds: Ways { light_mesh: mesh.frame, conventional: conventional.frame, auto: auto.frame },
        auto_seconds: auto.frame,
        exposure,
        flip: metrics.as_ref().and_then(|metrics| metrics.flip),
        block_mean_relative_error: metrics.and_then(|metrics| metrics.block_mean_relative_error),
        chosen,
        reason,
        cheaper,
        auto_right,
        stages: Ways {
            light_mesh: stage_medians(mesh_runs),
            conventional: stage_medians(conventional_runs),
            auto: stage_medians(auto_runs),
        },
        rays: Ways {
            light_mesh: mesh_stats.rays,
            conventional: conventional_stats.rays,
            auto: auto_stats.rays,
        },
        mesh_points: mesh_stats.mesh_points,
        light_mesh_bytes: mesh_stats.light_mesh_bytes,
    })
}

/// Medians of the frames by one way.
struct Medians {
    /// Wall-clock seconds.
    frame: f64,
    /// Seconds of all stages.
    stages: f64,
}

fn total(seconds: &StageSeconds) -> f64 {
    seconds.paths + seconds.mesh + seconds.shade
}

fn stage_medians(runs: &[Run]) -> StageSeconds {
    let median = |stage: fn(&StageSeconds) -> f64| {
        Samples(runs.iter().map(|run| stage(&run.stats.seconds)).collect()).median()
    };
    StageSeconds {
        paths: median(|seconds| seconds.paths),
        mesh: median(|seconds| seconds.mesh),
        shade: median(|seconds| seconds.shade),
        check: median(|seconds| seconds.check),
    }
}
