//! Flags whose values have names.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};

use crate::settings::Named;

/// A parser that takes the name of a value and gives the value. Help lists the names.
pub fn named<T: Named + Send + Sync>() -> impl TypedValueParser<Value = T> {
    let values = T::NAMES.iter().map(|&(name, _, meaning)| PossibleValue::new(name).help(meaning));
    PossibleValuesParser::new(values).try_map(|text: String| T::named(&text))
}
