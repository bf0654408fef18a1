//! Repeated measurements.

use std::time::{Duration, Instant};

use serde::Serialize;

/// Raw times of one thing, seconds, in the order of measurement.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Samples(pub Vec<f64>);

impl Samples {
    /// Middle value; of an even number of them the mean of the two in the middle. NaN if there are none.
    pub fn median(&self) -> f64 {
        let mut sorted = self.0.clone();
        sorted.sort_by(f64::total_cmp);
        let middle = sorted.len() / 2;
        match sorted.get(middle) {
            None => f64::NAN,
            Some(&upper) if sorted.len() % 2 == 1 => upper,
            Some(&upper) => (sorted[middle - 1] + upper) / 2.0,
        }
    }

    /// Smallest value.
    pub fn min(&self) -> f64 {
        self.0.iter().copied().fold(f64::NAN, f64::min)
    }

    /// Largest value.
    pub fn max(&self) -> f64 {
        self.0.iter().copied().fold(f64::NAN, f64::max)
    }
}

/// How often to measure.
#[derive(Clone, Copy, Debug)]
pub struct Budget {
    /// Rounds, at least 1.
    pub repetitions: usize,
    /// No round starts after this time, except for the first.
    pub limit: Option<Duration>,
}

/// How many times as often those things are measured that take a tenth of a second.
const OFTEN: usize = 5;

impl Budget {
    /// More rounds, for what is short: its times scatter more.
    pub fn often(self) -> Self {
        Self { repetitions: OFTEN * self.repetitions, ..self }
    }

    /// Runs all variants in turn, round after round, so that a machine that gets slower or busier meets all of them
    /// alike. `run(variant)` gives what one run measured; the result lists them per variant.
    ///
    /// # Errors
    /// The first error of `run`.
    pub fn alternate<T, E>(
        self,
        variants: usize,
        mut run: impl FnMut(usize) -> Result<T, E>,
    ) -> Result<Vec<Vec<T>>, E> {
        let start = Instant::now();
        let mut results: Vec<Vec<T>> = (0..variants).map(|_| Vec::new()).collect();
        for round in 0..self.repetitions {
            if round > 0 && self.limit.is_some_and(|limit| start.elapsed() >= limit) {
                break;
            }
            for (variant, result) in results.iter_mut().enumerate() {
                result.push(run(variant)?);
            }
        }
        Ok(results)
    }
}

/// Seconds that `work` takes, and its result.
pub fn timed<T>(work: impl FnOnce() -> T) -> (f64, T) {
    let start = Instant::now();
    let result = work();
    (start.elapsed().as_secs_f64(), result)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_the_middle_value_or_the_mean_of_two() {
        assert_eq!(Samples(vec![3.0, 1.0, 2.0]).median(), 2.0);
        assert_eq!(Samples(vec![4.0, 1.0, 2.0, 3.0]).median(), 2.5);
        assert!(Samples::default().median().is_nan());
    }

    /// Each round runs every variant once, in order; a time limit ends only whole rounds.
    #[test]
    fn variants_alternate() {
        let mut order = Vec::new();
        let budget = Budget { repetitions: 2, limit: None };
        let results = budget.alternate(3, |variant| {
            order.push(variant);
            Ok::<_, ()>(variant)
        });
        assert_eq!(results, Ok(vec![vec![0, 0], vec![1, 1], vec![2, 2]]));
        assert_eq!(order, [0, 1, 2, 0, 1, 2]);
        let once = Budget { repetitions: 5, limit: Some(Duration::ZERO) };
        assert_eq!(once.alternate(2, Ok::<_, ()>), Ok(vec![vec![0], vec![1]]));
    }
}
