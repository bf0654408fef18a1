//! The measured scenes in tables and plots.

use super::result::SceneResult;
use crate::bench::bars::{Bar, BarPlot, Scale};
use crate::bench::report::Table;
use crate::render::{RayCounters, StageSeconds};
use crate::settings::{Integrator, Named};

/// A number that may be undefined.
fn optional(value: Option<f64>, text: impl Fn(f64) -> String) -> String {
    value.map_or_else(|| "–".to_owned(), text)
}

fn name_of(integrator: Option<Integrator>) -> String {
    integrator.map_or("–", Named::name).to_owned()
}

/// Names of the three ways, as in the scene file.
const WAYS: [Integrator; 3] = [Integrator::LightMesh, Integrator::Conventional, Integrator::Auto];

/// What was found, seconds by stage, and rays by kind.
pub fn tables(scenes: &[SceneResult]) -> Vec<Table> {
    let right = scenes.iter().filter(|scene| scene.auto_right).count();
    let title = format!(
        "Seconds by light mesh and by conventional tracing; auto was right in {right} of {} scenes (* with indirect \
         light, which conventional tracing leaves out)",
        scenes.len()
    );
    let mut overview = Table::new(
        title,
        &[
            "scene",
            "lights",
            "triangles",
            "size",
            "rounds",
            "light mesh",
            "conventional",
            "ratio",
            "FLIP",
            "block error %",
            "cheaper",
            "auto takes",
            "right",
            "auto",
        ],
    );
    let mut stages =
        Table::new("Seconds by stage", &["scene", "integrator", "paths", "mesh", "shade", "frame"]);
    let mut rays = Table::new(
        "Rays by kind",
        &["scene", "integrator", "camera", "reflection", "shadow", "indirect", "inside"],
    );
    for scene in scenes {
        let mark = if scene.indirect_light { " *" } else { "" };
        let [width, height] = scene.resolution;
        overview.rows.push(vec![
            format!("{}{mark}", scene.name),
            scene.lights.to_string(),
            scene.triangles.to_string(),
            format!("{width}×{height}, {} spp", scene.samples_per_pixel),
            scene.rounds.to_string(),
            format!("{:.4}", scene.seconds),
            format!("{:.4}", scene.conventional_seconds),
            format!("{:.2}", scene.ratio),
            optional(scene.flip, |value| format!("{value:.4}")),
            optional(scene.block_mean_relative_error, |value| format!("{:.2}", 100.0 * value)),
            scene.cheaper.to_string(),
            name_of(scene.chosen),
            if scene.auto_right { "yes" } else { "NO" }.to_owned(),
            format!("{:.4}", scene.auto_seconds),
        ]);
        let ways = [
            (&scene.stages.light_mesh, &scene.rays.light_mesh, scene.frame_seconds.light_mesh),
            (&scene.stages.conventional, &scene.rays.conventional, scene.frame_seconds.conventional),
            (&scene.stages.auto, &scene.rays.auto, scene.frame_seconds.auto),
        ];
        for (way, (seconds, counters, frame)) in WAYS.iter().zip(ways) {
            let row = |cells: Vec<String>| [vec![scene.name.clone(), way.to_string()], cells].concat();
            let StageSeconds { paths, mesh, shade, .. } = *seconds;
            stages.rows.push(row([paths, mesh, shade, frame].map(|value| format!("{value:.4}")).to_vec()));
            let RayCounters { camera, reflection, shadow, indirect, inside } = *counters;
            let counts = [camera, reflection, shadow, indirect, inside];
            rays.rows.push(row(counts.map(|count| count.to_string()).to_vec()));
        }
    }
    vec![overview, stages, rays]
}

/// How many times faster the light mesh is, and where the time goes by both ways.
pub fn bars(scenes: &[SceneResult]) -> Vec<BarPlot> {
    let ratios = scenes.iter().map(|scene| Bar {
        label: scene.name.clone(),
        parts: vec![scene.ratio],
        text: format!("{:.2}", scene.ratio),
    });
    let stages = scenes.iter().flat_map(|scene| {
        let slower = scene.seconds.max(scene.conventional_seconds);
        [
            (format!("{}, light mesh", scene.name), &scene.stages.light_mesh, scene.seconds),
            ("conventional".to_owned(), &scene.stages.conventional, scene.conventional_seconds),
        ]
        .map(|(label, stages, seconds)| Bar {
            label,
            parts: [stages.paths, stages.mesh, stages.shade].map(|stage| stage / slower).to_vec(),
            text: format!("{seconds:.4} s"),
        })
    });
    vec![
        BarPlot {
            title: "Conventional seconds over light-mesh seconds (logarithmic; left of the line the light mesh is dearer)"
                .to_owned(),
            series: vec!["ratio".to_owned()],
            scale: Scale::Ratio,
            bars: ratios.collect(),
        },
        BarPlot {
            title: "Seconds by stage, as shares of the slower way's".to_owned(),
            series: ["paths", "mesh", "shade"].map(str::to_owned).to_vec(),
            scale: Scale::Share,
            bars: stages.collect(),
        },
    ]
}
