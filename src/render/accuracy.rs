//! How wrong a picture is, as far as parts of it tell that are known better.

use std::fmt;

use serde::{Deserialize, Serialize};

/// How differences of pixels make an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Measure {
    /// Root of the mean squared difference, over the mean of the picture: averaged shadows are wrong a little everywhere.
    Rmse,
    /// Mean absolute difference over the mean of the picture, the share of the light that is in a wrong place: traced shadows are right but for a
    /// few pixels, and who holds out one in a hundred knows nothing of the squares of the rest.
    Absolute,
}

/// An estimate of the error of a picture's direct light.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ErrorEstimate {
    /// What it is an error of.
    pub measure: Measure,
    /// The error.
    pub error: f32,
    /// Half the width of the interval in which it lies with 95 % confidence.
    pub confidence: f32,
    /// The error of the worst part, over the mean of the picture.
    pub worst: f32,
    /// Number of the parts that were held out.
    pub parts: u32,
    /// Their pixels.
    pub pixels: u64,
    /// Rays that the truth took.
    pub rays: u64,
}

/// What ended a render.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Ending {
    /// The error is within the limit: pixels or blocks all over the picture say so with 95 % confidence, and the brightest pixels don't contradict it with as
    /// much.
    Error,
    /// The settings leave nothing open by which the error could be made smaller.
    Settings,
    /// One mesh was chosen for several views together.
    Settled,
    /// No finer light mesh is tried.
    Finest,
    /// The time is over.
    Time,
    /// Every shadow ray was traced: there is no error but that of pixels' samples.
    Exact,
    /// A finer light mesh would take more memory than it may.
    Memory,
}

/// How wrong a picture is, and why it was left at that.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Accuracy {
    /// The error that was asked for.
    pub asked: f32,
    /// What was found; `None` where nothing was measured.
    pub found: Option<ErrorEstimate>,
    /// What ended the render.
    pub ending: Ending,
    /// About how many shadow rays half the error would take.
    pub rays_for_half: Option<u64>,
}

/// What is known of a part of a picture, summed over its pixels and the three colours.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct PartError {
    /// Differences, squared or absolute.
    pub wrong: f64,
    /// What the picture shows.
    pub shown: f64,
    /// What it should show.
    pub truth: f64,
    /// Pixels times three.
    pub values: f64,
    /// What sums over the part were multiplied by, except for `values`.
    pub weight: f64,
}

impl PartError {
    fn add(&mut self, other: &Self) {
        self.wrong += other.wrong;
        self.shown += other.shown;
        self.truth += other.truth;
        self.values += other.values;
    }

    /// Without another one that is part of it.
    fn without(&self, other: &Self) -> Self {
        Self {
            wrong: self.wrong - other.wrong,
            shown: self.shown - other.shown,
            truth: self.truth - other.truth,
            values: self.values - other.values,
            weight: self.weight,
        }
    }

    /// The part for itself.
    fn unweighted(&self) -> Self {
        Self { wrong: self.wrong / self.weight, ..*self }
    }

    /// What is wrong with a value.
    fn difference(&self, measure: Measure) -> f64 {
        let mean = self.wrong / self.values;
        if measure == Measure::Rmse { mean.max(0.0).sqrt() } else { mean }
    }

    /// What the picture should show on average: the parts alone say, or better the whole picture, and the parts what is wrong with it.
    fn mean(&self, mean_shown: Option<f64>) -> f64 {
        let mean = match mean_shown {
            Some(mean) => mean + (self.truth - self.shown) / self.values,
            None => self.truth / self.values,
        };
        mean.max(f64::MIN_POSITIVE)
    }

    fn error(&self, measure: Measure, mean_shown: Option<f64>) -> f64 {
        let difference = self.difference(measure);
        if difference == 0.0 { 0.0 } else { difference / self.mean(mean_shown) }
    }
}

/// Quantiles of the normal distribution for 95 %, two-sided and one-sided.
const CONFIDENT: f64 = 1.96;
const CONFIDENT_BELOW: f64 = 1.645;

/// Share of a part's light from which on a difference is more than rounding.
const ROUNDING: f64 = 1e-4;

/// Largest mean of a Poisson distribution that gives so few events in one of forty cases: the formula of Wilson and Hilferty (1931).
fn most_expected(events: f64) -> f64 {
    let next = events + 1.0;
    next * (1.0 - 1.0 / (9.0 * next) + CONFIDENT / (3.0 * next.sqrt())).powi(3)
}

impl ErrorEstimate {
    /// From some parts of a picture; `mean_shown` is the mean of the whole, if there is one yet. `None` without parts.
    pub(super) fn of(
        parts: &[PartError],
        measure: Measure,
        mean_shown: Option<f64>,
        rays: u64,
    ) -> Option<Self> {
        if parts.len() < 2 {
            return None;
        }
        let mut all = PartError::default();
        parts.iter().for_each(|part| all.add(part));
        // The jackknife: how much the estimate moves when any one part is left out.
        let count = parts.len() as f64;
        let others = parts.iter().map(|part| all.without(part).error(measure, mean_shown));
        let middle = others.clone().sum::<f64>() / count;
        let squares: f64 = others.map(|other| (other - middle).powi(2)).sum();
        let deviation = (squares * (count - 1.0) / count).sqrt();
        let error = all.error(measure, mean_shown);
        // Of mistakes that are rare the jackknife sees too few: what others as large would add if it met few by chance.
        let rare = match parts.iter().filter(|part| part.wrong > ROUNDING * part.truth).count() as f64 {
            wrong if measure == Measure::Absolute && wrong > 0.0 => {
                error * (most_expected(wrong) / wrong - 1.0)
            }
            _ => 0.0,
        };
        let worst = parts.iter().map(|part| part.unweighted().difference(measure)).fold(0.0, f64::max);
        Some(Self {
            measure,
            error: error as f32,
            confidence: (CONFIDENT * deviation).max(rare) as f32,
            worst: (worst / all.mean(mean_shown)) as f32,
            parts: parts.len() as u32,
            pixels: (all.values / 3.0) as u64,
            rays,
        })
    }

    /// The same, with an interval that reaches at least up to an estimate of another kind where no part is wrong: that says nothing of how much may be
    /// wrong between them.
    pub(super) fn if_nothing_is_found(self, other: Option<f32>) -> Self {
        let other = other.filter(|_| f64::from(self.worst) <= ROUNDING);
        Self { confidence: self.confidence.max(other.unwrap_or(0.0)), ..self }
    }

    /// Whether the error is at most `limit`, with 95 % confidence: what is below the interval's lower end doesn't speak against that.
    pub(super) fn is_within(&self, limit: f32) -> bool {
        f64::from(self.error) + self.one_sided() <= f64::from(limit)
    }

    /// Whether the error is more than `limit`, with 95 % confidence.
    pub(super) fn is_above(&self, limit: f32) -> bool {
        f64::from(self.error) - self.one_sided() > f64::from(limit)
    }

    fn one_sided(&self) -> f64 {
        f64::from(self.confidence) * CONFIDENT_BELOW / CONFIDENT
    }
}

impl fmt::Display for Accuracy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Two digits where they say something, and what was asked for as it was written.
        let percent = |share: f32| {
            let percent = 100.0 * share;
            if percent < 1.0 { format!("{percent:.2}") } else { format!("{percent:.1}") }
        };
        let asked = f64::from((1e6 * self.asked).round()) / 1e4;
        match &self.found {
            Some(found) => {
                let ErrorEstimate { measure, error, confidence, worst, parts, pixels, .. } = *found;
                let (error, confidence, worst) = (percent(error), percent(confidence), percent(worst));
                let name = if measure == Measure::Rmse { "RMSE" } else { "of the light" };
                let place = if u64::from(parts) == pixels { "pixels" } else { "blocks" };
                write!(
                    f,
                    "error {error} % ± {confidence} ({name}; {parts} {place} held out, the worst {worst} %)"
                )?;
            }
            None if self.ending == Ending::Exact => f.write_str("error 0: every shadow ray was traced")?,
            None => f.write_str("error not measured")?,
        }
        match self.ending {
            Ending::Error if self.found.is_some_and(|found| found.error > self.asked) => {
                write!(f, "; the {asked} % asked for are within its interval")?
            }
            Ending::Error => write!(f, "; within the {asked} % asked for")?,
            Ending::Settings => write!(f, "; asked for {asked} %, but the settings leave nothing to choose")?,
            Ending::Settled => {
                write!(f, "; asked for {asked} %, but the light mesh was chosen for several views together")?
            }
            Ending::Finest => write!(f, "; asked for {asked} %, but no finer mesh is tried")?,
            Ending::Time if self.asked == 0.0 => f.write_str("; the time limit ended it")?,
            Ending::Time => write!(f, "; the time limit ended it, {asked} % were asked for")?,
            Ending::Memory if self.asked == 0.0 => f.write_str("; the memory limit ended it")?,
            Ending::Memory => write!(f, "; the memory limit ended it, {asked} % were asked for")?,
            Ending::Exact => {}
        }
        match self.rays_for_half {
            Some(rays) if self.found.is_some() => {
                write!(f, "; half of it would take about {:.1} million shadow rays", rays as f64 / 1e6)
            }
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A hundred parts of one light each, some of which are wrong by half of it.
    fn estimate(wrong: usize) -> ErrorEstimate {
        let part = |number: usize| PartError {
            wrong: if number < wrong { 0.5 } else { 0.0 },
            shown: 1.0,
            truth: 1.0,
            values: 1.0,
            weight: 1.0,
        };
        let parts: Vec<PartError> = (0..100).map(part).collect();
        ErrorEstimate::of(&parts, Measure::Absolute, None, 0).expect("a hundred parts")
    }

    /// Who met one or two mistakes may have been lucky: the interval ends where a Poisson distribution gives so few in one case of forty, by
    /// its table (5.572, 7.225, 18.39 for 1, 2, 10).
    #[test]
    fn rare_mistakes_have_wide_intervals() {
        for (wrong, most) in [(1, 5.572), (2, 7.225), (10, 18.39)] {
            let found = estimate(wrong);
            assert!((found.error - 0.005 * wrong as f32).abs() < 1e-6);
            let end = found.error + found.confidence;
            assert!((end / (0.005 * most) - 1.0).abs() < 0.01, "{wrong}: {end}");
        }
    }

    /// Without a mistake among the parts, nothing is known but what another estimate says; with one, the parts speak.
    #[test]
    fn no_mistake_found_is_not_no_mistake() {
        let nothing = estimate(0);
        assert_eq!((nothing.error, nothing.confidence), (0.0, 0.0));
        assert_eq!(nothing.if_nothing_is_found(Some(0.004)).confidence, 0.004);
        assert!(!nothing.if_nothing_is_found(Some(0.004)).is_within(0.001));
        assert_eq!(estimate(1).if_nothing_is_found(Some(0.5)).confidence, estimate(1).confidence);
    }
}
