//! Ray tracers that prove each other: the same rays to every backend, in every form of query, and a judge in double
//! precision for what they disagree about.
//!
//! What is checked and how it is judged is written down in docs/crosscheck.md.

mod boxes;
mod check;
mod crossing;
mod findings;
mod judge;
mod kinds;
mod local_ray;
mod placement;
mod queries;
mod ray_text;
mod replay;
mod report;
mod watertight;

use rayon::prelude::*;

use crate::scene::{Camera, Scene};
use kinds::RaySource;
use queries::BLOCK;

pub use findings::{Class, Counts, Unexplained};
pub use judge::Truth;
pub use queries::{Answer, Answers, Query, RayQueries, Subject};
pub use ray_text::{RayTextError, from_text};
pub use replay::{Replay, replay};
pub use report::{KindCounts, Report};
pub use watertight::{Escapes, Watertightness, watertightness};

// Only tests check rays of their own.
#[doc(hidden)]
pub use {check::check_rays, findings::Checked, judge::Judge};

/// How much is checked.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Rays, shared out evenly between the kinds.
    pub rays: u64,
    /// What the rays follow from, with the scene.
    pub seed: u64,
}

/// Traces rays of all kinds with all subjects, in all forms of query, on rayon's threads.
///
/// The first subject's closest hits of single rays are what all answers are compared with. The report depends on
/// scene and options alone. `progress` receives the number of rays of every block that is done.
pub fn crosscheck(
    scene: &Scene,
    cameras: &[Camera],
    subjects: &[Subject],
    options: &Options,
    progress: &(dyn Fn(u64) + Sync),
) -> Report {
    let names = subjects.iter().map(|subject| subject.name.to_owned()).collect();
    let mut report = Report::new(names, options.seed);
    let Some(first) = subjects.first() else { return report };
    let judge = Judge::new(scene);
    let source = RaySource::new(scene, cameras, first.accel, options.seed);
    let blocks: Vec<_> = (0..options.rays.div_ceil(BLOCK))
        .into_par_iter()
        .map(|block| {
            let count = BLOCK.min(options.rays - block * BLOCK);
            let (kind, rays) = source.block(block, count as usize);
            let result = check_rays(&judge, subjects, &rays);
            progress(count);
            (kind, result)
        })
        .collect();
    for (kind, block) in blocks {
        report.add(kind, block);
    }
    report
}
