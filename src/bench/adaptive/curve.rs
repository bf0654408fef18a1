//! Error over cost, read between the meshes that were measured.

/// The error of the program's own choice, at which meshes are compared.
pub const USUAL: f64 = crate::settings::Limits::USUAL_ERROR as f64;

/// Meshes of one kind by their error, the smallest first; all numbers are above 0.
#[derive(Clone, Debug, Default)]
pub struct Curve {
    /// Errors and costs.
    points: Vec<(f64, f64)>,
}

impl Curve {
    /// From errors and costs; a mesh that makes no error, or takes no ray, has no place in a logarithmic diagram and is left out.
    pub fn new(points: impl Iterator<Item = (f64, f64)>) -> Self {
        let drawable =
            |&(error, cost): &(f64, f64)| error.is_finite() && cost.is_finite() && error > 0.0 && cost > 0.0;
        let mut points: Vec<(f64, f64)> = points.filter(drawable).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        Self { points }
    }

    /// The cost of an error, by a power of it between two neighbouring meshes; `None` where no mesh is as bad, or none as good: what lies beyond
    /// was not measured.
    pub fn cost(&self, error: f64) -> Option<f64> {
        let pairs = self.points.iter().zip(self.points.iter().skip(1));
        for (&(better, dear), &(worse, cheap)) in pairs {
            if (better..=worse).contains(&error) {
                let range = (worse / better).ln();
                let share = if range > 0.0 { (error / better).ln() / range } else { 0.0 };
                return Some(dear * (cheap / dear).powf(share));
            }
        }
        None
    }

    /// The error nearest to the usual one that both curves reach; `None` if they have none in common.
    pub fn common_error(&self, other: &Self) -> Option<f64> {
        let least = self.points.first()?.0.max(other.points.first()?.0);
        let most = self.points.last()?.0.min(other.points.last()?.0);
        (least <= most).then(|| USUAL.clamp(least, most))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// On a power law every point between two others is read exactly, in whatever order they came; outside nothing is made up.
    #[test]
    fn curves_are_read_as_powers() {
        let law = |error: f64| (error, 3.0 * error.powf(-1.5));
        let curve = Curve::new([0.2, 0.01, 0.05].map(law).into_iter());
        for error in [0.01, 0.02, 0.05, 0.1, 0.2] {
            assert!((curve.cost(error).unwrap() / law(error).1 - 1.0).abs() < 1e-9, "{error}");
        }
        assert_eq!([0.009, 0.21, f64::NAN].map(|error| curve.cost(error)), [None; 3]);
        assert_eq!(Curve::new([(0.0, 1.0), (f64::NAN, 1.0), (0.1, 0.0)].into_iter()).cost(0.1), None);
    }

    /// Meshes are compared at the usual error where they can be, and else at the nearest one that both have.
    #[test]
    fn curves_are_compared_where_both_are_known() {
        let between = |least: f64, most: f64| Curve::new([(least, 2.0), (most, 1.0)].into_iter());
        let curve = between(0.02, 0.2);
        assert_eq!(curve.common_error(&between(0.01, 0.1)), Some(USUAL));
        assert_eq!(curve.common_error(&between(0.08, 0.4)), Some(0.08));
        assert_eq!(curve.common_error(&between(0.01, 0.03)), Some(0.03));
        assert_eq!(curve.common_error(&between(0.3, 0.4)), None);
        assert_eq!(curve.common_error(&Curve::default()), None);
    }
}
