//! What a benchmark hands back: raw times, goals, tables and plots.

use std::fmt;

use serde::Serialize;

use super::adaptive::AdaptiveScene;
use super::bars::BarPlot;
use super::indirect::IndirectCurve;
use super::machine::Machine;
use super::scenes::SceneResults;
use super::timing::Samples;

/// Everything that one benchmark measured.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Name as on the command line.
    pub benchmark: &'static str,
    /// Version of lightmesh.
    pub version: &'static str,
    /// Where it was measured.
    pub machine: Machine,
    /// Ray-query backend and its version.
    pub backend: String,
    /// Threads.
    pub threads: usize,
    /// Whether sizes were cut down, so that the numbers say nothing about speed.
    pub quick: bool,
    /// Raw times.
    pub measurements: Vec<Measurement>,
    /// What was aimed at, and what was reached.
    pub goals: Vec<Goal>,
    /// Results for people.
    pub tables: Vec<Table>,
    /// Curves for people.
    #[serde(skip)]
    pub plots: Vec<Plot>,
    /// Bars for people.
    #[serde(skip)]
    pub bars: Vec<BarPlot>,
    /// What was found about light from surfaces.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub curves: Vec<IndirectCurve>,
    /// What was found about meshes whose points build on coarser ones.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub adaptive: Vec<AdaptiveScene>,
    /// What was found about given scenes; its fields are the report's own.
    #[serde(flatten)]
    pub results: Option<SceneResults>,
}

/// Repeated times of one thing.
#[derive(Clone, Debug, Serialize)]
pub struct Measurement {
    /// What was timed.
    pub name: String,
    /// Times in seconds, in the order of measurement.
    pub seconds: Samples,
    /// Their median.
    pub median: f64,
    /// The shortest.
    pub min: f64,
    /// The longest.
    pub max: f64,
}

/// Which side of the goal is the good one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Aim {
    /// The value should reach the goal.
    AtLeast,
    /// The value should not exceed it.
    AtMost,
}

/// A number that is aimed at.
#[derive(Clone, Debug, Serialize)]
pub struct Goal {
    /// What is measured.
    pub name: String,
    /// What was reached.
    pub value: f64,
    /// What is aimed at.
    pub goal: f64,
    /// On which side.
    pub aim: Aim,
    /// Whether it was reached.
    pub pass: bool,
}

impl Goal {
    /// Compares a value with its goal.
    pub fn new(name: impl Into<String>, value: f64, aim: Aim, goal: f64) -> Self {
        let pass = match aim {
            Aim::AtLeast => value >= goal,
            Aim::AtMost => value <= goal,
        };
        Self { name: name.into(), value, goal, aim, pass }
    }
}

impl fmt::Display for Goal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sign = match self.aim {
            Aim::AtLeast => "≥",
            Aim::AtMost => "≤",
        };
        let Self { name, value, goal, .. } = self;
        if self.pass {
            write!(f, "PASS   {name}: {value:.3} ({sign} {goal})")
        } else {
            let share = 100.0 * (value / goal - 1.0);
            write!(f, "SHORT  {name}: {value:.3} ({sign} {goal}; off by {share:+.0} %)")
        }
    }
}

/// Rows of text under headings.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Table {
    /// What it shows.
    pub title: String,
    /// Headings.
    pub columns: Vec<String>,
    /// Rows with a cell per heading.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    /// An empty table.
    pub fn new(title: impl Into<String>, columns: &[&str]) -> Self {
        Self {
            title: title.into(),
            columns: columns.iter().map(|&name| name.to_owned()).collect(),
            rows: Vec::new(),
        }
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.title)?;
        let lines = || std::iter::once(&self.columns).chain(&self.rows);
        let width = |column: usize| {
            lines().filter_map(|line| line.get(column)).map(|cell| cell.chars().count()).max()
        };
        for line in lines() {
            for (column, cell) in line.iter().enumerate() {
                let width = width(column).unwrap_or(0);
                // Names to the left, numbers to the right.
                if column == 0 { write!(f, "  {cell:<width$}")? } else { write!(f, "  {cell:>width$}")? }
            }
            writeln!(f)?;
        }
        Ok(())
    }
}

/// Curves over one variable.
#[derive(Clone, Debug)]
pub struct Plot {
    /// What it shows.
    pub title: String,
    /// Horizontal axis with unit.
    pub x: String,
    /// Vertical axis with unit.
    pub y: String,
    /// The curves.
    pub series: Vec<Series>,
}

/// One curve.
#[derive(Clone, Debug)]
pub struct Series {
    /// Its name.
    pub label: String,
    /// Its points, both coordinates > 0: axes are logarithmic.
    pub points: Vec<(f64, f64)>,
}

impl Report {
    /// Records raw times; returns their median.
    pub fn record(&mut self, name: impl Into<String>, seconds: Vec<f64>) -> f64 {
        let seconds = Samples(seconds);
        let (median, min, max) = (seconds.median(), seconds.min(), seconds.max());
        self.measurements.push(Measurement { name: name.into(), seconds, median, min, max });
        median
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { benchmark, version, machine, backend, threads, .. } = self;
        writeln!(f, "lightmesh {version} bench {benchmark}: {backend}, {threads} threads, {machine}")?;
        if self.quick {
            writeln!(f, "quick run: sizes are cut down, the numbers say nothing about speed")?;
        }
        for table in &self.tables {
            writeln!(f, "\n{table}")?;
        }
        for goal in &self.goals {
            writeln!(f, "{goal}")?;
        }
        for failure in self.results.iter().flat_map(|results| &results.failures) {
            writeln!(f, "FAILED {}", failure.error)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reaching a goal exactly is enough on either side, and a missing number never passes.
    #[test]
    fn goals_are_judged_on_their_side() {
        assert!(Goal::new("", 2.0, Aim::AtLeast, 2.0).pass && Goal::new("", 2.0, Aim::AtMost, 2.0).pass);
        assert!(!Goal::new("", 1.9, Aim::AtLeast, 2.0).pass && !Goal::new("", 2.1, Aim::AtMost, 2.0).pass);
        assert!(!Goal::new("", f64::NAN, Aim::AtMost, 2.0).pass);
    }
}
