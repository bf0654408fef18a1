//! Enums whose values have names, the same in scene files, on the command line and in reports.

use crate::suggestion::hint;

/// An enum whose values have names; which scene files, the command line and reports share.
pub trait Named: Copy + PartialEq + Sized + 'static {
    /// Every value with its name and what it stands for, in the order in which they are listed.
    const NAMES: &'static [(&'static str, Self, &'static str)];

    /// The name.
    fn name(self) -> &'static str {
        Self::NAMES.iter().find(|(_, value, _)| *value == self).map_or("", |(name, ..)| name)
    }

    /// The value of a name.
    ///
    /// # Errors
    /// [`UnknownName`], which lists the names that there are.
    fn named(name: &str) -> Result<Self, UnknownName> {
        let found = Self::NAMES.iter().find(|(known, ..)| *known == name);
        found.map(|(_, value, _)| *value).ok_or_else(|| UnknownName {
            found: name.to_owned(),
            expected: Self::NAMES.iter().map(|(name, ..)| *name).collect::<Vec<_>>().join(", "),
        })
    }
}

/// A text that names no value of an enum.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("unknown name `{found}`{}, expected one of {expected}", hint(found, expected.split(", ")))]
pub struct UnknownName {
    /// The text.
    pub found: String,
    /// The names that there are.
    pub expected: String,
}

/// Declares an enum of plain values, each with its documentation and its name.
macro_rules! named_enum {
    (
        $(#[$meta:meta])*
        pub enum $name:ident {
            $( #[doc = $doc:literal] $(#[$other:meta])* $variant:ident = $text:literal, )+
        }
    ) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum $name {
            $( #[doc = $doc] $(#[$other])* $variant, )+
        }

        impl $crate::settings::Named for $name {
            const NAMES: &'static [(&'static str, Self, &'static str)] =
                &[$( ($text, Self::$variant, $doc.trim_ascii()), )+];
        }

        impl std::fmt::Display for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str($crate::settings::Named::name(*self))
            }
        }

        impl std::str::FromStr for $name {
            type Err = $crate::settings::UnknownName;

            fn from_str(text: &str) -> Result<Self, Self::Err> {
                $crate::settings::Named::named(text)
            }
        }

        impl serde::Serialize for $name {
            fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                serializer.serialize_str($crate::settings::Named::name(*self))
            }
        }

        impl<'de> serde::Deserialize<'de> for $name {
            fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                let name = std::borrow::Cow::<'de, str>::deserialize(deserializer)?;
                $crate::settings::Named::named(&name).map_err(serde::de::Error::custom)
            }
        }
    };
}

pub(crate) use named_enum;
