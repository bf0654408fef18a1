//! From byte offsets in a scene file to lines and key paths.

use std::ops::Range;
use std::path::{Path, PathBuf};

use toml::de::{DeTable, DeValue};

use crate::scene::load::LoadError;
use crate::suggestion::unknown_key;

/// Makes errors for places in one scene file.
pub struct Places<'a> {
    file: &'a Path,
    text: &'a str,
}

impl<'a> Places<'a> {
    /// For messages about `file`, which holds `text`.
    pub fn new(file: &'a Path, text: &'a str) -> Self {
        Self { file, text }
    }

    /// The error for a value that breaks a rule.
    pub fn error(&self, span: &Range<usize>, key: &str, problem: impl Into<String>) -> LoadError {
        let (file, line) = (self.file.to_owned(), self.line(span.start));
        LoadError::Key { file, line, key: key.to_owned(), problem: problem.into() }
    }

    /// The error for a file that a key refers to.
    pub fn unreadable(
        &self,
        span: &Range<usize>,
        key: &str,
        target: PathBuf,
        e: std::io::Error,
    ) -> LoadError {
        let (file, line) = (self.file.to_owned(), self.line(span.start));
        LoadError::Reference { file, line, key: key.to_owned(), target, source: e }
    }

    /// What the TOML parser or a type of the scene file found wrong.
    pub fn parse_error(&self, error: &toml::de::Error) -> LoadError {
        let offset = error.span().map_or(0, |span| span.start);
        let message = error.message().trim_end().replace('\n', ", ");
        let (file, line) = (self.file.to_owned(), self.line(offset));
        let Ok(table) = DeTable::parse(self.text) else {
            return LoadError::Line { file, line, problem: message };
        };
        // What the file itself lacks is no matter of the key that it begins with.
        let is_whole = error.span().is_none_or(|span| {
            span.start == 0 && (span.is_empty() || span.end >= self.text.trim_end().len())
        });
        let mut key = if is_whole { String::new() } else { key_at(table.get_ref(), offset, String::new()) };
        let (name, problem) = missing_or_unknown(&message);
        if let Some(name) = name
            && key != name
            && !key.ends_with(&format!(".{name}"))
        {
            key = join(&key, name);
        }
        if key.is_empty() {
            return LoadError::Line { file, line, problem };
        }
        LoadError::Key { file, line, key, problem }
    }

    /// Line of an offset, from 1.
    pub fn line(&self, offset: usize) -> usize {
        let before = &self.text.as_bytes()[..offset.min(self.text.len())];
        1 + before.iter().filter(|&&byte| byte == b'\n').count()
    }
}

/// Splits the parser's messages on missing and unknown keys into the key and the rest.
fn missing_or_unknown(message: &str) -> (Option<&str>, String) {
    if let Some(name) = message.strip_prefix("missing field `").and_then(|rest| rest.strip_suffix('`')) {
        return (Some(name), "is required".to_owned());
    }
    if let Some((name, problem)) = unknown_key(message) {
        return (Some(name), problem);
    }
    if let Some(name) = message.strip_prefix("duplicate field `").and_then(|rest| rest.strip_suffix('`')) {
        return (Some(name), "is given twice".to_owned());
    }
    (None, message.to_owned())
}

fn join(path: &str, key: &str) -> String {
    if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") }
}

/// Path of the innermost key whose name or value covers `offset`.
fn key_at(table: &DeTable, offset: usize, path: String) -> String {
    for (key, value) in table {
        let here = join(&path, key.get_ref());
        if key.span().contains(&offset) && !is_array_of_tables(value.get_ref()) {
            return here;
        }
        match value.get_ref() {
            DeValue::Table(inner) => {
                let found = key_at(inner, offset, here.clone());
                if found != here || value.span().contains(&offset) {
                    return found;
                }
            }
            DeValue::Array(items) if is_array_of_tables(value.get_ref()) => {
                for (i, item) in items.iter().enumerate() {
                    let here = format!("{here}[{i}]");
                    let DeValue::Table(inner) = item.get_ref() else { continue };
                    let found = key_at(inner, offset, here.clone());
                    if found != here || item.span().contains(&offset) {
                        return found;
                    }
                }
            }
            _ if value.span().contains(&offset) => return here,
            _ => {}
        }
    }
    path
}

fn is_array_of_tables(value: &DeValue) -> bool {
    matches!(value, DeValue::Array(items) if items.iter().any(|item| item.get_ref().is_table()))
}
