//! Reading all channels of an EXR file as they are stored.

use ::exr::block::UncompressedBlock;
use ::exr::math::Vec2;
use ::exr::meta::attribute::{AttributeValue, ChannelList, SampleType as Stored, Text};
use ::exr::meta::header::Header;
use ::exr::prelude::f16;

use super::blocks::{check_sizes, damaged, offset, open, read_blocks, unsupported, without_panic};
use super::{Channel, ChannelImage, DataWindow, Samples};
use crate::image::DecodeError;

/// A file of n bytes may claim `FREE_BYTES` + n · `BYTES_PER_BYTE` bytes of samples: no compression of the format makes more than half of
/// that out of a byte.
const FREE_BYTES: u64 = 1 << 26;
const BYTES_PER_BYTE: u64 = 2048;

/// Decodes all channels of an EXR file of one part, to the last bit, with its windows and string attributes, each in the order of the names.
///
/// Scan lines and tiles (of these the finest level) are read. The attribute `software`, which [`encode_channels`](super::encode_channels)
/// writes by itself, is left out.
///
/// # Errors
///
/// If the file is damaged, has several parts, or deep or subsampled data.
pub fn decode_channels(bytes: &[u8]) -> Result<ChannelImage, DecodeError> {
    without_panic(|| decode_part(bytes))
}

fn decode_part(bytes: &[u8]) -> Result<ChannelImage, DecodeError> {
    let reader = open(bytes)?;
    let [header] = reader.headers() else {
        return Err(unsupported(format!("{} parts", reader.headers().len())));
    };
    if header.deep || header.channels.list.iter().any(|channel| channel.sampling != Vec2(1, 1)) {
        return Err(unsupported("subsampled or deep channels".to_owned()));
    }
    let file_size = bytes.len() as u64;
    check_sizes(header, file_size)?;
    let pixels = header.layer_size.area();
    let sample_bytes = (pixels as u64).saturating_mul(header.channels.bytes_per_pixel as u64);
    if sample_bytes > FREE_BYTES.saturating_add(file_size.saturating_mul(BYTES_PER_BYTE)) {
        return Err(unsupported(format!("{sample_bytes} bytes of samples in a file of {file_size} bytes")));
    }
    let mut image = ChannelImage {
        metadata: texts(header),
        channels: header.channels.list.iter().map(|channel| empty(channel, pixels)).collect(),
        ..windows(header)?
    };
    let (list, width) = (header.channels.clone(), header.layer_size.width());
    read_blocks(reader, 0, |block| copy_block(block, &list, width, &mut image.channels))?;
    Ok(image)
}

/// A channel of zeros.
fn empty(described: &::exr::meta::attribute::ChannelDescription, pixels: usize) -> Channel {
    let samples = match described.sample_type {
        Stored::F16 => Samples::Half(vec![f16::ZERO; pixels]),
        Stored::F32 => Samples::Float(vec![0.0; pixels]),
        Stored::U32 => Samples::Whole(vec![0; pixels]),
    };
    Channel::new(utf8(&described.name), samples)
}

/// The windows of a file, without channels.
fn windows(header: &Header) -> Result<ChannelImage, DecodeError> {
    let out_of_range = |_| damaged("a window is out of range");
    let side = |length: usize| u32::try_from(length).map_err(out_of_range);
    let place = |offset: i64| i32::try_from(offset).map_err(out_of_range);
    let (x, y) = offset(header);
    let (display, size) = (header.shared_attributes.display_window.size, header.layer_size);
    let window = DataWindow { x: place(x)?, y: place(y)?, width: side(size.0)?, height: side(size.1)? };
    Ok(ChannelImage::new((side(display.0)?, side(display.1)?), window))
}

/// The bytes of a text, which other programs write in UTF-8.
fn utf8(text: &Text) -> String {
    String::from_utf8_lossy(text.as_slice()).into_owned()
}

/// String attributes of a file's first part, in the order of their names; none if it is damaged.
pub fn metadata(bytes: &[u8]) -> Vec<(String, String)> {
    let found = without_panic(|| Ok(open(bytes)?.headers().first().map(texts)));
    found.ok().flatten().unwrap_or_default()
}

/// String attributes.
fn texts(header: &Header) -> Vec<(String, String)> {
    let own = &header.own_attributes;
    // Names that the crate knows are no part of its table.
    let known = [("capDate", &own.capture_date), ("comments", &own.comments), ("owner", &own.owner)];
    let known = known.into_iter().filter_map(|(name, value)| Some((name.to_owned(), utf8(value.as_ref()?))));
    let others = own.other.iter().chain(&header.shared_attributes.other);
    let others = others.filter_map(|(name, value)| match value {
        AttributeValue::Text(value) => Some((utf8(name), utf8(value))),
        _ => None,
    });
    let mut found: Vec<_> = known.chain(others).collect();
    found.sort();
    found
}

/// Copies one block.
fn copy_block(block: &UncompressedBlock, list: &ChannelList, width: usize, channels: &mut [Channel]) {
    for line in block.lines(list) {
        let location = line.location;
        let Some(channel) = channels.get_mut(location.channel) else { continue };
        let start = location.position.y() * width + location.position.x();
        let (words, pairs) = (line.value.as_chunks::<4>().0, line.value.as_chunks::<2>().0);
        match &mut channel.samples {
            Samples::Half(to) => put(to, start, pairs.iter().map(|bytes| f16::from_ne_bytes(*bytes))),
            Samples::Float(to) => put(to, start, words.iter().map(|bytes| f32::from_ne_bytes(*bytes))),
            Samples::Whole(to) => put(to, start, words.iter().map(|bytes| u32::from_ne_bytes(*bytes))),
        }
    }
}

/// Puts values where they belong; what lies beyond the window, in a damaged file, goes nowhere.
fn put<T>(to: &mut [T], start: usize, values: impl Iterator<Item = T>) {
    to.iter_mut().skip(start).zip(values).for_each(|(to, value)| *to = value);
}
