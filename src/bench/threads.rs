//! Two threads against one.

use std::hint::black_box;

use rayon::prelude::*;

use super::BenchError;
use super::BenchOptions;
use super::configuration::{Configuration, conventional};
use super::report::{Aim, Goal, Report, Table};
use super::setup::{Frame, Setup};
use super::timing::{Budget, Samples, timed};
use crate::accel::Backend;

/// Stages below this share of the frame are too short to count.
const SHARE: f64 = 0.05;
/// What two threads are to reach.
const GOAL: f64 = 1.8;

/// How many times as often as others those measurements are repeated that take a tenth of a second.
const SHORT: usize = 5;

const THREADS: [&str; 2] = ["1 thread", "2 threads"];

/// Name and time of a stage.
type Stage = (&'static str, fn(&Frame) -> f64);

const STAGES: [Stage; 3] = [
    ("paths", |frame| frame.stats.seconds.paths),
    ("mesh", |frame| frame.stats.seconds.mesh),
    ("shade", |frame| frame.stats.seconds.shade),
];

/// Work without memory, in 64 equal parts.
fn arithmetic() -> f64 {
    let part = |seed: u32| {
        let mut sums = [f64::from(seed); 8];
        for i in 0..400_000 {
            for sum in &mut sums {
                *sum = *sum * 0.999_999 + f64::from(i & 7);
            }
        }
        sums.iter().sum::<f64>()
    };
    (0..64u32).into_par_iter().map(part).sum()
}

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
    // What the machine gives at best: processors may share a core, or be lent to others.
    let budget = options.budget();
    let often = Budget { repetitions: SHORT * budget.repetitions, ..budget };
    let times = often.alternate(2, |variant| {
        Ok::<_, BenchError>(pools[variant].install(|| timed(|| black_box(arithmetic())).0))
    })?;
    let [one, two] = [0, 1].map(|variant| {
        report.record(format!("threads: arithmetic alone: {}", THREADS[variant]), times[variant].clone())
    });
    table.rows.push(vec![
        "arithmetic alone, what this machine gives".to_owned(),
        format!("{one:.4}"),
        format!("{two:.4}"),
        format!("{:.2}", one / two),
    ]);

    for (name, settings, budget) in [
        ("light-mesh", configuration.settings(&setup.settings, (side, side)), often),
        ("conventional", conventional(&setup.settings, (side, side)), budget),
    ] {
        let frames =
            budget.alternate(2, |variant| pools[variant].install(|| setup.frame(backend, &settings)))?;
        let total = Samples(frames[1].iter().map(|frame| frame.seconds).collect()).median();
        for (stage, seconds) in STAGES {
            let mut medians = [0.0; 2];
            for ((median, frames), threads) in medians.iter_mut().zip(&frames).zip(THREADS) {
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
