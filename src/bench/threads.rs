//! Two threads against one.

use std::hint::black_box;

use rayon::prelude::*;

use super::BenchError;
use super::BenchOptions;
use super::configuration::{Configuration, conventional};
use super::report::{Aim, Goal, Report, Table};
use super::setup::Setup;
use super::timing::{Samples, timed};
use crate::accel::Backend;
use crate::render::StageSeconds;

/// Stages below this share of the frame are too short to count.
const SHARE: f64 = 0.05;
/// What two threads are to reach.
const GOAL: f64 = 1.8;

const THREADS: [&str; 2] = ["1 thread", "2 threads"];

/// One frame, and what the machine gave meanwhile.
struct Run {
    /// Seconds that [`arithmetic`] took just before.
    arithmetic: f64,
    /// Seconds of the whole frame.
    frame: f64,
    stages: StageSeconds,
}

/// Name and time of something that is measured, and whether it is a stage of the frame.
type Part = (&'static str, fn(&Run) -> f64, bool);

/// The arithmetic stands beside the stages because it has no limits but the machine's: processors may share a core, or be
/// lent to others, and that changes from minute to minute.
const PARTS: [Part; 4] = [
    ("arithmetic alone, meanwhile", |run| run.arithmetic, false),
    ("paths", |run| run.stages.paths, true),
    ("mesh", |run| run.stages.mesh, true),
    ("shade", |run| run.stages.shade, true),
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
    (0..64u32).into_par_iter().with_max_len(1).map(part).sum()
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
    let budget = options.budget();
    for (name, settings, budget) in [
        ("light-mesh", configuration.settings(&setup.settings, (side, side)), budget.often()),
        ("conventional", conventional(&setup.settings, (side, side)), budget),
    ] {
        let runs = budget.alternate(2, |variant| {
            pools[variant].install(|| {
                let arithmetic = timed(|| black_box(arithmetic())).0;
                let frame = setup.frame(backend, &settings)?;
                Ok::<_, BenchError>(Run { arithmetic, frame: frame.seconds, stages: frame.stats.seconds })
            })
        })?;
        let total = Samples(runs[1].iter().map(|run| run.frame).collect()).median();
        for (part, seconds, is_stage) in PARTS {
            let mut medians = [0.0; 2];
            for ((median, runs), threads) in medians.iter_mut().zip(&runs).zip(THREADS) {
                let times = runs.iter().map(seconds).collect();
                *median = report.record(format!("threads: {name}: {part}: {threads}"), times);
            }
            let [one, two] = medians;
            table.rows.push(vec![
                format!("{name}: {part}"),
                format!("{one:.4}"),
                format!("{two:.4}"),
                format!("{:.2}", one / two),
            ]);
            if is_stage && two > SHARE * total {
                let name = format!("two threads over one, {name}, {part}");
                report.goals.push(Goal::new(name, one / two, Aim::AtLeast, GOAL));
            }
        }
    }
    report.tables.push(table);
    Ok(())
}
