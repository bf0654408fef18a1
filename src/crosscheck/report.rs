//! What a cross-check hands back.

use std::fmt;

use serde::Serialize;

use super::findings::{Checked, Counts, KEPT, Unexplained, describe};
use super::kinds::Kind;
use super::queries::Answer;
use super::ray_text::to_text;

/// The counts of one kind of rays.
#[derive(Clone, Debug, Serialize)]
pub struct KindCounts {
    /// Name of the kind.
    pub kind: &'static str,
    /// Rays of the kind.
    pub rays: u64,
    /// Rays that were judged although all agreed.
    pub audited: u64,
    /// Counts by backend.
    pub counts: Vec<Counts>,
}

/// Result of a cross-check.
#[derive(Clone, Debug)]
pub struct Report {
    /// Names of the backends, the reference first.
    pub backends: Vec<String>,
    /// Rays that were traced.
    pub rays: u64,
    /// What the rays followed from.
    pub seed: u64,
    /// Counts by kind of ray.
    pub kinds: Vec<KindCounts>,
    /// Largest difference of distances over what the bound allows.
    pub worst: f64,
    /// The first of the unexplained disagreements.
    pub unexplained: Vec<Unexplained>,
}

impl Report {
    pub(super) fn new(backends: Vec<String>, seed: u64) -> Self {
        let counts = vec![Counts::default(); backends.len()];
        let kinds = Kind::ALL.iter().map(|kind| KindCounts {
            kind: kind.name(),
            rays: 0,
            audited: 0,
            counts: counts.clone(),
        });
        Self { backends, rays: 0, seed, kinds: kinds.collect(), worst: 0.0, unexplained: Vec::new() }
    }

    pub(super) fn add(&mut self, kind: Kind, block: Checked) {
        self.rays += block.rays;
        self.worst = self.worst.max(block.worst);
        self.unexplained.extend(block.unexplained);
        self.unexplained.truncate(KEPT);
        let row = &mut self.kinds[kind as usize];
        row.rays += block.rays;
        row.audited += block.audited;
        row.counts.iter_mut().zip(&block.counts).for_each(|(sum, counts)| sum.merge(counts));
    }

    /// Counts of all kinds, by backend.
    pub fn totals(&self) -> Vec<Counts> {
        let mut totals = vec![Counts::default(); self.backends.len()];
        for row in &self.kinds {
            totals.iter_mut().zip(&row.counts).for_each(|(sum, counts)| sum.merge(counts));
        }
        totals
    }

    /// Whether every disagreement has an explanation.
    pub fn is_clean(&self) -> bool {
        self.totals().iter().all(|counts| counts.unexplained == 0)
    }

    /// The report as JSON.
    pub fn to_json(&self) -> serde_json::Value {
        let unexplained = self.unexplained.iter().map(|one| {
            serde_json::json!({
                "backend": one.backend,
                "query": one.query.to_string(),
                "answer": one.answer.map(|answer| describe(&answer)),
                "reference": describe(&Answer::Closest(one.reference)),
                "truth": one.truth.to_string(),
                "ray": to_text(&one.ray),
                "packet": one.packet.iter().map(to_text).collect::<Vec<_>>(),
                "lane": one.lane,
            })
        });
        serde_json::json!({
            "version": env!("CARGO_PKG_VERSION"),
            "backends": self.backends,
            "rays": self.rays,
            "seed": self.seed,
            "kinds": self.kinds,
            "totals": self.totals(),
            "largest_distance_error_over_bound": self.worst,
            "unexplained": unexplained.collect::<Vec<_>>(),
        })
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let line = |f: &mut fmt::Formatter<'_>, backend: &str, kind: &str, rays: u64, counts: &Counts| {
            let Counts { agree, tie, graze, in_plane, unexplained } = counts;
            write!(f, "{backend:<16} {kind:<10} {rays:>10} {agree:>10} {tie:>9} {graze:>9} {in_plane:>8}")?;
            writeln!(f, " {unexplained:>11}")
        };
        write!(f, "{:<16} {:<10} {:>10} {:>10}", "backend", "kind", "rays", "agree")?;
        writeln!(f, " {:>9} {:>9} {:>8} {:>11}", "tie", "graze", "in plane", "unexplained")?;
        for (index, (backend, total)) in self.backends.iter().zip(self.totals()).enumerate() {
            for row in &self.kinds {
                line(f, backend, row.kind, row.rays, &row.counts[index])?;
            }
            line(f, backend, "all", self.rays, &total)?;
        }
        let audited: u64 = self.kinds.iter().map(|row| row.audited).sum();
        writeln!(
            f,
            "{audited} rays that all agree about were judged too; distances differ from the truth by at most {:.2} of \
             the bound",
            self.worst
        )?;
        self.unexplained.iter().try_for_each(|one| write!(f, "{one}"))
    }
}
