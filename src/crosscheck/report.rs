//! What a cross-check hands back.

use std::fmt;

use serde::Serialize;

use super::judge::Truth;
use super::kinds::Kind;
use super::queries::{Answer, Query};
use super::ray_text::to_text;
use super::{Checked, KEPT, Options};
use crate::scene::{Hit, Ray};

/// What became of a ray, the worse the later.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Class {
    /// All answers are those of the reference.
    #[default]
    Agree,
    /// Another triangle at the same distance, within the error bound.
    Tie,
    /// The ray passes an edge, an end of its interval, the rim of a cut-out or the plane of a triangle within the
    /// error bound.
    Graze,
    /// The ray runs in a triangle's plane, within the error bound, and the distance is not one of the triangle.
    InPlane,
    /// Double precision refutes an answer.
    Unexplained,
}

/// Rays by class.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Counts {
    /// [`Class::Agree`].
    pub agree: u64,
    /// [`Class::Tie`].
    pub tie: u64,
    /// [`Class::Graze`].
    pub graze: u64,
    /// [`Class::InPlane`].
    pub in_plane: u64,
    /// [`Class::Unexplained`].
    pub unexplained: u64,
}

impl Counts {
    pub(super) fn add(&mut self, class: Class) {
        *match class {
            Class::Agree => &mut self.agree,
            Class::Tie => &mut self.tie,
            Class::Graze => &mut self.graze,
            Class::InPlane => &mut self.in_plane,
            Class::Unexplained => &mut self.unexplained,
        } += 1;
    }

    fn merge(&mut self, other: &Self) {
        self.agree += other.agree;
        self.tie += other.tie;
        self.graze += other.graze;
        self.in_plane += other.in_plane;
        self.unexplained += other.unexplained;
    }
}

/// The counts of one kind of rays.
#[derive(Clone, Debug, Serialize)]
pub struct KindCounts {
    /// Name of the kind.
    pub kind: &'static str,
    /// Rays of the kind.
    pub rays: u64,
    /// Rays that were judged although all agreed.
    pub audited: u64,
    /// By backend.
    pub counts: Vec<Counts>,
}

/// A disagreement that nothing explains, with what it takes to repeat it.
#[derive(Clone, Debug)]
pub struct Unexplained {
    /// Whose answer is wrong.
    pub backend: String,
    /// To which query.
    pub query: Query,
    /// The answer; `None` where a lane answered that was switched off.
    pub answer: Option<Answer>,
    /// What the reference says.
    pub reference: Option<Hit>,
    /// What is true.
    pub truth: Truth,
    /// The ray.
    pub ray: Ray,
    /// The packet that it was in; the ray alone for single rays.
    pub packet: Vec<Ray>,
    /// Which ray of the packet it was.
    pub lane: usize,
}

/// Result of a cross-check.
#[derive(Clone, Debug)]
pub struct Report {
    /// Names of the backends, the reference first.
    pub backends: Vec<String>,
    /// Rays asked about.
    pub rays: u64,
    /// What the rays followed from.
    pub seed: u64,
    /// By kind.
    pub kinds: Vec<KindCounts>,
    /// Largest difference of distances over what the bound allows.
    pub worst: f64,
    /// The first of the unexplained disagreements.
    pub unexplained: Vec<Unexplained>,
}

impl Report {
    pub(super) fn new(backends: Vec<String>, options: &Options) -> Self {
        let counts = vec![Counts::default(); backends.len()];
        let kinds = Kind::ALL.iter().map(|kind| KindCounts {
            kind: kind.name(),
            rays: 0,
            audited: 0,
            counts: counts.clone(),
        });
        Self {
            backends,
            rays: 0,
            seed: options.seed,
            kinds: kinds.collect(),
            worst: 0.0,
            unexplained: Vec::new(),
        }
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
                "reference": describe(&Answer::Nearest(one.reference)),
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

/// An answer in words.
pub(super) fn describe(answer: &Answer) -> String {
    match answer {
        Answer::Nearest(None) => "nothing".to_owned(),
        Answer::Nearest(Some(hit)) => {
            format!("triangle {} of instance {} at t = {:?}", hit.triangle, hit.instance, hit.t)
        }
        Answer::Occluded(true) => "occluded".to_owned(),
        Answer::Occluded(false) => "free".to_owned(),
    }
}

impl fmt::Display for Truth {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.any_possible, self.certain_before.is_finite()) {
            (false, _) => f.write_str("nothing is hit"),
            (true, false) => f.write_str("something may be hit, within the error bound"),
            (true, true) => write!(f, "something is hit before t = {:e}", self.certain_before),
        }
    }
}

impl fmt::Display for Unexplained {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let answer = self.answer.as_ref().map_or("an inactive lane answered".to_owned(), describe);
        writeln!(f, "unexplained: {}, {}: {answer}", self.backend, self.query)?;
        writeln!(f, "  reference: {}; truth: {}", describe(&Answer::Nearest(self.reference)), self.truth)?;
        writeln!(f, "  --replay={}", to_text(&self.ray))?;
        if self.packet.len() > 1 {
            writeln!(f, "  lane {} of the packet", self.lane)?;
            self.packet.iter().try_for_each(|ray| writeln!(f, "    {}", to_text(ray)))?;
        }
        Ok(())
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
