//! Values over time: keyframes, and what lies between them.

use std::ops::{Add, Mul, Sub};

use glam::{DQuat, DVec4};

use crate::settings::named_enum;

named_enum! {
    /// How values follow between keyframes.
    #[derive(Default)]
    pub enum Interpolation {
        /// The value of the keyframe before, until the next one
        Step = "step",
        /// Evenly from one to the next; rotations turn evenly about one axis
        #[default]
        Linear = "linear",
        /// Along a Catmull-Rom spline, without a bend at keyframes
        Smooth = "smooth",
    }
}

/// Why keyframes are none.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum CurveError {
    /// There is no keyframe.
    #[error("there are no keyframes")]
    Empty,
    /// A time is not finite.
    #[error("time {0} is not finite")]
    Time(f64),
    /// A time is below that of the keyframe before.
    #[error("times must not fall: {1} follows {0}")]
    Order(f64, f64),
    /// There is another number of values than the times need.
    #[error("{found} values for {times} times, {expected} needed")]
    Count {
        /// Number of times.
        times: usize,
        /// Number of values that they need.
        expected: usize,
        /// Number of values.
        found: usize,
    },
}

/// What keyframes can have values of.
pub trait Value: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<f64, Output = Self> {}

impl<T: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<f64, Output = Self>> Value for T {}

/// What lies between keyframes.
#[derive(Clone, Debug, PartialEq)]
enum Between<V> {
    Step,
    Linear,
    /// A cubic, with the slopes into and out of each keyframe, per second.
    Cubic(Vec<[V; 2]>),
}

/// A value over time; before the first keyframe and after the last one it stands still.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve<V> {
    times: Vec<f64>,
    values: Vec<V>,
    between: Between<V>,
}

/// Where a time lies among keyframes.
enum Place {
    /// At a keyframe, or beyond the first or last one.
    At(usize),
    /// A share of the way from a keyframe to the next, which is so many seconds later.
    Between(usize, f64, f64),
}

impl<V: Value> Curve<V> {
    /// Keyframes at times in seconds.
    ///
    /// # Errors
    /// See [`CurveError`]. Of several keyframes at one time the last one counts from there on.
    pub fn new(times: Vec<f64>, values: Vec<V>, interpolation: Interpolation) -> Result<Self, CurveError> {
        check(&times, 1, values.len())?;
        let between = match interpolation {
            Interpolation::Step => Between::Step,
            Interpolation::Linear => Between::Linear,
            Interpolation::Smooth => Between::Cubic(catmull_rom(&times, &values)),
        };
        Ok(Self { times, values, between })
    }

    /// Keyframes with slopes of their own: three values for each time, the slope into it, the value, and the slope out of it.
    ///
    /// # Errors
    /// See [`CurveError`].
    pub fn cubic(times: Vec<f64>, triples: &[V]) -> Result<Self, CurveError> {
        check(&times, 3, triples.len())?;
        let (triples, _) = triples.as_chunks::<3>();
        let values = triples.iter().map(|[_, value, _]| *value).collect();
        let slopes = triples.iter().map(|[into, _, out]| [*into, *out]).collect();
        Ok(Self { times, values, between: Between::Cubic(slopes) })
    }

    /// The times of the keyframes, seconds.
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    fn place(&self, time: f64) -> Place {
        let after = self.times.partition_point(|&key| key <= time);
        let (Some(&end), Some(begin)) =
            (self.times.get(after), after.checked_sub(1).and_then(|at| self.times.get(at)))
        else {
            return Place::At(after.saturating_sub(1));
        };
        let seconds = end - begin;
        let share = (time - begin) / seconds;
        if share > 0.0 { Place::Between(after - 1, share, seconds) } else { Place::At(after - 1) }
    }

    /// The value at a time in seconds.
    pub fn at(&self, time: f64) -> V {
        match self.place(time) {
            Place::At(key) => self.values[key],
            Place::Between(key, share, seconds) => {
                let (a, b) = (self.values[key], self.values[key + 1]);
                match &self.between {
                    Between::Step => a,
                    Between::Linear => a + (b - a) * share,
                    Between::Cubic(slopes) => {
                        hermite([a, b], [slopes[key][1] * seconds, slopes[key + 1][0] * seconds], share)
                    }
                }
            }
        }
    }
}

impl Curve<DVec4> {
    /// The rotation at a time, of a curve of quaternions (x, y, z, w).
    pub fn rotation_at(&self, time: f64) -> DQuat {
        let rotation = match (self.place(time), &self.between) {
            (Place::Between(key, share, _), Between::Linear) => {
                let [a, b] = [self.values[key], self.values[key + 1]].map(|at| unit(DQuat::from_vec4(at)));
                a.slerp(b, share)
            }
            _ => DQuat::from_vec4(self.at(time)),
        };
        unit(rotation)
    }
}

/// Of unit length, as far as it has a direction.
fn unit(rotation: DQuat) -> DQuat {
    let length = rotation.length();
    if length > 0.0 && length.is_finite() { rotation / length } else { DQuat::IDENTITY }
}

fn check(times: &[f64], each: usize, found: usize) -> Result<(), CurveError> {
    if times.is_empty() {
        return Err(CurveError::Empty);
    }
    if let Some(&time) = times.iter().find(|time| !time.is_finite()) {
        return Err(CurveError::Time(time));
    }
    let mut pairs = times.iter().zip(times.iter().skip(1));
    if let Some((before, after)) = pairs.find(|(before, after)| before > after) {
        return Err(CurveError::Order(*before, *after));
    }
    let expected = each * times.len();
    if found == expected { Ok(()) } else { Err(CurveError::Count { times: times.len(), expected, found }) }
}

/// Slopes of a Catmull-Rom spline: at each keyframe that of the line from the one before to the one after it.
fn catmull_rom<V: Value>(times: &[f64], values: &[V]) -> Vec<[V; 2]> {
    let last = times.len() - 1;
    let slope = |key: usize| {
        let (from, to) = (key.saturating_sub(1), (key + 1).min(last));
        let seconds = times[to] - times[from];
        (values[to] - values[from]) * if seconds > 0.0 { 1.0 / seconds } else { 0.0 }
    };
    (0..=last).map(|key| [slope(key); 2]).collect()
}

/// The cubic with given values and slopes at both ends.
fn hermite<V: Value>([a, b]: [V; 2], [from, to]: [V; 2], s: f64) -> V {
    let (s2, s3) = (s * s, s * s * s);
    a * (2.0 * s3 - 3.0 * s2 + 1.0) + from * (s3 - 2.0 * s2 + s) + b * (3.0 * s2 - 2.0 * s3) + to * (s3 - s2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn curve(times: &[f64], values: &[f64], interpolation: Interpolation) -> Curve<f64> {
        Curve::new(times.to_vec(), values.to_vec(), interpolation).unwrap()
    }

    /// Values at and between keyframes, by hand; beyond the ends nothing moves.
    #[test]
    fn keyframes_are_met_and_values_between_follow() {
        for (interpolation, middle) in
            [(Interpolation::Step, 1.0), (Interpolation::Linear, 2.0), (Interpolation::Smooth, 2.0)]
        {
            let curve = curve(&[1.0, 3.0], &[1.0, 3.0], interpolation);
            let found = [-5.0, 1.0, 2.0, 3.0, 9.0].map(|time| curve.at(time));
            assert_eq!(found, [1.0, 1.0, middle, 3.0, 3.0], "{interpolation}");
        }
        // Of two keyframes at one time the first ends what comes before, the second begins what follows.
        let jump = curve(&[0.0, 1.0, 1.0, 2.0], &[0.0, 1.0, 5.0, 6.0], Interpolation::Linear);
        assert_eq!([0.5, 1.0, 1.5].map(|time| jump.at(time)), [0.5, 5.0, 5.5]);
    }

    /// A Catmull-Rom spline through even steps of a parabola is the parabola, wherever both neighbours are there: its slopes are exact.
    #[test]
    fn a_smooth_curve_through_a_parabola_is_the_parabola() {
        let times: Vec<f64> = (0..6).map(f64::from).collect();
        let values: Vec<f64> = times.iter().map(|t| t * t - 3.0 * t).collect();
        let curve = curve(&times, &values, Interpolation::Smooth);
        for step in 0..=30 {
            let t = 1.0 + f64::from(step) / 10.0;
            assert!((curve.at(t) - (t * t - 3.0 * t)).abs() < 1e-12, "{t}");
        }
    }

    /// Cubics with given slopes, glTF's CUBICSPLINE: t³ from 0 to 2, from its values and derivatives at the ends alone.
    #[test]
    fn a_cubic_is_reproduced_from_its_ends() {
        let curve = Curve::cubic(vec![0.0, 2.0], &[7.0, 0.0, 0.0, 12.0, 8.0, 7.0]).unwrap();
        for t in [0.0, 0.3, 1.0, 1.7, 2.0f64] {
            assert!((curve.at(t) - t.powi(3)).abs() < 1e-12, "{t}");
        }
    }

    /// Linear rotations turn evenly, the short way, whatever the sign of the quaternions.
    #[test]
    fn rotations_turn_evenly() {
        let quarter = DQuat::from_axis_angle(DVec3::Y, std::f64::consts::FRAC_PI_2);
        for sign in [1.0, -1.0] {
            let values = vec![DQuat::IDENTITY.into(), DVec4::from(quarter) * sign];
            let curve = Curve::new(vec![0.0, 1.0], values, Interpolation::Linear).unwrap();
            let third = curve.rotation_at(1.0 / 3.0) * DVec3::X;
            let angle = std::f64::consts::FRAC_PI_6;
            assert!(third.abs_diff_eq(DVec3::new(angle.cos(), 0.0, -angle.sin()), 1e-12), "{third}");
        }
    }

    #[test]
    fn what_is_no_curve_is_refused() {
        let new = |times: &[f64], values: usize| {
            Curve::new(times.to_vec(), vec![0.0; values], Interpolation::Linear).unwrap_err()
        };
        assert_eq!(new(&[], 0), CurveError::Empty);
        assert_eq!(new(&[1.0, 0.5], 2), CurveError::Order(1.0, 0.5));
        assert_eq!(new(&[0.0, 1.0], 3), CurveError::Count { times: 2, expected: 2, found: 3 });
        assert!(matches!(new(&[0.0, f64::NAN], 2), CurveError::Time(_)));
        assert!(matches!(Curve::cubic(vec![0.0], &[1.0]), Err(CurveError::Count { expected: 3, .. })));
    }
}
