//! Flags whose values have names.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};

/// A value with its name, and what it stands for; that may be empty.
pub type Named<T> = (&'static str, T, &'static str);

/// A parser that takes the name of one of `values` and gives the value. Help lists the names.
pub fn one_of<T>(values: &'static [Named<T>]) -> impl TypedValueParser<Value = T>
where
    T: Copy + Send + Sync + 'static,
{
    let names = values.iter().map(|&(name, _, meaning)| {
        let value = PossibleValue::new(name);
        if meaning.is_empty() { value } else { value.help(meaning) }
    });
    PossibleValuesParser::new(names).try_map(move |text: String| {
        let named = values.iter().find(|(name, ..)| *name == text);
        named.map(|(_, value, _)| *value).ok_or("not one of the names")
    })
}
