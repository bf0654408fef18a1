//! What all ways of reading an EXR file share: its blocks, each once, and what a file of its size may claim to hold.

use std::collections::HashSet;
use std::io::Cursor;

use ::exr::block::UncompressedBlock;
use ::exr::block::reader::{ChunksReader as _, Reader};
use ::exr::math::Vec2;
use ::exr::meta::header::Header;

use crate::image::{DecodeError, MAX_PIXELS};

/// A file of n bytes may claim `FREE_PIXELS` + n · `PIXELS_PER_BYTE` pixels. Deflate, at most 1,032 bytes out of one,
/// and at least 2 bytes per pixel stay below it; a small file that claims a huge image does not.
const FREE_PIXELS: u64 = 1 << 24;
const PIXELS_PER_BYTE: u64 = 1024;

/// A file's bytes, of which the header is read.
pub(super) type FileReader<'a> = Reader<Cursor<&'a [u8]>>;

/// Reads the header of a file.
pub(super) fn open(bytes: &[u8]) -> Result<FileReader<'_>, DecodeError> {
    ::exr::block::read(Cursor::new(bytes), false).map_err(decode_error)
}

/// Runs a decoder; the crate's B44 decompressor, for one, overflows on damaged blocks where overflow is checked.
pub(super) fn without_panic<T>(
    decoder: impl FnOnce() -> Result<T, DecodeError> + std::panic::UnwindSafe,
) -> Result<T, DecodeError> {
    std::panic::catch_unwind(decoder).unwrap_or_else(|_| Err(damaged("a block is inconsistent")))
}

/// Refuses windows that a file of so many bytes can't fill.
pub(super) fn check_sizes(header: &Header, file_size: u64) -> Result<(), DecodeError> {
    let plausible = MAX_PIXELS.min(FREE_PIXELS + file_size.saturating_mul(PIXELS_PER_BYTE));
    let display = header.shared_attributes.display_window.size;
    for (name, size) in [("display window", display), ("data window", header.layer_size)] {
        if (size.0 as u64).checked_mul(size.1 as u64).is_none_or(|area| area > plausible) {
            let cause = format!(
                "its {name} has {} by {} pixels; for {file_size} bytes the limit is {plausible} pixels",
                size.0, size.1
            );
            return Err(DecodeError::Unsupported { format: "EXR", cause });
        }
    }
    Ok(())
}

/// Column and row of the data window's top left pixel, counted from that of the display window.
pub(super) fn offset(header: &Header) -> (i64, i64) {
    let (data, display) =
        (header.own_attributes.layer_position, header.shared_attributes.display_window.position);
    let offset = |data: i32, display: i32| i64::from(data) - i64::from(display);
    (offset(data.0, display.0), offset(data.1, display.1))
}

/// Calls `each` with every block of a layer's finest level, in any order.
pub(super) fn read_blocks(
    reader: FileReader,
    layer: usize,
    mut each: impl FnMut(&UncompressedBlock),
) -> Result<(), DecodeError> {
    let header = &reader.headers()[layer];
    let (bytes_per_pixel, expected_area) = (header.channels.bytes_per_pixel, header.layer_size.area());
    let chunks = reader
        .filter_chunks(false, |_, _, block| block.layer == layer && block.level == Vec2(0, 0))
        .map_err(decode_error)?;
    let mut seen = HashSet::new();
    let mut area = 0;
    for block in chunks.sequential_decompressor(false) {
        let block = block.map_err(decode_error)?;
        // A damaged offset table can lead to another block than the one wanted, or twice to the same.
        let index = block.index;
        if index.layer != layer
            || index.level != Vec2(0, 0)
            || !seen.insert((index.pixel_position.x(), index.pixel_position.y()))
            || block.data.len() != index.pixel_size.area() * bytes_per_pixel
        {
            return Err(damaged("its table of blocks contradicts the blocks"));
        }
        area += index.pixel_size.area();
        each(&block);
    }
    if area != expected_area {
        return Err(damaged("blocks of the image are missing"));
    }
    Ok(())
}

pub(super) fn damaged(cause: &str) -> DecodeError {
    DecodeError::Damaged { format: "EXR", cause: cause.to_owned() }
}

pub(super) fn unsupported(cause: String) -> DecodeError {
    DecodeError::Unsupported { format: "EXR", cause }
}

fn decode_error(error: ::exr::error::Error) -> DecodeError {
    match error {
        ::exr::error::Error::NotSupported(cause) => unsupported(cause.into_owned()),
        other => damaged(&other.to_string()),
    }
}
