//! The list of a gallery's images.

use std::fs;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::super::error::CommandError;
use crate::suggestion::unknown_key;

/// The list of images.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gallery {
    /// The images in the order of the page.
    #[serde(rename = "picture")]
    pub images: Vec<ListedImage>,
}

/// One image of the list.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ListedImage {
    /// Name of the files.
    pub name: String,
    /// Heading on the page.
    pub(super) title: String,
    /// Scene file, relative to the list.
    pub scene: PathBuf,
    /// What there is to see.
    pub(super) caption: String,
    /// Models that are not part of the project, relative to the list; where one is missing, the image is not rendered.
    #[serde(default)]
    needs: Vec<PathBuf>,
    /// Whether the same by the conventional tracer stands beside it.
    #[serde(default)]
    pub conventional: bool,
}

/// What is added to the names of the files of the same image by the conventional tracer.
const CONVENTIONAL: &str = "-conventional";

impl ListedImage {
    /// Names of its files, each with whether it is the one by the conventional tracer.
    pub fn files(&self) -> impl Iterator<Item = (String, bool)> {
        let beside = self.conventional.then(|| (format!("{}{CONVENTIONAL}", self.name), true));
        std::iter::once((self.name.clone(), false)).chain(beside)
    }

    /// The first of the models that it needs and that is not in the list's folder.
    pub fn missing(&self, folder: &Path) -> Option<PathBuf> {
        self.needs.iter().map(|model| folder.join(model)).find(|model| !model.exists())
    }
}

impl Gallery {
    /// Reads a list. Names are such that they can be names of files, and no two are the same.
    ///
    /// # Errors
    /// [`CommandError::Read`] and [`CommandError::Malformed`].
    pub fn read(file: &Path) -> Result<Self, CommandError> {
        let malformed = |problem: String| CommandError::Malformed { file: file.to_owned(), problem };
        let text = read(file)?;
        let gallery: Self = toml::from_str(&text).map_err(|error| malformed(problem(&text, &error)))?;
        for (index, ListedImage { name, .. }) in gallery.images.iter().enumerate() {
            let plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
            if name.is_empty() || !name.chars().all(plain) {
                let problem =
                    format!("picture[{index}].name: letters, digits, - and _ make a name, found `{name}`");
                return Err(malformed(problem));
            }
            if name.ends_with(CONVENTIONAL) {
                let problem =
                    format!("picture[{index}].name: `{CONVENTIONAL}` is added to names, found `{name}`");
                return Err(malformed(problem));
            }
            if gallery.images.iter().take(index).any(|other| other.name == *name) {
                return Err(malformed(format!("picture[{index}].name: there are two pictures `{name}`")));
            }
        }
        Ok(gallery)
    }
}

/// What the parser found wrong, in one line that begins with the line of `text`.
fn problem(text: &str, error: &toml::de::Error) -> String {
    let before = error.span().and_then(|span| text.get(..span.start)).unwrap_or_default();
    let line = 1 + before.matches('\n').count();
    let message = match unknown_key(error.message()) {
        Some((name, problem)) => format!("{name}: {problem}"),
        None => error.message().trim_end().replace('\n', ", "),
    };
    format!("line {line}: {message}")
}

/// A text file's contents.
pub(super) fn read(file: &Path) -> Result<String, CommandError> {
    fs::read_to_string(file).map_err(|source| CommandError::Read { file: file.to_owned(), source })
}
