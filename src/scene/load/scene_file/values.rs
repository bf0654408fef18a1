//! Values of the scene file with the ranges that they must lie in.
//!
//! Checks happen while a value is read, so that the parser knows the place in the file.

use std::fmt;

use glam::Vec3;
use serde::de::{self, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

use crate::settings::Spacing;

/// A number or an array of numbers, as written.
enum Numbers {
    One(f64),
    Many(Vec<f64>),
}

struct NumbersVisitor;

impl<'de> Visitor<'de> for NumbersVisitor {
    type Value = Numbers;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a number or an array of numbers")
    }

    fn visit_f64<E: de::Error>(self, value: f64) -> Result<Numbers, E> {
        Ok(Numbers::One(value))
    }

    fn visit_i64<E: de::Error>(self, value: i64) -> Result<Numbers, E> {
        Ok(Numbers::One(value as f64))
    }

    fn visit_u64<E: de::Error>(self, value: u64) -> Result<Numbers, E> {
        Ok(Numbers::One(value as f64))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut sequence: A) -> Result<Numbers, A::Error> {
        let mut values = Vec::new();
        while let Some(value) = sequence.next_element()? {
            values.push(value);
        }
        Ok(Numbers::Many(values))
    }
}

fn single<E: de::Error>(value: f64) -> Result<f32, E> {
    let narrow = value as f32;
    if narrow.is_finite() {
        Ok(narrow)
    } else {
        Err(E::custom(format!("must be a finite single-precision number, found {value}")))
    }
}

fn three<E: de::Error>(values: &[f64]) -> Result<Vec3, E> {
    match values {
        [x, y, z] => Ok(Vec3::new(single(*x)?, single(*y)?, single(*z)?)),
        _ => Err(E::custom(format!("must have three numbers, found {}", values.len()))),
    }
}

/// One number where `GREY` is its meaning in all three components, or three.
fn one_or_three<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec3, D::Error> {
    match deserializer.deserialize_any(NumbersVisitor)? {
        Numbers::One(value) => Ok(Vec3::splat(single(value)?)),
        Numbers::Many(values) => three(&values),
    }
}

fn check<T: fmt::Display, E: de::Error>(value: T, holds: bool, range: &str) -> Result<T, E> {
    if holds { Ok(value) } else { Err(E::custom(format!("must {range}, found {value}"))) }
}

/// A number type with a range: name, the check of an `f32`, and the range in words.
macro_rules! number {
    ($(#[$doc:meta])* $name:ident, |$x:ident| $holds:expr, $range:literal) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug)]
        pub struct $name(pub f32);

        impl<'de> Deserialize<'de> for $name {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                let $x = single(f64::deserialize(deserializer)?)?;
                check($x, $holds, $range).map(Self)
            }
        }
    };
}

number!(
    /// Any finite number.
    Finite, |x| x.is_finite(), "be finite");
number!(
    /// ≥ 0.
    NonNegative, |x| x >= 0.0, "not be negative");
number!(
    /// > 0.
    Positive, |x| x > 0.0, "be greater than 0");
number!(
    /// In [0, 1].
    Fraction, |x| (0.0..=1.0).contains(&x), "lie in [0, 1]");
number!(
    /// Degrees in (0, 180).
    FieldOfView, |x| x > 0.0 && x < 180.0, "lie in (0, 180)");
number!(
    /// Pixels of a filter, in (0, 16].
    FilterWidth, |x| x > 0.0 && x <= crate::settings::MAX_FILTER_WIDTH, "lie in (0, 16]");
number!(
    /// Stops in [−100, 100].
    Stops, |x| x.abs() <= crate::settings::MAX_EXPOSURE, "lie in [-100, 100]");

/// A time in seconds, finite.
#[derive(Clone, Copy, Debug)]
pub struct Seconds(pub f64);

impl<'de> Deserialize<'de> for Seconds {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let value = f64::deserialize(deserializer)?;
        check(value, value.is_finite(), "be finite").map(Self)
    }
}

/// A three-component type: name, how it is written, the check, and the range in words.
macro_rules! vector {
    ($(#[$doc:meta])* $name:ident, $read:expr, |$v:ident| $holds:expr, $range:literal) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct $name(pub Vec3);

        impl<'de> Deserialize<'de> for $name {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                let $v: Vec3 = $read(deserializer)?;
                check($v, $holds, $range).map(Self)
            }
        }
    };
}

fn exactly_three<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec3, D::Error> {
    three(&Vec::<f64>::deserialize(deserializer)?)
}

vector!(
    /// Three finite numbers.
    Point, exactly_three, |v| v.is_finite(), "be finite");
vector!(
    /// Three numbers that are not all 0.
    Direction, exactly_three, |v| v != Vec3::ZERO, "not be the zero vector");
vector!(
    /// Grey as one number or RGB as three, each ≥ 0.
    Color, one_or_three, |v| v.min_element() >= 0.0, "not be negative");
vector!(
    /// Grey as one number or RGB as three, each in [0, 1].
    Reflectance, one_or_three, |v| v.min_element() >= 0.0 && v.max_element() <= 1.0, "lie in [0, 1]");
vector!(
    /// One number for all axes or one per axis, none of them 0.
    ScaleFactors, one_or_three, |v| v.abs().min_element() > 0.0, "not be 0");
vector!(
    /// One number for all axes or one per axis, each > 0.
    Lengths, one_or_three, |v| v.min_element() > 0.0, "be greater than 0");

/// A count in [`MIN`, `MAX`].
#[derive(Clone, Copy, Debug)]
pub struct Count<const MAX: u32, const MIN: u32 = 1>(pub u32);

impl<'de, const MAX: u32, const MIN: u32> Deserialize<'de> for Count<MAX, MIN> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let value = i64::deserialize(deserializer)?;
        match u32::try_from(value) {
            Ok(count) if (MIN..=MAX).contains(&count) => Ok(Self(count)),
            _ => Err(de::Error::custom(format!("must lie in [{MIN}, {MAX}], found {value}"))),
        }
    }
}

/// Lengths, or the word `auto`.
#[derive(Clone, Copy, Debug)]
pub enum LengthsOrAuto {
    /// Chosen by the program.
    Auto,
    /// As given.
    Lengths(Vec3),
}

impl<'de> Deserialize<'de> for LengthsOrAuto {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct AutoVisitor;
        impl<'de> Visitor<'de> for AutoVisitor {
            type Value = LengthsOrAuto;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("\"auto\", a number or an array of three numbers")
            }

            fn visit_str<E: de::Error>(self, value: &str) -> Result<Self::Value, E> {
                match value {
                    Spacing::AUTO => Ok(LengthsOrAuto::Auto),
                    _ => Err(E::invalid_value(de::Unexpected::Str(value), &self)),
                }
            }

            fn visit_f64<E: de::Error>(self, value: f64) -> Result<Self::Value, E> {
                positive(Vec3::splat(single(value)?))
            }

            fn visit_i64<E: de::Error>(self, value: i64) -> Result<Self::Value, E> {
                self.visit_f64(value as f64)
            }

            fn visit_seq<A: SeqAccess<'de>>(self, sequence: A) -> Result<Self::Value, A::Error> {
                match NumbersVisitor.visit_seq(sequence)? {
                    Numbers::One(value) => self.visit_f64(value),
                    Numbers::Many(values) => positive(three(&values)?),
                }
            }
        }
        fn positive<E: de::Error>(lengths: Vec3) -> Result<LengthsOrAuto, E> {
            check(lengths, lengths.min_element() > 0.0, "be greater than 0").map(LengthsOrAuto::Lengths)
        }
        deserializer.deserialize_any(AutoVisitor)
    }
}

/// A rotation: degrees about the axes x, then y, then z, or about one axis.
#[derive(Clone, Copy, Debug)]
pub enum Rotation {
    /// Three angles in degrees.
    Axes(Vec3),
    /// Counter-clockwise about `axis`, seen with the axis pointing at the viewer.
    AxisAngle {
        /// Not zero; any length.
        axis: Vec3,
        /// Degrees.
        degrees: f32,
    },
}

impl<'de> Deserialize<'de> for Rotation {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct AxisAngle {
            axis: Direction,
            degrees: Finite,
        }
        struct RotationVisitor;
        impl<'de> Visitor<'de> for RotationVisitor {
            type Value = Rotation;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("three angles in degrees, or a table with axis and degrees")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, sequence: A) -> Result<Rotation, A::Error> {
                match NumbersVisitor.visit_seq(sequence)? {
                    Numbers::One(angle) => three(&[angle]).map(Rotation::Axes),
                    Numbers::Many(angles) => three(&angles).map(Rotation::Axes),
                }
            }

            fn visit_map<A: de::MapAccess<'de>>(self, map: A) -> Result<Rotation, A::Error> {
                let table = AxisAngle::deserialize(de::value::MapAccessDeserializer::new(map))?;
                Ok(Rotation::AxisAngle { axis: table.axis.0, degrees: table.degrees.0 })
            }
        }
        deserializer.deserialize_any(RotationVisitor)
    }
}
