//! All statements of an OBJ file, read in blocks and parsed in parallel.

use std::io::{self, Read};
use std::path::Path;

use rayon::prelude::*;

use super::chunk::{Chunk, Face, MAX_ELEMENTS, NameStatement, StatedIndex};
use crate::scene::load::{LoadError, Skipped, Warning};

/// A corner without a texture coordinate or normal.
pub const ABSENT: u32 = u32::MAX;

/// How a file is cut up. The result does not depend on it.
#[derive(Clone, Copy, Debug)]
pub struct ChunkSizes {
    /// Bytes held at a time; longer lines enlarge it.
    pub block: usize,
    /// Bytes that one task parses, up to the next line's end.
    pub chunk: usize,
}

impl Default for ChunkSizes {
    /// Blocks small against any file worth parallelism, chunks small against a block.
    fn default() -> Self {
        Self { block: 32 << 20, chunk: 1 << 20 }
    }
}

/// The statements of a file in order; indices count from 0 into the whole file and are in range.
#[derive(Debug, Default)]
pub struct Statements {
    /// `v`
    pub positions: Vec<[f32; 3]>,
    /// Colours behind `v`, as written; empty, or one per position.
    pub colors: Vec<[f32; 3]>,
    /// `vt`
    pub uvs: Vec<[f32; 2]>,
    /// `vn`
    pub normals: Vec<[f32; 3]>,
    /// Position of every corner.
    pub corner_positions: Vec<u32>,
    /// Texture coordinate of every corner or [`ABSENT`]; empty if no corner has one.
    pub corner_uvs: Vec<u32>,
    /// Normal of every corner or [`ABSENT`]; empty if no corner has one.
    pub corner_normals: Vec<u32>,
    /// `f`
    pub faces: Vec<Face>,
    /// `o`, `g`, `usemtl`, `mtllib`
    pub names: Vec<NameStatement>,
    /// Number of lines.
    pub lines: usize,
    /// Statements that are not rendered.
    pub skipped: Skipped,
    /// Warnings for the user.
    pub warnings: Vec<Warning>,
    short_faces_told: bool,
    unknown_told: bool,
}

impl Statements {
    /// Reads a file's text; `path` names it in messages.
    ///
    /// # Errors
    /// [`LoadError::Read`], and [`LoadError::Line`] for the first line in error.
    pub fn read(mut reader: impl Read + Send, path: &Path, sizes: ChunkSizes) -> Result<Self, LoadError> {
        let mut all = Self::default();
        let mut block = next_block(&mut reader, Vec::new(), sizes.block);
        if let Ok(first) = &mut block
            && first.lines.starts_with(b"\xef\xbb\xbf")
        {
            first.lines.drain(..3);
        }
        loop {
            let Block { lines, rest, last } =
                block.map_err(|source| LoadError::Read { file: path.to_owned(), source })?;
            let parse = || -> Vec<Chunk> {
                split_lines(&lines, sizes.chunk).into_par_iter().map(Chunk::parse).collect()
            };
            // The next block is read while this one is parsed.
            let (chunks, next) = if last {
                (parse(), None)
            } else {
                rayon::join(parse, || Some(next_block(&mut reader, rest, sizes.block)))
            };
            for chunk in chunks {
                all.append(chunk, path)?;
            }
            match next {
                Some(next) => block = next,
                None => break,
            }
        }
        all.check_indices(path)?;
        Ok(all)
    }

    fn append(&mut self, chunk: Chunk, path: &Path) -> Result<(), LoadError> {
        let file = || path.to_owned();
        let first_line = self.lines;
        if let Some((line, problem)) = chunk.error {
            return Err(LoadError::Line { file: file(), line: first_line + line, problem });
        }
        if let (Some(line), false) = (chunk.first_short_face, self.short_faces_told) {
            self.short_faces_told = true;
            let message = "a face with fewer than three corners, skipped (as are others like it)".to_owned();
            self.warnings.push(Warning { file: file(), line: Some(first_line + line), message });
        }
        if let (Some((line, keyword)), false) = (chunk.first_unknown, self.unknown_told) {
            self.unknown_told = true;
            let message = format!("unknown statement '{}', ignored (as are others)", keyword.escape_debug());
            self.warnings.push(Warning { file: file(), line: Some(first_line + line), message });
        }
        let before = [self.positions.len(), self.uvs.len(), self.normals.len()];
        let corners_before = self.corner_positions.len();
        if !chunk.colors.is_empty() || !self.colors.is_empty() {
            self.colors.resize(before[0], [1.0; 3]);
            self.colors.extend(chunk.colors);
            self.colors.resize(before[0] + chunk.positions.len(), [1.0; 3]);
        }
        self.positions.extend(chunk.positions);
        self.uvs.extend(chunk.uvs);
        self.normals.extend(chunk.normals);
        let resolved = |stated: &StatedIndex, preceding| stated.resolve(preceding).unwrap_or(ABSENT);
        self.corner_positions.extend(chunk.corner_positions.iter().map(|stated| resolved(stated, before[0])));
        let corners = self.corner_positions.len();
        for (list, stated, preceding) in [
            (&mut self.corner_uvs, chunk.corner_uvs, before[1]),
            (&mut self.corner_normals, chunk.corner_normals, before[2]),
        ] {
            if !stated.is_empty() || !list.is_empty() {
                list.resize(corners_before, ABSENT);
                list.extend(stated.iter().map(|stated| resolved(stated, preceding)));
                list.resize(corners, ABSENT);
            }
        }
        let too_large = |what, limit| LoadError::TooLarge { file: path.to_owned(), what, limit };
        let elements = self.positions.len().max(self.uvs.len()).max(self.normals.len()) as u64;
        if elements > MAX_ELEMENTS {
            return Err(too_large("vertices", MAX_ELEMENTS));
        }
        if corners as u64 >= u64::from(u32::MAX) || self.lines + chunk.lines >= u32::MAX as usize {
            return Err(too_large("corners or lines", u64::from(u32::MAX)));
        }
        let faces_before = self.faces.len() as u32;
        let line = |line: u32| line + first_line as u32;
        self.faces.extend(
            chunk.faces.iter().map(|face| Face {
                corner_end: face.corner_end + corners_before as u32,
                line: line(face.line),
            }),
        );
        self.names.extend(chunk.names.into_iter().map(|statement| NameStatement {
            face: statement.face + faces_before,
            line: line(statement.line),
            ..statement
        }));
        self.lines += chunk.lines;
        self.skipped.add(&chunk.skipped);
        Ok(())
    }

    /// Faces may refer to elements that follow them, so indices are checked when all are known. A
    /// vertex that does not exist is an error; a normal or texture coordinate is done without.
    fn check_indices(&mut self, path: &Path) -> Result<(), LoadError> {
        if let Some(corner) = first_at_least(&self.corner_positions, self.positions.len()) {
            let problem =
                format!("a face's vertex index is out of range: there are {} vertices", self.positions.len());
            return Err(LoadError::Line { file: path.to_owned(), line: self.line_of(corner), problem });
        }
        for (what, count) in [("normal", self.normals.len()), ("texture coordinate", self.uvs.len())] {
            let indices = if what == "normal" { &self.corner_normals } else { &self.corner_uvs };
            let Some(corner) = first_at_least(indices, count) else { continue };
            let line = Some(self.line_of(corner));
            let message = format!("a face's {what} index is out of range, ignored (as are others like it)");
            self.warnings.push(Warning { file: path.to_owned(), line, message });
            let indices = if what == "normal" { &mut self.corner_normals } else { &mut self.corner_uvs };
            indices
                .par_iter_mut()
                .filter(|index| **index as usize >= count)
                .for_each(|index| *index = ABSENT);
        }
        Ok(())
    }

    /// Line of the face that a corner belongs to.
    fn line_of(&self, corner: usize) -> usize {
        let face = self.faces.partition_point(|face| face.corner_end as usize <= corner);
        self.faces.get(face).map_or(0, |face| face.line as usize)
    }
}

/// First corner whose index is not below `count`.
fn first_at_least(indices: &[u32], count: usize) -> Option<usize> {
    indices.par_iter().position_first(|&index| index != ABSENT && index as usize >= count)
}

/// Whole lines of the file, and the start of the line after them.
struct Block {
    lines: Vec<u8>,
    rest: Vec<u8>,
    last: bool,
}

fn next_block(reader: &mut impl Read, mut start: Vec<u8>, size: usize) -> io::Result<Block> {
    loop {
        let before = start.len();
        reader.take(size.max(1) as u64).read_to_end(&mut start)?;
        if start.len() == before {
            return Ok(Block { lines: start, rest: Vec::new(), last: true });
        }
        if let Some(end) = last_line_end(&start, start.len()) {
            let rest = start.split_off(end);
            return Ok(Block { lines: start, rest, last: false });
        }
    }
}

/// One past the last `\n` before `end` that ends a statement rather than continues it.
fn last_line_end(text: &[u8], end: usize) -> Option<usize> {
    memchr::memrchr_iter(b'\n', &text[..end]).find(|&at| !continues(&text[..at])).map(|at| at + 1)
}

fn continues(line: &[u8]) -> bool {
    line.strip_suffix(b"\r").unwrap_or(line).last() == Some(&b'\\')
}

/// Cuts whole lines into pieces of about `size` bytes.
fn split_lines(text: &[u8], size: usize) -> Vec<&[u8]> {
    let mut pieces = Vec::with_capacity(text.len() / size.max(1) + 1);
    let mut rest = text;
    while rest.len() > size {
        let Some(cut) =
            memchr::memchr_iter(b'\n', &rest[size..]).map(|at| size + at).find(|&at| !continues(&rest[..at]))
        else {
            break;
        };
        let (piece, after) = rest.split_at(cut + 1);
        pieces.push(piece);
        rest = after;
    }
    pieces.push(rest);
    pieces
}
