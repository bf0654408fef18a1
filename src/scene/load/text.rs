//! Bytes to lines, words and numbers, for the Wavefront formats.

/// The lines of a text with their numbers from 1, without their ends (`\n`, `\r\n` or `\r`).
pub struct Lines<'a> {
    rest: &'a [u8],
    line: usize,
}

impl<'a> Lines<'a> {
    /// Lines of `text`.
    pub fn new(text: &'a [u8]) -> Self {
        Self { rest: text, line: 0 }
    }

    /// Number of the last line that was returned: how many lines there were so far.
    pub fn line(&self) -> usize {
        self.line
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = (usize, &'a [u8]);

    #[inline]
    fn next(&mut self) -> Option<Self::Item> {
        if self.rest.is_empty() {
            return None;
        }
        self.line += 1;
        let Some(end) = memchr::memchr2(b'\n', b'\r', self.rest) else {
            return Some((self.line, std::mem::take(&mut self.rest)));
        };
        let (content, rest) = self.rest.split_at(end);
        self.rest = rest.strip_prefix(b"\r\n").unwrap_or(&rest[1..]);
        Some((self.line, content))
    }
}

/// The first word of a line and what follows it; the word is empty at the line's end.
#[inline]
pub fn split_word(line: &[u8]) -> (&[u8], &[u8]) {
    let line = line.trim_ascii_start();
    let mut end = 0;
    while end < line.len() && !line[end].is_ascii_whitespace() {
        end += 1;
    }
    line.split_at(end)
}

/// The words of a line up to a comment: a `#` at the start of a word.
#[inline]
pub fn tokens(line: &[u8]) -> Tokens<'_> {
    Tokens { rest: line }
}

/// The words of a line; see [`tokens`].
pub struct Tokens<'a> {
    rest: &'a [u8],
}

impl<'a> Iterator for Tokens<'a> {
    type Item = &'a [u8];

    #[inline]
    fn next(&mut self) -> Option<&'a [u8]> {
        let (word, rest) = split_word(self.rest);
        self.rest = rest;
        if matches!(word.first(), None | Some(b'#')) {
            self.rest = &[];
            return None;
        }
        Some(word)
    }
}

/// A number in full, in the forms that C's `strtod` reads.
pub fn parse_f32(word: &[u8]) -> Option<f32> {
    let unsigned = word.strip_prefix(b"+").unwrap_or(word);
    fast_float2::parse(unsigned).ok()
}

/// Text of a name. Bytes that are not UTF-8 are read as Latin-1, so that different names stay different.
pub fn decode(bytes: &[u8]) -> String {
    match std::str::from_utf8(bytes) {
        Ok(text) => text.to_owned(),
        Err(_) => bytes.iter().map(|&byte| char::from(byte)).collect(),
    }
}
