//! The container: `.glb` or `.gltf`, the JSON part and the buffers.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use gltf_json::Root;

use crate::scene::load::{LoadError, Warning, source};

/// Bytes at the start of a binary file.
const MAGIC: &[u8; 4] = b"glTF";

/// A parsed file with its buffers.
pub struct Document<'a> {
    /// Names the file in messages; other files are looked for beside it.
    pub path: &'a Path,
    /// The JSON part.
    pub root: Root,
    /// Buffers, at least as long as they say.
    buffers: Vec<Cow<'a, [u8]>>,
}

impl<'a> Document<'a> {
    /// Parses a file's bytes and reads the buffers that it names.
    ///
    /// # Errors
    /// [`LoadError::Invalid`].
    pub fn parse(bytes: &'a [u8], path: &'a Path) -> Result<Self, LoadError> {
        let fail = |problem: String| invalid(path, "", problem);
        let (json, binary) =
            if bytes.starts_with(MAGIC) { split(bytes).map_err(fail)? } else { (bytes, None) };
        let json = json.strip_prefix(b"\xef\xbb\xbf").unwrap_or(json);
        let root: Root = serde_json::from_slice(json)
            .map_err(|error| fail(format!("not glTF 2.0: {}", error.to_string().replace('\n', " "))))?;
        if !root.asset.version.starts_with("2.") {
            let version = root.asset.version.escape_debug();
            return Err(invalid(path, "asset.version", format!("is {version}, only 2.x is known")));
        }
        let mut document = Self { path, root, buffers: Vec::new() };
        for index in 0..document.root.buffers.len() {
            let buffer = document.buffer(index, binary)?;
            document.buffers.push(buffer);
        }
        Ok(document)
    }

    /// A warning about the file as a whole.
    pub fn warning(&self, message: String) -> Warning {
        Warning { file: self.path.to_owned(), line: None, message }
    }

    fn buffer(&self, index: usize, binary: Option<&'a [u8]>) -> Result<Cow<'a, [u8]>, LoadError> {
        let buffer = &self.root.buffers[index];
        let place = || format!("buffers[{index}]");
        let bytes = match (&buffer.uri, binary) {
            (None, Some(binary)) if index == 0 => Cow::Borrowed(binary),
            (None, _) => return Err(self.error(&place(), "names no data".to_owned())),
            (Some(uri), _) => Cow::Owned(self.resource(uri, &place())?),
        };
        if (bytes.len() as u64) < buffer.byte_length.0 {
            let problem = format!("holds {} bytes instead of {}", bytes.len(), buffer.byte_length.0);
            return Err(self.error(&place(), problem));
        }
        Ok(bytes)
    }

    /// The bytes behind a URI: inline data, or a file beside this one.
    ///
    /// # Errors
    /// [`LoadError::Invalid`] at `place`.
    pub fn resource(&self, uri: &str, place: &str) -> Result<Vec<u8>, LoadError> {
        if let Some(data) = uri.strip_prefix("data:") {
            let problem = || self.error(place, "the data: URI is not valid base64".to_owned());
            let (kind, data) = data.split_once(',').ok_or_else(problem)?;
            if !kind.ends_with(";base64") {
                return Ok(percent_encoding::percent_decode_str(data).collect());
            }
            return STANDARD.decode(data).map_err(|_| problem());
        }
        if uri.contains("://") {
            return Err(self.error(place, format!("{} is not a local file", short(uri))));
        }
        let decoded = percent_encoding::percent_decode_str(uri).decode_utf8_lossy();
        let folder = self.path.parent().unwrap_or(Path::new(""));
        // Some writers don't encode, and a name may hold a literal %.
        let candidates: [PathBuf; 2] = [folder.join(&*decoded), folder.join(uri)];
        let file = candidates.iter().find(|file| file.exists()).unwrap_or(&candidates[0]);
        if file.exists() && !file.is_file() {
            // A device would never end.
            return Err(self.error(place, format!("{} is not a regular file", file.display())));
        }
        source::read_all(file).map_err(|error| match error {
            LoadError::Read { file, source } => {
                let reason = source.to_string();
                let reason = reason.split(" (os error").next().unwrap_or_default().to_lowercase();
                self.error(place, format!("cannot read {}: {reason}", file.display()))
            }
            other => other,
        })
    }

    /// The bytes of a buffer view, and its stride if it states one.
    ///
    /// # Errors
    /// [`LoadError::Invalid`] at `place`.
    pub fn view(&self, index: usize, place: &str) -> Result<(&[u8], Option<usize>), LoadError> {
        let missing = || self.error(place, format!("bufferViews[{index}] does not exist"));
        let view = self.root.buffer_views.get(index).ok_or_else(missing)?;
        let buffer = view.buffer.value();
        let bytes = self.buffers.get(buffer).ok_or_else(|| {
            self.error(&format!("bufferViews[{index}]"), format!("buffers[{buffer}] does not exist"))
        })?;
        let begin = view.byte_offset.map_or(0, |offset| offset.0);
        let range = begin
            .checked_add(view.byte_length.0)
            .and_then(|end| bytes.get(usize::try_from(begin).ok()?..usize::try_from(end).ok()?));
        let range = range.ok_or_else(|| {
            let problem = format!("reaches beyond the {} bytes of buffers[{buffer}]", bytes.len());
            self.error(&format!("bufferViews[{index}]"), problem)
        })?;
        Ok((range, view.byte_stride.map(|stride| stride.0)))
    }

    /// The error for something in this file.
    pub fn error(&self, place: &str, problem: String) -> LoadError {
        invalid(self.path, place, problem)
    }
}

fn invalid(path: &Path, place: &str, problem: String) -> LoadError {
    LoadError::Invalid { file: path.to_owned(), place: place.to_owned(), problem }
}

/// Start of a text that may be very long.
fn short(text: &str) -> String {
    text.chars().take(80).collect::<String>().escape_debug().to_string()
}

/// JSON and binary part of a `.glb`.
fn split(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), String> {
    let word = |at: usize| {
        let bytes = bytes.get(at..at.checked_add(4)?)?;
        Some(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
    };
    let version = word(4).ok_or("the file ends within its header")?;
    if version != 2 {
        return Err(format!("binary glTF of version {version}, only 2 is known"));
    }
    let (mut json, mut binary) = (None, None);
    let mut at = 12;
    while let (Some(length), Some(kind)) = (word(at), word(at + 4)) {
        let begin = at + 8;
        let chunk = begin.checked_add(length as usize).and_then(|end| bytes.get(begin..end));
        let chunk = chunk.ok_or_else(|| format!("the file ends within a chunk of {length} bytes"))?;
        match &kind.to_le_bytes() {
            b"JSON" if json.is_none() => json = Some(chunk),
            b"BIN\0" if binary.is_none() => binary = Some(chunk),
            // Chunks of other kinds are to be ignored.
            _ => {}
        }
        at = begin + chunk.len();
    }
    Ok((json.ok_or("there is no JSON chunk")?, binary))
}
