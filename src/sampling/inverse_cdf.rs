//! Positions by a density.

/// Steps of the table.
const STEPS: usize = 1024;

/// The inverse of the cumulative distribution of a density on an interval around 0, as a table.
pub struct InverseCdf {
    half_width: f32,
    /// The share of the density below the end of each step.
    below: Vec<f32>,
}

impl InverseCdf {
    /// Of a density from −`half_width` to `half_width` that is symmetric, positive inside, and need not integrate to 1.
    pub fn new(half_width: f32, density: impl Fn(f32) -> f32) -> Self {
        let middle = |step: usize| half_width * ((2 * step + 1) as f32 / STEPS as f32 - 1.0);
        let mut sum = 0.0f64;
        let mut sums = Vec::with_capacity(STEPS);
        for step in 0..STEPS {
            sum += f64::from(density(middle(step)));
            sums.push(sum);
        }
        Self { half_width, below: sums.iter().map(|below| (below / sum) as f32).collect() }
    }

    /// Where a share `u` of [0, 1] of the density lies below.
    pub fn at(&self, u: f32) -> f32 {
        // The density is symmetric; its middle is exactly 0.
        if u == 0.5 {
            return 0.0;
        }
        if u > 0.5 {
            return -self.at(1.0 - u);
        }
        let step = self.below.partition_point(|below| *below <= u);
        let start = step.checked_sub(1).map_or(0.0, |before| self.below[before]);
        let inside = self.below.get(step).map_or(0.0, |end| (u - start) / (end - start));
        self.half_width * (2.0 * (step as f32 + inside) / STEPS as f32 - 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of the density 1 − |x| on [−1, 1] a share of x²/2 lies below x − 1.
    #[test]
    fn shares_of_a_tent_lie_where_they_should() {
        let tent = InverseCdf::new(1.0, |x| 1.0 - x.abs());
        for x in [0.1f32, 0.3, 0.5, 0.9, 1.0] {
            assert!((tent.at(0.5 * x * x) - (x - 1.0)).abs() < 1e-3, "{}", tent.at(0.5 * x * x));
            assert!((tent.at(1.0 - 0.5 * x * x) - (1.0 - x)).abs() < 1e-3);
        }
        assert_eq!((tent.at(0.0), tent.at(1.0)), (-1.0, 1.0));
    }
}
