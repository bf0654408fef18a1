//! Statements of one run of whole lines, parsed without knowledge of the lines before it.

use std::borrow::Cow;

use crate::scene::load::Skipped;
use crate::scene::load::text::{Lines, decode, parse_f32, split_word, tokens};

/// A corner without a texture coordinate or normal.
const ABSENT: i32 = i32::MIN;
/// Relative indices are stored around this value, since what they count from is not known yet.
const RELATIVE_ORIGIN: i32 = -(1 << 30);
/// Positions, texture coordinates or normals that a file may have each.
pub const MAX_ELEMENTS: u64 = 1 << 29;
/// Corners that a face may have: far more than any real one, far fewer than triangulation can take.
const MAX_CORNERS: usize = 1 << 20;

/// Index of an element as a face states it, before it is known how many elements earlier chunks hold.
#[derive(Clone, Copy, Debug)]
pub struct StatedIndex(i32);

impl StatedIndex {
    /// `stated` counts from 1, or backwards from −1 when negative; `so_far` elements were seen in this chunk.
    fn new(stated: i64, so_far: usize) -> Result<Self, String> {
        if stated == 0 {
            return Err("index 0 (indices count from 1)".to_owned());
        }
        let limit = MAX_ELEMENTS as i64;
        if stated.abs() > limit {
            return Err(format!("index {stated} is out of range"));
        }
        // Both fit: |stated| ≤ 2²⁹, and a chunk is far too short for 2²⁹ elements.
        let encoded =
            if stated > 0 { stated - 1 } else { i64::from(RELATIVE_ORIGIN) + so_far as i64 + stated };
        Ok(Self(encoded as i32))
    }

    /// Index from 0 into the whole file, given how many elements precede the chunk; `None` if the
    /// face states none. A relative index before the file's start comes out as `u32::MAX - 1`.
    #[inline]
    pub fn resolve(self, preceding: usize) -> Option<u32> {
        match self.0 {
            ABSENT => None,
            index if index >= 0 => Some(index as u32),
            relative => {
                let index = preceding as i64 + i64::from(relative) - i64::from(RELATIVE_ORIGIN);
                Some(u32::try_from(index).unwrap_or(u32::MAX - 1))
            }
        }
    }
}

/// A polygon.
#[derive(Clone, Copy, Debug)]
pub struct Face {
    /// One past its last corner; its first is the end of the face before.
    pub corner_end: u32,
    /// Its line, from 1.
    pub line: u32,
}

/// A statement that names what follows.
#[derive(Clone, Debug)]
pub struct NameStatement {
    /// Faces before it.
    pub face: u32,
    /// Its line, from 1.
    pub line: u32,
    /// What it names.
    pub kind: NameKind,
    /// The rest of its line.
    pub name: String,
}

/// What a [`NameStatement`] names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NameKind {
    /// `o`
    Object,
    /// `g`
    Group,
    /// `usemtl`
    Material,
    /// `mtllib`
    Library,
}

/// What the lines state. Lines, faces and corners count from the chunk's start.
#[derive(Debug, Default)]
pub struct Chunk {
    /// `v`
    pub positions: Vec<[f32; 3]>,
    /// Colours behind `v`, as written; empty, or one per position.
    pub colors: Vec<[f32; 3]>,
    /// `vt`
    pub uvs: Vec<[f32; 2]>,
    /// `vn`
    pub normals: Vec<[f32; 3]>,
    /// Position of every corner.
    pub corner_positions: Vec<StatedIndex>,
    /// Texture coordinate of every corner; empty if no corner has one.
    pub corner_uvs: Vec<StatedIndex>,
    /// Normal of every corner; empty if no corner has one.
    pub corner_normals: Vec<StatedIndex>,
    /// `f`
    pub faces: Vec<Face>,
    /// `o`, `g`, `usemtl`, `mtllib`
    pub names: Vec<NameStatement>,
    /// Number of lines.
    pub lines: usize,
    /// Statements that are not rendered.
    pub skipped: Skipped,
    /// First face with fewer than three corners.
    pub first_short_face: Option<usize>,
    /// First line whose keyword is not of the format, with the keyword.
    pub first_unknown: Option<(usize, String)>,
    /// The first line in error, after which nothing was read.
    pub error: Option<(usize, String)>,
}

impl Chunk {
    /// Parses whole lines.
    pub fn parse(text: &[u8]) -> Self {
        let mut chunk = Self::default();
        let mut lines = Lines::new(text);
        while let Some((line, content)) = lines.next() {
            let content = joined(content, &mut lines);
            if let Err(problem) = chunk.statement(line, &content) {
                chunk.error = Some((line, problem));
                break;
            }
        }
        chunk.lines = lines.line();
        chunk
    }

    #[inline]
    fn statement(&mut self, line: usize, content: &[u8]) -> Result<(), String> {
        let (keyword, rest) = split_word(content);
        match keyword {
            b"v" => self.position(rest),
            b"f" | b"fo" => self.face(line, rest),
            b"vn" => {
                self.normals.push(numbers(rest, 3).map(|(values, _)| [values[0], values[1], values[2]])?);
                Ok(())
            }
            b"vt" => {
                let (values, _) = numbers(rest, 1)?;
                let uv = [values[0], values[1]];
                let finite = uv.iter().all(|x| x.is_finite());
                self.skipped.bad_uvs += u64::from(!finite);
                self.uvs.push(if finite { uv } else { [0.0; 2] });
                Ok(())
            }
            _ => {
                self.rare_statement(line, keyword, rest);
                Ok(())
            }
        }
    }

    fn rare_statement(&mut self, line: usize, keyword: &[u8], rest: &[u8]) {
        let kind = match keyword {
            b"o" => NameKind::Object,
            b"g" => NameKind::Group,
            b"usemtl" => NameKind::Material,
            b"mtllib" => NameKind::Library,
            b"l" => return self.skipped.lines += 1,
            b"p" => return self.skipped.points += 1,
            b"curv" | b"curv2" | b"surf" => return self.skipped.free_form += 1,
            _ => {
                let ignored =
                    keyword.first().is_none_or(|&first| first == b'#') || IGNORED.contains(&keyword);
                if !ignored && self.first_unknown.is_none() {
                    self.first_unknown = Some((line, decode(&keyword[..keyword.len().min(32)])));
                }
                return;
            }
        };
        let name = decode(rest.trim_ascii());
        self.names.push(NameStatement { face: self.faces.len() as u32, line: line as u32, kind, name });
    }

    #[inline]
    fn position(&mut self, rest: &[u8]) -> Result<(), String> {
        let (values, count) = numbers(rest, 3)?;
        let [x, y, z, ..] = values;
        if !(x.is_finite() && y.is_finite() && z.is_finite()) {
            return Err("coordinate is not a finite single-precision number".to_owned());
        }
        // Four numbers: the last is a weight. Six: a colour. Seven: a weight, then a colour.
        let color = match count {
            6 => Some([values[3], values[4], values[5]]),
            7 => Some([values[4], values[5], values[6]]),
            _ => None,
        };
        if color.is_some() || !self.colors.is_empty() {
            self.colors.resize(self.positions.len(), [1.0; 3]);
            self.colors.push(color.unwrap_or([1.0; 3]).map(|c| if c.is_finite() { c.max(0.0) } else { 0.0 }));
        }
        self.positions.push([x, y, z]);
        Ok(())
    }

    #[inline]
    fn face(&mut self, line: usize, rest: &[u8]) -> Result<(), String> {
        let first = self.corner_positions.len();
        for corner in tokens(rest) {
            let (position, rest) = integer(corner)?;
            let position = position.ok_or_else(|| bad_corner(corner))?;
            let (uv, rest) = integer_after_slash(corner, rest)?;
            let (normal, rest) = integer_after_slash(corner, rest)?;
            if !rest.is_empty() {
                return Err(bad_corner(corner));
            }
            self.corner_positions.push(StatedIndex::new(position, self.positions.len())?);
            let index = self.corner_positions.len() - 1;
            push_optional(&mut self.corner_uvs, index, uv, self.uvs.len())?;
            push_optional(&mut self.corner_normals, index, normal, self.normals.len())?;
        }
        if self.corner_positions.len() - first < 3 {
            self.skipped.short_faces += 1;
            self.first_short_face.get_or_insert(line);
            self.corner_positions.truncate(first);
            self.corner_uvs.truncate(first);
            self.corner_normals.truncate(first);
            return Ok(());
        }
        if self.corner_positions.len() - first > MAX_CORNERS {
            return Err(format!("a face of more than {MAX_CORNERS} corners"));
        }
        self.faces.push(Face { corner_end: self.corner_positions.len() as u32, line: line as u32 });
        Ok(())
    }
}

/// Keywords of the format that change nothing here: smoothing groups (shading follows the normals that
/// are given), display and free-form attributes, and extensions of other programs.
const IGNORED: &[&[u8]] = &[
    b"s",
    b"vp",
    b"vw",
    b"mg",
    b"cstype",
    b"deg",
    b"bmat",
    b"step",
    b"parm",
    b"trim",
    b"hole",
    b"scrv",
    b"sp",
    b"end",
    b"con",
    b"bevel",
    b"c_interp",
    b"d_interp",
    b"lod",
    b"usemap",
    b"maplib",
    b"shadow_obj",
    b"trace_obj",
    b"ctech",
    b"stech",
    b"t",
];

/// A line with those that continue it: a backslash at the end joins the next line, except in comments.
#[inline]
fn joined<'a>(content: &'a [u8], lines: &mut Lines<'a>) -> Cow<'a, [u8]> {
    if content.last() != Some(&b'\\') || content.trim_ascii_start().first() == Some(&b'#') {
        return Cow::Borrowed(content);
    }
    let mut whole = content.to_vec();
    while whole.last() == Some(&b'\\') {
        whole.pop();
        whole.push(b' ');
        match lines.next() {
            Some((_, next)) => whole.extend_from_slice(next),
            None => break,
        }
    }
    Cow::Owned(whole)
}

/// Up to seven numbers of a line and how many there are, at least `required`; missing ones are 0.
#[inline]
fn numbers(mut rest: &[u8], required: usize) -> Result<([f32; 7], usize), String> {
    let mut values = [0.0; 7];
    let mut count = 0;
    while count < values.len() {
        rest = rest.trim_ascii_start();
        if rest.is_empty() || rest[0] == b'#' {
            break;
        }
        let (value, length) = match fast_float2::parse_partial::<f32, _>(rest) {
            Ok((value, length)) if rest.get(length).is_none_or(u8::is_ascii_whitespace) => (value, length),
            _ => {
                let word = tokens(rest).next().unwrap_or_default();
                (parse_f32(word).ok_or_else(|| format!("'{}' is not a number", excerpt(word)))?, word.len())
            }
        };
        values[count] = value;
        count += 1;
        rest = &rest[length..];
    }
    if count < required {
        return Err(format!("{required} numbers expected, found {count}"));
    }
    Ok((values, count))
}

/// An optional integer at the start of `word`, and what follows.
#[inline]
fn integer(word: &[u8]) -> Result<(Option<i64>, &[u8]), String> {
    let (negative, digits) = match word.first() {
        Some(b'-') => (true, &word[1..]),
        Some(b'+') => (false, &word[1..]),
        _ => (false, word),
    };
    let mut value = 0_i64;
    let mut length = 0;
    while let Some(digit @ b'0'..=b'9') = digits.get(length) {
        value = value.saturating_mul(10).saturating_add(i64::from(digit - b'0'));
        length += 1;
    }
    match length {
        0 if digits.len() < word.len() => Err(bad_corner(word)),
        0 => Ok((None, word)),
        _ => Ok((Some(if negative { -value } else { value }), &digits[length..])),
    }
}

#[inline]
fn integer_after_slash<'a>(corner: &[u8], rest: &'a [u8]) -> Result<(Option<i64>, &'a [u8]), String> {
    match rest.split_first() {
        None => Ok((None, rest)),
        Some((b'/', rest)) => integer(rest),
        Some(_) => Err(bad_corner(corner)),
    }
}

/// Appends an index that corners need not have; the list stays empty until the first one that has it.
#[inline]
fn push_optional(
    list: &mut Vec<StatedIndex>,
    corner: usize,
    stated: Option<i64>,
    so_far: usize,
) -> Result<(), String> {
    match stated {
        Some(stated) => {
            list.resize(corner, StatedIndex(ABSENT));
            list.push(StatedIndex::new(stated, so_far)?);
        }
        None if !list.is_empty() => list.push(StatedIndex(ABSENT)),
        None => {}
    }
    Ok(())
}

fn bad_corner(word: &[u8]) -> String {
    format!("'{}' is not a corner (v, v/vt, v//vn or v/vt/vn)", excerpt(word))
}

/// A word short enough for a message.
fn excerpt(word: &[u8]) -> String {
    decode(&word[..word.len().min(32)]).escape_debug().to_string()
}
