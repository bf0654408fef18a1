//! Two threads against one.

use super::BenchError;
use super::BenchOptions;
use super::configuration::{Configuration, conventional};
use super::report::{Aim, Goal, Report, Table};
use super::setup::{Frame, Setup};
use super::timing::Samples;
use crate::accel::Backend;

/// Stages below this share of the frame are too short to count.
const SHARE: f64 = 0.05;
/// What two threads are to reach.
const GOAL: f64 = 1.8;

/// Name and time of a stage.
type Stage = (&'static str, fn(&Frame) -> f64);

const STAGES: [Stage; 3] = [
    ("paths", |frame| frame.stats.seconds.paths),
    ("mesh", |frame| frame.stats.seconds.mesh),
    ("shade", |frame| frame.stats.seconds.shade),
];

/// Times frames on one thread and on two, stage by stage.
pub fn measure(
    setup: &Setup,
    backend: &Backend,
    configuration: &Configuration,
    side: u32,
    options: &BenchOptions,
    report: &mut Report,
) -> Result<(), BenchError> {
    let pools = [1, 2].map(|threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build());
    let [one, two] = pools;
    let pools = [one?, two?];
    let mut table =
        Table::new(format!("Threads, {side}×{side}"), &["stage", "1 thread", "2 threads", "times faster"]);
    for (name, settings) in [
        ("light-mesh", configuration.settings(&setup.settings, (side, side))),
        ("conventional", conventional(&setup.settings, (side, side))),
    ] {
        let frames = options
            .budget()
            .alternate(2, |variant| pools[variant].install(|| setup.frame(backend, &settings)))?;
        let total = Samples(frames[1].iter().map(|frame| frame.seconds).collect()).median();
        for (stage, seconds) in STAGES {
            let mut medians = [0.0; 2];
            for ((median, frames), threads) in medians.iter_mut().zip(&frames).zip(["1 thread", "2 threads"])
            {
                let times = frames.iter().map(seconds).collect();
                *median = report.record(format!("threads: {name}: {stage}: {threads}"), times);
            }
            let [one, two] = medians;
            table.rows.push(vec![
                format!("{name}: {stage}"),
                format!("{one:.4}"),
                format!("{two:.4}"),
                format!("{:.2}", one / two),
            ]);
            if two > SHARE * total {
                let name = format!("two threads over one, {name}, {stage}");
                report.goals.push(Goal::new(name, one / two, Aim::AtLeast, GOAL));
            }
        }
    }
    report.tables.push(table);
    Ok(())
}
