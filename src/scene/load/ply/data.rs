//! The data behind the header, number by number.

use super::header::{Encoding, Scalar};

/// Reads numbers one after the other.
pub struct Data<'a> {
    rest: &'a [u8],
    encoding: Encoding,
}

/// What is wrong where the file ends too early.
const TOO_SHORT: &str = "the file ends before it";

impl<'a> Data<'a> {
    /// Numbers in `bytes`.
    pub fn new(bytes: &'a [u8], encoding: Encoding) -> Self {
        Self { rest: bytes, encoding }
    }

    /// Most rows of `size` bytes (at least) that there can still be: what to reserve memory for.
    pub fn rows_left(&self, count: u64) -> usize {
        count.min(self.rest.len() as u64) as usize
    }

    /// The next number.
    ///
    /// # Errors
    /// What is wrong with it, in words.
    #[inline]
    pub fn number(&mut self, scalar: Scalar) -> Result<f64, String> {
        match self.encoding {
            Encoding::Ascii => self.text(),
            Encoding::LittleEndian => self.binary(scalar, false),
            Encoding::BigEndian => self.binary(scalar, true),
        }
    }

    /// A list's length.
    ///
    /// # Errors
    /// As [`Data::number`], and lengths that are no natural number.
    #[inline]
    pub fn length(&mut self, scalar: Scalar) -> Result<u32, String> {
        let length = self.number(scalar)?;
        if length >= 0.0 && length <= f64::from(u32::MAX) && length.fract() == 0.0 {
            Ok(length as u32)
        } else {
            Err(format!("{length} is not the length of a list"))
        }
    }

    fn text(&mut self) -> Result<f64, String> {
        let start = self.rest.iter().position(|byte| !byte.is_ascii_whitespace()).ok_or(TOO_SHORT)?;
        let rest = &self.rest[start..];
        let end = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        let (word, rest) = rest.split_at(end);
        self.rest = rest;
        let unsigned = word.strip_prefix(b"+").unwrap_or(word);
        fast_float2::parse(unsigned).map_err(|_| {
            let shown = String::from_utf8_lossy(&word[..word.len().min(32)]);
            format!("'{}' is not a number", shown.escape_debug())
        })
    }

    #[inline]
    fn binary(&mut self, scalar: Scalar, big: bool) -> Result<f64, String> {
        let (bytes, rest) = self.rest.split_at_checked(scalar.size()).ok_or(TOO_SHORT)?;
        self.rest = rest;
        let mut ordered = [0u8; 8];
        let place = &mut ordered[..bytes.len()];
        place.copy_from_slice(bytes);
        if big {
            place.reverse();
        }
        let [a, b, c, d, ..] = ordered;
        Ok(match scalar {
            Scalar::I8 => f64::from(a as i8),
            Scalar::U8 => f64::from(a),
            Scalar::I16 => f64::from(i16::from_le_bytes([a, b])),
            Scalar::U16 => f64::from(u16::from_le_bytes([a, b])),
            Scalar::I32 => f64::from(i32::from_le_bytes([a, b, c, d])),
            Scalar::U32 => f64::from(u32::from_le_bytes([a, b, c, d])),
            Scalar::F32 => f64::from(f32::from_le_bytes([a, b, c, d])),
            Scalar::F64 => f64::from_le_bytes(ordered),
        })
    }
}
