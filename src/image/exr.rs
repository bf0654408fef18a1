//! OpenEXR: linear light in half or float.

use std::collections::HashSet;
use std::io::Cursor;

use ::exr::block::UncompressedBlock;
use ::exr::block::reader::ChunksReader as _;
use ::exr::image::write::WritableImage as _;
use ::exr::image::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image as ExrImage, Layer};
use ::exr::math::Vec2;
use ::exr::meta::attribute::{AttributeValue, ChannelList, Chromaticities, Text};
use ::exr::meta::header::{Header, LayerAttributes};
use ::exr::prelude::{Blocks, Compression, LineOrder, f16};

use super::{DecodeError, Image, MAX_PIXELS};

/// First bytes of every EXR file.
pub(crate) const SIGNATURE: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];

/// A file of n bytes may claim `FREE_PIXELS` + n · `PIXELS_PER_BYTE` pixels. Deflate, at most 1,032 bytes out of one,
/// and at least 2 bytes per pixel stay below it; a small file that claims a huge image does not.
const FREE_PIXELS: u64 = 1 << 24;
const PIXELS_PER_BYTE: u64 = 1024;

/// The primaries and white point of BT.709, which is also what a file without the attribute means.
const BT_709: Chromaticities = Chromaticities {
    red: Vec2(0.64, 0.33),
    green: Vec2(0.30, 0.60),
    blue: Vec2(0.15, 0.06),
    white: Vec2(0.3127, 0.3290),
};

/// Precision of a written file's channels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SampleType {
    /// 16 bits: 11 significant bits, up to 65,504. Finite values beyond are clamped to that.
    #[default]
    Half,
    /// 32 bits: exactly what was rendered.
    Float,
}

/// Encodes `image` as one layer with the channels R, G, B, compressed with ZIP in blocks of 16 rows.
///
/// `metadata` becomes string attributes of these names. The same image and metadata give the same bytes.
///
/// # Errors
///
/// If a metadata key is no valid attribute name.
pub fn encode(
    image: &Image,
    sample_type: SampleType,
    metadata: &[(String, String)],
) -> ::exr::error::Result<Vec<u8>> {
    let plane = |channel: usize| {
        let values = image.pixels().iter().map(|pixel| pixel[channel]);
        match sample_type {
            SampleType::Half => FlatSamples::F16(values.map(nearest_half).collect()),
            SampleType::Float => FlatSamples::F32(values.collect()),
        }
    };
    let channels =
        ["R", "G", "B"].into_iter().enumerate().map(|(index, name)| AnyChannel::new(name, plane(index)));
    let channels = AnyChannels::sort(channels.collect());
    let mut attributes =
        LayerAttributes { software_name: Some(Text::from("lightmesh")), ..LayerAttributes::default() };
    for (key, value) in metadata {
        // Texts of the format are bytes; other programs write and expect UTF-8.
        let text = |string: &str| Text::from_slice_unchecked(string.as_bytes());
        attributes.other.insert(text(key), AttributeValue::Text(text(value)));
    }
    let encoding = Encoding {
        compression: Compression::ZIP16,
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let size = Vec2(image.width() as usize, image.height() as usize);
    let mut file = ExrImage::from_layer(Layer::new(size, attributes, encoding, channels));
    file.attributes.chromaticities = Some(BT_709);
    let mut bytes = Cursor::new(Vec::new());
    file.write().to_buffered(&mut bytes)?;
    let mut bytes = bytes.into_inner();
    sort_attributes(&mut bytes).ok_or(::exr::error::Error::Invalid("attributes of the header".into()))?;
    Ok(bytes)
}

/// Bytes before the first attribute of a file: signature and version.
const ATTRIBUTES_START: usize = 8;

/// Sorts the attributes of a file's only header by their names, as OpenEXR's own library does. The crate keeps some of
/// them in a hash map, whose order differs from run to run. The header's length stays, and with it all offsets that the
/// file holds. `None` if the bytes are no such header.
fn sort_attributes(file: &mut [u8]) -> Option<()> {
    let mut rest = file.get(ATTRIBUTES_START..)?;
    let mut attributes = Vec::new();
    // A zero in place of a name ends the header.
    while *rest.first()? != 0 {
        let (attribute, others) = rest.split_at_checked(attribute_length(rest)?)?;
        attributes.push(attribute);
        rest = others;
    }
    // The zero behind a name is below all letters, so that whole attributes are in the order of their names.
    attributes.sort_unstable();
    let sorted = attributes.concat();
    file.get_mut(ATTRIBUTES_START..)?.get_mut(..sorted.len())?.copy_from_slice(&sorted);
    Some(())
}

/// Length of the attribute at the start of `bytes`: name and type with a zero behind each, size of the value, value.
fn attribute_length(bytes: &[u8]) -> Option<usize> {
    let text_length = |bytes: &[u8]| bytes.iter().position(|&byte| byte == 0).map(|zero| zero + 1);
    let name = text_length(bytes)?;
    let size_start = name + text_length(bytes.get(name..)?)?;
    let size = bytes.get(size_start..)?.first_chunk::<4>()?;
    let value_start = size_start + size.len();
    value_start.checked_add(usize::try_from(i32::from_le_bytes(*size)).ok()?)
}

/// Rounds to half; a light too bright for it stays finite.
fn nearest_half(value: f32) -> f16 {
    let limit = f16::MAX.to_f32();
    f16::from_f32(if value.is_finite() { value.clamp(-limit, limit) } else { value })
}

/// Decodes the first RGB layer, or the first luminance, of an EXR file.
///
/// The image is the file's display window; what the data window leaves out is black, what lies outside is cut off.
/// Half, float and unsigned channels, scan lines and tiles (of these the finest level) are read; alpha and all
/// other channels are not. A luminance channel Y alone becomes grey.
///
/// # Errors
///
/// If the file is damaged, or has only deep or subsampled data, other primaries than BT.709, or neither R, G, B nor Y.
pub fn decode(bytes: &[u8]) -> Result<Image, DecodeError> {
    // The crate's B44 decompressor, for one, overflows on damaged blocks where overflow is checked.
    std::panic::catch_unwind(|| decode_layer(bytes))
        .unwrap_or_else(|_| Err(damaged("a block is inconsistent")))
}

fn decode_layer(bytes: &[u8]) -> Result<Image, DecodeError> {
    let reader = ::exr::block::read(Cursor::new(bytes), false).map_err(decode_error)?;
    let (layer, selection) = select_layer(reader.headers())?;
    let header = &reader.headers()[layer];
    let (placement, mut image) = place(header, bytes.len() as u64)?;
    let channels = header.channels.clone();
    let expected_area = header.layer_size.area();

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
            || block.data.len() != index.pixel_size.area() * channels.bytes_per_pixel
        {
            return Err(damaged("its table of blocks contradicts the blocks"));
        }
        area += index.pixel_size.area();
        copy_block(&block, &channels, &selection, placement, &mut image);
    }
    if area != expected_area {
        return Err(damaged("blocks of the image are missing"));
    }
    Ok(image)
}

/// For each of a layer's channels, which of red, green and blue it is copied to.
type Selection = Vec<[bool; 3]>;

/// Finds the first layer with colour, else the first with luminance.
fn select_layer(headers: &[Header]) -> Result<(usize, Selection), DecodeError> {
    let usable =
        |header: &Header| !header.deep && header.channels.list.iter().all(|c| c.sampling == Vec2(1, 1));
    for select in [select_rgb, select_luminance] {
        for (layer, header) in headers.iter().enumerate().filter(|(_, header)| usable(header)) {
            if let Some(selection) = select(&header.channels) {
                return Ok((layer, selection));
            }
        }
    }
    let mut names: Vec<String> =
        headers.iter().flat_map(|h| &h.channels.list).map(|channel| channel.name.to_string()).collect();
    names.truncate(16);
    let cause = if headers.iter().all(|header| header.deep) {
        "deep data".to_owned()
    } else if !headers.iter().all(usable) {
        "subsampled or deep channels".to_owned()
    } else {
        format!("no channels R, G, B nor Y, only {}", names.join(", "))
    };
    Err(DecodeError::Unsupported { format: "EXR", cause })
}

/// The channels R, G, B, or the first `prefix.R`, `prefix.G`, `prefix.B`.
fn select_rgb(channels: &ChannelList) -> Option<Selection> {
    let names: Vec<String> = channels.list.iter().map(|channel| channel.name.to_string()).collect();
    let prefixes = names.iter().filter_map(|name| name.strip_suffix('R'));
    let mut candidates: Vec<&str> = prefixes.filter(|p| p.is_empty() || p.ends_with('.')).collect();
    candidates.sort_by_key(|prefix| !prefix.is_empty());
    candidates.into_iter().find_map(|prefix| {
        let find = |letter| names.iter().position(|name| *name == format!("{prefix}{letter}"));
        let found = [find('R')?, find('G')?, find('B')?];
        Some((0..names.len()).map(|channel| found.map(|wanted| wanted == channel)).collect())
    })
}

/// The channel Y, unless chroma channels say that it is one part of a coloured image.
fn select_luminance(channels: &ChannelList) -> Option<Selection> {
    let has = |wanted: &str| channels.list.iter().any(|channel| channel.name == *wanted);
    if !has("Y") || has("RY") || has("BY") {
        return None;
    }
    Some(channels.list.iter().map(|channel| [channel.name == *"Y"; 3]).collect())
}

/// Where the data window's top left pixel lies in the image, and the black image.
fn place(header: &Header, file_size: u64) -> Result<((i64, i64), Image), DecodeError> {
    let unsupported = |cause: String| DecodeError::Unsupported { format: "EXR", cause };
    if let Some(found) = header.shared_attributes.chromaticities {
        let pairs = [
            (found.red, BT_709.red),
            (found.green, BT_709.green),
            (found.blue, BT_709.blue),
            (found.white, BT_709.white),
        ];
        // Files round these numbers to two to four digits.
        if pairs.iter().any(|(a, b)| !((a.0 - b.0).abs() < 0.005 && (a.1 - b.1).abs() < 0.005)) {
            return Err(unsupported("primaries other than BT.709's".to_owned()));
        }
    }
    let display = header.shared_attributes.display_window;
    let plausible = MAX_PIXELS.min(FREE_PIXELS + file_size.saturating_mul(PIXELS_PER_BYTE));
    for (name, size) in [("display window", display.size), ("data window", header.layer_size)] {
        if (size.0 as u64).checked_mul(size.1 as u64).is_none_or(|area| area > plausible) {
            return Err(unsupported(format!(
                "its {name} has {} by {} pixels; for {file_size} bytes the limit is {plausible} pixels",
                size.0, size.1
            )));
        }
    }
    let (Ok(width), Ok(height)) = (u32::try_from(display.size.0), u32::try_from(display.size.1)) else {
        return Err(damaged("its display window is out of range"));
    };
    let image = Image::new(width, height).map_err(|error| damaged(&error.to_string()))?;
    let data = header.own_attributes.layer_position;
    let offset = |data: i32, display: i32| i64::from(data) - i64::from(display);
    Ok(((offset(data.0, display.position.0), offset(data.1, display.position.1)), image))
}

/// Copies the selected channels of one block into the image.
fn copy_block(
    block: &UncompressedBlock,
    channels: &ChannelList,
    selection: &Selection,
    (left, top): (i64, i64),
    image: &mut Image,
) {
    let width = image.width() as usize;
    for line in block.lines(channels) {
        let location = line.location;
        let targets = selection[location.channel];
        let Ok(y) = usize::try_from(location.position.y() as i64 + top) else { continue };
        let Some(row) = image.pixels_mut().chunks_exact_mut(width).nth(y).filter(|_| targets != [false; 3])
        else {
            continue;
        };
        let mut put = |i: usize, value: f32| {
            let x = usize::try_from(location.position.x() as i64 + left + i as i64);
            if let Some(pixel) = x.ok().and_then(|x| row.get_mut(x)) {
                for (sample, _) in pixel.iter_mut().zip(targets).filter(|(_, wanted)| *wanted) {
                    *sample = value;
                }
            }
        };
        let (words, pairs) = (line.value.as_chunks::<4>().0, line.value.as_chunks::<2>().0);
        use ::exr::meta::attribute::SampleType as Stored;
        match channels.list[location.channel].sample_type {
            Stored::F16 => {
                pairs.iter().enumerate().for_each(|(i, b)| put(i, f16::from_ne_bytes(*b).to_f32()))
            }
            Stored::F32 => words.iter().enumerate().for_each(|(i, b)| put(i, f32::from_ne_bytes(*b))),
            Stored::U32 => words.iter().enumerate().for_each(|(i, b)| put(i, u32::from_ne_bytes(*b) as f32)),
        }
    }
}

fn damaged(cause: &str) -> DecodeError {
    DecodeError::Damaged { format: "EXR", cause: cause.to_owned() }
}

fn decode_error(error: ::exr::error::Error) -> DecodeError {
    match error {
        ::exr::error::Error::NotSupported(cause) => {
            DecodeError::Unsupported { format: "EXR", cause: cause.into_owned() }
        }
        other => damaged(&other.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Twelve attributes in a hash map come in the same order twice by luck once in 12! times, in the order of their
    /// names as rarely. What is sorted is still the file: the crate reads it, and finds every attribute.
    #[test]
    fn attributes_are_in_the_order_of_their_names() {
        let metadata: Vec<_> = (0..12).rev().map(|i| (format!("key {i:02}"), format!("value {i}"))).collect();
        let image = Image::from_pixels(3, 2, vec![[0.5, 1.0, 2.0]; 6]).unwrap();
        let bytes = encode(&image, SampleType::Float, &metadata).unwrap();
        assert_eq!(bytes, encode(&image, SampleType::Float, &metadata).unwrap());

        let places: Vec<_> = metadata
            .iter()
            .map(|(key, _)| bytes.windows(key.len()).position(|window| window == key.as_bytes()))
            .collect();
        assert!(places.iter().all(Option::is_some) && places.is_sorted_by(|a, b| a > b), "{places:?}");
        let read = ::exr::meta::MetaData::read_from_buffered(&bytes[..], true).unwrap();
        for (key, value) in &metadata {
            let found = &read.headers[0].own_attributes.other[&Text::from(key.as_str())];
            assert_eq!(found, &AttributeValue::Text(Text::from(value.as_str())));
        }
        assert_eq!(decode(&bytes).unwrap(), image);
    }

    /// A file that ends anywhere is refused, or left as it was because its attributes are sorted already.
    #[test]
    fn cut_files_are_refused_or_left_alone() {
        let image = Image::from_pixels(1, 1, vec![[0.5; 3]]).unwrap();
        let bytes = encode(&image, SampleType::Half, &[]).unwrap();
        for end in 0..bytes.len() {
            let mut cut = bytes[..end].to_vec();
            let _ = sort_attributes(&mut cut);
            assert_eq!(cut, bytes[..end], "cut at {end}");
        }
        assert_eq!(sort_attributes(&mut [0; 8]), None);
    }
}
