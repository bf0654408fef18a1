//! `steps` of `[render]`: a number, or a list of tables.

use std::fmt;

use serde::de::{self, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

use super::values::{Count, Lengths, Positive};
use crate::settings::{Neighbourhood, Step, Steps};

/// Pictures on the way, as they are written; a list may be too long.
#[derive(Debug)]
pub struct StepsKey(pub Steps);

/// `[[render.steps]]`
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StepTable {
    spacing: Option<Lengths>,
    radius: Option<Positive>,
    neighbourhood: Option<Neighbourhood>,
}

impl<'de> Deserialize<'de> for StepsKey {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct StepsVisitor;
        impl<'de> Visitor<'de> for StepsVisitor {
            type Value = StepsKey;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a number of pictures, or a list of tables")
            }

            fn visit_i64<E: de::Error>(self, value: i64) -> Result<StepsKey, E> {
                let count = Count::<{ Steps::MOST }>::deserialize(de::value::I64Deserializer::new(value))?;
                Ok(StepsKey(Steps::Count(count.0)))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut sequence: A) -> Result<StepsKey, A::Error> {
                let mut list = Vec::new();
                while let Some(StepTable { spacing, radius, neighbourhood }) = sequence.next_element()? {
                    let (spacing, radius) = (spacing.map(|lengths| lengths.0), radius.map(|radius| radius.0));
                    list.push(Step { spacing, radius, neighbourhood });
                }
                Ok(StepsKey(Steps::List(list)))
            }
        }
        deserializer.deserialize_any(StepsVisitor)
    }
}
