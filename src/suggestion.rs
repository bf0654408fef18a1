//! What somebody may have meant who mistyped a name.

/// The one of the known names that is closest to `found`; `None` where none is close.
///
/// Close is what at most a third of the letters, swapped neighbours counted once, have to be changed for. Case does not count.
pub fn closest<'a>(found: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let most = found.chars().count().max(3) / 3;
    let found = found.to_lowercase();
    let distances =
        known.into_iter().map(|name| (strsim::damerau_levenshtein(&found, &name.to_lowercase()), name));
    // Of several that are equally close the first one is taken.
    distances
        .filter(|(distance, _)| *distance <= most)
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, name)| name)
}

/// ` (did you mean …?)` for a message about a name that is unknown; empty where no known one is close.
pub fn hint<'a>(found: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    closest(found, known).map_or_else(String::new, |name| format!(" (did you mean `{name}`?)"))
}

/// The key that a TOML file may not hold, and what there is to say about it, from the parser's message; `None` for other messages.
pub fn unknown_key(message: &str) -> Option<(&str, String)> {
    let (name, rest) = message.strip_prefix("unknown field `")?.split_once('`')?;
    // The parser lists the keys that there are between backquotes: every second part of the rest.
    let problem = match closest(name, rest.split('`').skip(1).step_by(2)) {
        Some(meant) => format!("unknown key, did you mean `{meant}`?"),
        None => format!("unknown key{}", rest.trim_end()),
    };
    Some((name, problem))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A slip of the finger is recognised: a letter that is wrong, missing, too many or swapped with its neighbour, or another case.
    #[test]
    fn slips_are_recognised() {
        let known = ["radius", "resolve", "spacing", "up"];
        for (found, meant) in [
            ("radous", "radius"),
            ("radus", "radius"),
            ("radiuss", "radius"),
            ("ardius", "radius"),
            ("Spacing", "spacing"),
            ("SPACNIG", "spacing"),
            ("ip", "up"),
        ] {
            assert_eq!(closest(found, known), Some(meant), "{found}");
        }
    }

    /// A name that means something else is no slip: a wrong guess would mislead.
    #[test]
    fn other_words_are_not_guessed_at() {
        for found in ["colour", "aperture", "", "é", "x"] {
            assert_eq!(closest(found, ["radius", "resolve", "spacing", "falloff"]), None, "{found}");
        }
        assert_eq!(hint("anything", []), "");
    }

    /// The closest one is meant, and where two are equally close the one that is listed first.
    #[test]
    fn the_closest_name_is_meant() {
        assert_eq!(closest("spaceing", ["spaceings", "spacing"]), Some("spaceings"));
        assert_eq!(closest("min_radius", ["max_radius", "mn_radius"]), Some("mn_radius"));
    }
}
