//! The sum of the bounces, before all of them are computed.

/// The light of a scene bounce by bounce, which ends when a bounce changes no value by more than a tolerance.
///
/// Each bounce soon becomes about the same share of the one before (the power method), so that the rest is a geometric
/// series. Its sum is added ahead of time; bounces that follow mend what is not quite so.
#[derive(Default)]
pub struct Series {
    /// Sum of what the bounce before changed.
    before: Option<f64>,
    /// Its share of the one before that.
    ratio: Option<f64>,
}

/// Ratios of two bounces that differ by no more than this part are one.
const STEADY: f64 = 0.1;

impl Series {
    /// Takes the values after a bounce, given those before it; true if it is the last one. Where at most `remaining` more may follow,
    /// and they would not do to end the series, nothing is added to them.
    pub fn add(&mut self, before: &[f32], after: &mut [f32], remaining: u32, tolerance: f32) -> bool {
        let (mut sum, mut change, mut peak) = (0.0f64, 0.0f32, 0.0f32);
        for (before, after) in before.iter().zip(&*after) {
            sum += f64::from(after - before);
            change = change.max((after - before).abs());
            peak = peak.max(after.abs());
        }
        if change <= tolerance * peak {
            return true;
        }
        let ratio = self.before.map(|before| sum / before).filter(|ratio| (0.0..1.0).contains(ratio));
        let last = std::mem::replace(&mut self.ratio, ratio);
        self.before = Some(sum);
        let (Some(ratio), Some(last)) = (ratio, last) else { return false };
        let ends = f64::from(change) * ratio.powi(remaining as i32) <= f64::from(tolerance * peak);
        if ends && (ratio - last).abs() <= STEADY * last {
            let rest = (ratio / (1.0 - ratio)) as f32;
            for (before, after) in before.iter().zip(after) {
                *after += rest * (*after - before);
            }
            *self = Self::default();
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A lamp's light on three walls that pass it on to each other: what follows from some values.
    fn bounce([a, b, c]: [f32; 3]) -> [f32; 3] {
        [1.0 + 0.4 * a + 0.3 * b + 0.1 * c, 0.3 * a + 0.3 * b + 0.2 * c, 0.1 * a + 0.2 * b + 0.2 * c]
    }

    /// Values and number of bounces, for at most so many.
    fn limit(bounces: u32, tolerance: f32) -> ([f32; 3], u32) {
        let (mut series, mut values) = (Series::default(), bounce([0.0; 3]));
        for number in 1..bounces {
            let mut next = bounce(values);
            let done = series.add(&values, &mut next, bounces - 1 - number, tolerance);
            values = next;
            if done {
                return (values, number);
            }
        }
        (values, bounces)
    }

    /// The sum of all bounces is found, in half as many as it takes until one changes so little.
    #[test]
    fn the_rest_of_the_bounces_is_added() {
        let (mut expected, mut plain) = ([0.0; 3], None);
        for number in 0..200 {
            let next = bounce(expected);
            let small =
                next.iter().zip(expected).all(|(next, value)| (next - value).abs() <= 1e-4 * next.max(1.0));
            plain = plain.or(small.then_some(number));
            expected = next;
        }
        let (values, bounces) = limit(200, 1e-4);
        for (value, expected) in values.iter().zip(expected) {
            assert!((value - expected).abs() < 1e-3 * expected, "{values:?} for {expected:?}");
        }
        let plain = plain.expect("the series converges");
        assert!(2 * bounces <= plain, "{bounces} bounces instead of {plain}");
    }

    /// A few bounces are just these.
    #[test]
    fn a_few_bounces_are_no_more() {
        let mut expected = bounce([0.0; 3]);
        for _ in 1..4 {
            expected = bounce(expected);
        }
        assert_eq!(limit(4, 1e-4), (expected, 4));
    }
}
