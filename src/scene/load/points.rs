//! Lists of positions.

use std::fs;
use std::path::Path;

use glam::Vec3;

use super::LoadError;
use super::text::{Lines, decode, parse_f32};

/// The rows of a text of numbers, with their line numbers from 1, as words between commas, semicolons or spaces. A heading in the first row, which is one
/// without any number, empty lines, and words from a `#` on are passed over.
pub(crate) fn number_rows(text: &[u8]) -> impl Iterator<Item = (usize, Vec<&[u8]>)> {
    let separates = |byte: &u8| byte.is_ascii_whitespace() || matches!(byte, b',' | b';');
    let words = move |content| -> Vec<&[u8]> {
        let words = <[u8]>::split(content, separates).filter(|word| !word.is_empty());
        words.take_while(|word| !word.starts_with(b"#")).collect()
    };
    let rows = Lines::new(text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text))
        .map(move |(line, content)| (line, words(content)))
        .filter(|(_, words)| !words.is_empty());
    let mut first = true;
    rows.filter(move |(_, words)| {
        !(std::mem::take(&mut first) && words.iter().all(|word| parse_f32(word).is_none()))
    })
}

/// A word as a finite number.
///
/// # Errors
/// What is wrong with it.
pub(crate) fn finite_number(word: &[u8]) -> Result<f32, String> {
    let value = parse_f32(word).filter(|value| value.is_finite());
    value.ok_or_else(|| format!("'{}' is not a finite number", decode(word).escape_debug()))
}

/// Reads positions from a CSV file: one per line, three numbers separated by commas, semicolons or spaces.
/// A heading in the first line and lines that start with `#` are passed over.
///
/// # Errors
/// [`LoadError::Read`]; [`LoadError::Line`] for a line that is not three finite numbers, and if there is none.
pub fn load_points(path: &Path) -> Result<Vec<Vec3>, LoadError> {
    let text = fs::read(path).map_err(|source| LoadError::Read { file: path.to_owned(), source })?;
    let mut points = Vec::new();
    for (line, words) in number_rows(&text) {
        let fail = |problem: String| LoadError::Line { file: path.to_owned(), line, problem };
        let [x, y, z] = words[..] else {
            return Err(fail(format!("three numbers expected, found {}", words.len())));
        };
        let number = |word: &[u8]| finite_number(word).map_err(fail);
        points.push(Vec3::new(number(x)?, number(y)?, number(z)?));
    }
    if points.is_empty() {
        let problem = "holds no positions".to_owned();
        return Err(LoadError::Line { file: path.to_owned(), line: 1, problem });
    }
    Ok(points)
}
