//! Groups of lights, each of which can have a layer of its own in an image.

use std::ops::Range;

/// The groups that some of a scene's lights belong to; a light without one belongs to [`LightGroups::DEFAULT`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightGroups {
    names: Vec<String>,
    /// Number of each light's group, 0 for the default one; lights beyond the end have that.
    of_light: Vec<u16>,
}

/// A group that lights can't have.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LightGroupError {
    /// The name is empty, or has other characters than letters and digits of ASCII, `_` and `-`.
    #[error("a group's name consists of letters, digits, _ and -")]
    Name,
    /// There are too many groups.
    #[error("a scene has at most {} groups of lights", LightGroups::MOST)]
    TooMany,
}

impl LightGroups {
    /// Name of the group of lights without one.
    pub const DEFAULT: &str = "default";

    /// Groups that a scene may have: each costs an image of its own.
    pub const MOST: usize = 256;

    /// Puts some lights, by their places in [`Scene::lights`](super::Scene::lights), into the group of this name.
    ///
    /// # Errors
    /// [`LightGroupError`]; then nothing has changed.
    pub fn assign(&mut self, lights: Range<usize>, name: &str) -> Result<(), LightGroupError> {
        let allowed = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
        if name.is_empty() || !name.chars().all(allowed) {
            return Err(LightGroupError::Name);
        }
        let number = if name == Self::DEFAULT {
            0
        } else {
            let known = self.names.iter().position(|known| known == name);
            if known.is_none() && self.names.len() == Self::MOST {
                return Err(LightGroupError::TooMany);
            }
            let index = known.unwrap_or_else(|| {
                self.names.push(name.to_owned());
                self.names.len() - 1
            });
            index as u16 + 1
        };
        if self.of_light.len() < lights.end {
            self.of_light.resize(lights.end, 0);
        }
        self.of_light.iter_mut().take(lights.end).skip(lights.start).for_each(|group| *group = number);
        Ok(())
    }

    /// Number of a light's group, 0 for the default one.
    pub fn of(&self, light: usize) -> u16 {
        self.of_light.get(light).copied().unwrap_or(0)
    }

    /// The names by the groups' numbers, the default one first.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        std::iter::once(Self::DEFAULT).chain(self.names.iter().map(String::as_str))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lights keep their group whatever is assigned after them, and names that no channel can have are refused.
    #[test]
    fn lights_have_the_group_they_were_given_last() {
        let mut groups = LightGroups::default();
        groups.assign(1..3, "key").unwrap();
        groups.assign(4..5, "rim").unwrap();
        groups.assign(2..3, "default").unwrap();
        assert_eq!(groups.names().collect::<Vec<_>>(), ["default", "key", "rim"]);
        assert_eq!((0..7).map(|light| groups.of(light)).collect::<Vec<_>>(), [0, 1, 0, 0, 2, 0, 0]);
        let before = groups.clone();
        for name in ["", "a.b", "a b", "größer"] {
            assert_eq!(groups.assign(0..1, name), Err(LightGroupError::Name), "{name}");
        }
        assert_eq!(groups, before);
    }
}
