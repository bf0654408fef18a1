//! Lists of positions.

use std::fs;
use std::path::Path;

use glam::Vec3;

use super::LoadError;
use super::text::{Lines, decode, parse_f32, tokens};

/// Reads positions from a CSV file: one per line, three numbers separated by commas, semicolons or spaces.
/// A heading in the first line and lines that start with `#` are passed over.
///
/// # Errors
/// [`LoadError::Read`]; [`LoadError::Line`] for a line that is not three finite numbers, and if there is none.
pub fn load_points(path: &Path) -> Result<Vec<Vec3>, LoadError> {
    let text = fs::read(path).map_err(|source| LoadError::Read { file: path.to_owned(), source })?;
    let text: Vec<u8> =
        text.into_iter().map(|byte| if matches!(byte, b',' | b';') { b' ' } else { byte }).collect();
    let mut points = Vec::new();
    let mut first = true;
    for (line, content) in Lines::new(text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&text)) {
        let fail = |problem: String| LoadError::Line { file: path.to_owned(), line, problem };
        let words: Vec<&[u8]> = tokens(content).collect();
        if words.is_empty() {
            continue;
        }
        let heading = std::mem::take(&mut first) && words.iter().all(|word| parse_f32(word).is_none());
        if heading {
            continue;
        }
        let [x, y, z] = words[..] else {
            return Err(fail(format!("three numbers expected, found {}", words.len())));
        };
        let number = |word: &[u8]| {
            let value = parse_f32(word).filter(|value| value.is_finite());
            value.ok_or_else(|| fail(format!("'{}' is not a finite number", decode(word).escape_debug())))
        };
        points.push(Vec3::new(number(x)?, number(y)?, number(z)?));
    }
    if points.is_empty() {
        let problem = "holds no positions".to_owned();
        return Err(LoadError::Line { file: path.to_owned(), line: 1, problem });
    }
    Ok(points)
}
