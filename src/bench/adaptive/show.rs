//! Tables, plots and goals.

use super::result::{AdaptiveScene, Cost, Gain};
use crate::bench::report::{Aim, Goal, Plot, Series, Table};
use crate::render::Ending;

/// Goal: the shadow rays of a uniform mesh over those of an adaptive one of equal error.
const TIMES_FEWER: f64 = 3.0;

/// A summary of all scenes, and two tables for each.
pub fn tables(scenes: &[AdaptiveScene]) -> Vec<Table> {
    let each = scenes.iter().flat_map(|scene| [given(scene), chosen(scene)]);
    std::iter::once(summary(scenes)).chain(each).collect()
}

/// What is aimed at, by the levels that save most; `None` where no error was reached both ways.
pub fn goal(scene: &AdaptiveScene) -> Option<Goal> {
    let Gain { levels, common_error, ratio, .. } = scene.best_gain()?;
    let (error, ratio) = (percent((*common_error)?), (*ratio)?);
    let name = format!("{}, {}: times fewer shadow rays at an error of {error} %", scene.name, kind(*levels));
    Some(Goal::new(name, ratio, Aim::AtLeast, TIMES_FEWER))
}

/// Error over shadow rays, and over seconds.
pub fn plots(scene: &AdaptiveScene) -> [Plot; 2] {
    let plot = |what: &str, unit: &str, value: fn(&Cost) -> f64| Plot {
        title: format!("{}: error over {what}", scene.name),
        x: unit.to_owned(),
        y: "own error (RMSE / mean)".to_owned(),
        series: series(scene, value),
    };
    [
        plot("shadow rays", "shadow rays per frame", |cost| cost.shadow_rays as f64),
        plot("seconds", "seconds per frame", |cost| cost.seconds),
    ]
}

fn series(scene: &AdaptiveScene, value: fn(&Cost) -> f64) -> Vec<Series> {
    let given = scene.meshes.iter().map(|mesh| (kind(mesh.levels), &mesh.cost, mesh.own_error));
    let chosen = scene
        .chosen
        .iter()
        .map(|mesh| (format!("chosen, {}", kind(mesh.levels)), &mesh.cost, mesh.own_error));
    let mut all: Vec<Series> = Vec::new();
    for (label, cost, error) in given.chain(chosen) {
        let point = (value(cost), error);
        match all.iter_mut().find(|series| series.label == label) {
            Some(series) => series.points.push(point),
            None => all.push(Series { label, points: vec![point] }),
        }
    }
    all
}

fn summary(scenes: &[AdaptiveScene]) -> Table {
    let errors: Vec<f32> = scenes
        .first()
        .and_then(|scene| scene.gains.first())
        .map(|gain| gain.at.iter().map(|&(error, _)| error).collect())
        .unwrap_or_default();
    let mut table = Table::new(
        "Shadow rays of the uniform mesh over those of the adaptive one, at equal error; `there` at the error nearest to 5 % that both reach",
        &["scene", "mesh"],
    );
    table.columns.extend(errors.iter().map(|&error| format!("at {} %", percent(f64::from(error)))));
    table.columns.extend(["error %", "there"].map(str::to_owned));
    for scene in scenes {
        for gain in &scene.gains {
            let mut row = vec![scene.name.clone(), kind(gain.levels)];
            row.extend(gain.at.iter().map(|&(_, ratio)| optional(ratio, times)));
            row.push(optional(gain.common_error, percent));
            row.push(optional(gain.ratio, times));
            table.rows.push(row);
        }
    }
    table
}

fn given(scene: &AdaptiveScene) -> Table {
    let AdaptiveScene { name, lights, triangles, radius, .. } = scene;
    let ([width, height], [columns, rows]) = (scene.resolution, scene.error_resolution);
    let mut table = Table::new(
        format!(
            "{name}: {triangles} triangles, {lights} lights, {width}×{height} pixels, R {radius}; error at {columns}×{rows} of them"
        ),
        &["mesh", "spacing / R", "own error %", "shadow rays", "seconds", "uniform : rays"],
    );
    for mesh in &scene.meshes {
        let ratio = scene.ratio(mesh.own_error, &mesh.cost);
        let mut row = vec![kind(mesh.levels), mesh.spacing.to_string(), percent(mesh.own_error)];
        row.extend(costs(&mesh.cost));
        row.push(optional(ratio.filter(|_| mesh.levels > 0), times));
        table.rows.push(row);
    }
    let mut row = vec!["conventional".to_owned(), none(), none()];
    row.extend(costs(&scene.conventional));
    row.push(none());
    table.rows.push(row);
    table
}

fn chosen(scene: &AdaptiveScene) -> Table {
    let mut table = Table::new(
        format!("{}: meshes chosen by their error, finding them included", scene.name),
        &[
            "mesh",
            "asked %",
            "found %",
            "±",
            "true %",
            "shadow rays",
            "seconds",
            "uniform : rays",
            "ended by",
        ],
    );
    for mesh in &scene.chosen {
        let found = mesh.found.as_ref();
        let mut row = vec![
            kind(mesh.levels),
            percent(f64::from(mesh.asked)),
            optional(found.map(|found| f64::from(found.error)), percent),
            optional(found.map(|found| f64::from(found.confidence)), percent),
            percent(mesh.own_error),
        ];
        row.extend(costs(&mesh.cost));
        row.push(optional(scene.ratio(mesh.own_error, &mesh.cost), times));
        row.push(mesh.ending.map_or_else(none, |ending| ended(ending).to_owned()));
        table.rows.push(row);
    }
    table
}

/// What a mesh is called.
fn kind(levels: u32) -> String {
    match levels {
        0 => "uniform".to_owned(),
        1 => "1 level".to_owned(),
        _ => format!("{levels} levels"),
    }
}

fn ended(ending: Ending) -> &'static str {
    match ending {
        Ending::Error => "error",
        Ending::Settings => "settings",
        Ending::Settled => "mesh of several views",
        Ending::Finest => "finest mesh",
        Ending::Time => "time",
        Ending::Exact => "exact",
        Ending::Memory => "memory",
    }
}

fn costs(cost: &Cost) -> [String; 2] {
    [cost.shadow_rays.to_string(), format!("{:.3}", cost.seconds)]
}

fn none() -> String {
    "–".to_owned()
}

fn optional(value: Option<f64>, show: fn(f64) -> String) -> String {
    value.map_or_else(none, show)
}

fn percent(share: f64) -> String {
    // What was asked for is shown as it was written: it is a single-precision number.
    let percent = (1e4 * share).round() / 1e2;
    percent.to_string()
}

fn times(ratio: f64) -> String {
    format!("{ratio:.2}")
}
