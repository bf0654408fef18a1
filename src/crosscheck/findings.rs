//! What became of rays: classes, counts, and disagreements that nothing explains.

use std::fmt;

use serde::Serialize;

use super::judge::Truth;
use super::queries::{Answer, Query};
use super::ray_text::to_text;
use crate::scene::{Hit, Ray};

/// Unexplained disagreements that are kept, of each block and in all.
pub const KEPT: usize = 20;

/// What became of a ray, the worse the later.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Class {
    /// All answers are those of the reference.
    #[default]
    Agree,
    /// Another triangle at the same distance, within the error bound.
    Tie,
    /// The ray passes an edge, an end of its interval, the rim of an alpha mask or the plane of a triangle within the
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

    pub(super) fn merge(&mut self, other: &Self) {
        self.agree += other.agree;
        self.tie += other.tie;
        self.graze += other.graze;
        self.in_plane += other.in_plane;
        self.unexplained += other.unexplained;
    }
}

/// What came of some rays.
#[derive(Clone, Debug, Default)]
pub struct Checked {
    /// How many rays there were.
    pub rays: u64,
    /// Rays judged without a disagreement.
    pub audited: u64,
    /// Largest difference of distances over what the bound allows, among hits of one triangle that were judged.
    pub worst: f64,
    /// Counts by subject.
    pub counts: Vec<Counts>,
    /// The first disagreements that nothing explains.
    pub unexplained: Vec<Unexplained>,
}

/// A disagreement that nothing explains, with what it takes to repeat it.
#[derive(Clone, Debug)]
pub struct Unexplained {
    /// Whose answer is wrong.
    pub backend: String,
    /// The query that the answer belongs to.
    pub query: Query,
    /// The answer; `None` where a lane answered that was switched off.
    pub answer: Option<Answer>,
    /// The answer of the reference.
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

/// An answer in words.
pub(super) fn describe(answer: &Answer) -> String {
    match answer {
        Answer::Closest(None) => "nothing".to_owned(),
        Answer::Closest(Some(hit)) => {
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
        writeln!(f, "  reference: {}; truth: {}", describe(&Answer::Closest(self.reference)), self.truth)?;
        writeln!(f, "  --replay={}", to_text(&self.ray))?;
        if self.packet.len() > 1 {
            writeln!(f, "  lane {} of the packet", self.lane)?;
            self.packet.iter().try_for_each(|ray| writeln!(f, "    {}", to_text(ray)))?;
        }
        Ok(())
    }
}
