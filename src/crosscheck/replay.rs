//! Single rays once more, with every answer in words.

use std::fmt;

use super::check::check_rays;
use super::findings::{Checked, describe};
use super::judge::{Candidate, Judge};
use super::queries::{GROUP, Query, Subject};
use super::ray_text::to_text;
use crate::scene::{Ray, Scene};

/// Candidates that are listed.
const LISTED: usize = 16;

/// What all backends and the judge report about some rays.
pub struct Replay {
    rays: Vec<ReplayedRay>,
    checked: Checked,
}

struct ReplayedRay {
    ray: Ray,
    /// Backend, query, answer.
    answers: Vec<(String, Query, String)>,
    truth: String,
    candidates: Vec<Candidate>,
}

/// Traces the rays, which follow each other in packets as they were given.
pub fn replay(scene: &Scene, subjects: &[Subject], rays: &[Ray]) -> Replay {
    let judge = Judge::new(scene);
    let mut replayed: Vec<_> = rays
        .iter()
        .map(|ray| {
            let mut candidates = Vec::new();
            judge.each_candidate(ray, |candidate| {
                candidates.push(*candidate);
                f64::INFINITY
            });
            candidates.sort_by(|a, b| a.t.total_cmp(&b.t));
            candidates.truncate(LISTED);
            let truth = judge.truth(ray).to_string();
            ReplayedRay { ray: *ray, answers: Vec::new(), truth, candidates }
        })
        .collect();
    for subject in subjects {
        for query in Query::all() {
            let groups = rays.chunks(GROUP).zip(replayed.chunks_mut(GROUP)).enumerate();
            for (number, (rays, replayed)) in groups {
                let answers = subject.accel.trace(query, number, rays).answers;
                for (replayed, answer) in replayed.iter_mut().zip(&answers) {
                    replayed.answers.push((subject.name.to_owned(), query, describe(answer)));
                }
            }
        }
    }
    Replay { rays: replayed, checked: check_rays(&judge, subjects, rays) }
}

impl Replay {
    /// Whether every disagreement has an explanation.
    pub fn is_clean(&self) -> bool {
        self.checked.counts.iter().all(|counts| counts.unexplained == 0)
    }
}

impl fmt::Display for Replay {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for ReplayedRay { ray, answers, truth, candidates } in &self.rays {
            writeln!(f, "ray {}", to_text(ray))?;
            for (backend, query, answer) in answers {
                writeln!(f, "  {backend}, {query}: {answer}")?;
            }
            writeln!(f, "  truth: {truth}")?;
            for Candidate { instance, triangle, t, error, certain, in_plane } in candidates {
                let certain = match (certain, in_plane) {
                    (true, _) => "certain",
                    (_, false) => "in doubt",
                    (_, true) => "in its plane",
                };
                writeln!(
                    f,
                    "    triangle {triangle} of instance {instance} at t = {t:e} ± {error:.1e}, {certain}"
                )?;
            }
        }
        self.checked.unexplained.iter().try_for_each(|one| write!(f, "{one}"))
    }
}
