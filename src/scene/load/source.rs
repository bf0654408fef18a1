//! Opening model files, compressed or not.

use std::fs::File;
use std::io::{self, BufReader, Chain, Cursor, Read};
use std::path::Path;

use flate2::read::MultiGzDecoder;
use ruzstd::decoding::StreamingDecoder;

use super::LoadError;

/// Bytes that a compressed file may hold: what unpacks to more is refused before it fills the memory.
const MAX_UNPACKED: u64 = 16 << 30;

/// A file's bytes, unpacked if they are gzip or Zstandard data, whatever the file's name.
///
/// # Errors
/// [`LoadError::Read`].
pub fn open(path: &Path) -> Result<Box<dyn Read + Send>, LoadError> {
    let error = |source| LoadError::Read { file: path.to_owned(), source };
    let mut file = File::open(path).map_err(error)?;
    if file.metadata().map_err(error)?.is_dir() {
        return Err(error(io::ErrorKind::IsADirectory.into()));
    }
    let mut start = Vec::with_capacity(4);
    (&mut file).take(4).read_to_end(&mut start).map_err(error)?;
    let packing = start.clone();
    let whole: Chain<Cursor<Vec<u8>>, File> = Cursor::new(start).chain(file);
    match packing[..] {
        [0x1f, 0x8b, ..] => Ok(Box::new(Limited::new(MultiGzDecoder::new(BufReader::new(whole))))),
        [0x28, 0xb5, 0x2f, 0xfd] => {
            let decoder = StreamingDecoder::new(BufReader::new(whole))
                .map_err(|cause| error(io::Error::new(io::ErrorKind::InvalidData, cause.to_string())))?;
            Ok(Box::new(Limited::new(decoder)))
        }
        _ => Ok(Box::new(whole)),
    }
}

/// All bytes of a file, unpacked.
///
/// # Errors
/// [`LoadError::Read`].
pub fn read_all(path: &Path) -> Result<Vec<u8>, LoadError> {
    let mut bytes = Vec::new();
    open(path)?
        .read_to_end(&mut bytes)
        .map_err(|source| LoadError::Read { file: path.to_owned(), source })?;
    Ok(bytes)
}

/// A reader that fails rather than give more than [`MAX_UNPACKED`] bytes.
struct Limited<R> {
    inner: R,
    left: u64,
}

impl<R> Limited<R> {
    fn new(inner: R) -> Self {
        Self { inner, left: MAX_UNPACKED }
    }
}

impl<R: Read> Read for Limited<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.inner.read(buffer)?;
        self.left = self.left.checked_sub(count as u64).ok_or_else(|| {
            io::Error::new(io::ErrorKind::InvalidData, format!("unpacks to more than {MAX_UNPACKED} bytes"))
        })?;
        Ok(count)
    }
}
