//! Reading the colours of an EXR file.

use ::exr::block::UncompressedBlock;
use ::exr::math::Vec2;
use ::exr::meta::attribute::{ChannelList, SampleType as Stored};
use ::exr::meta::header::Header;
use ::exr::prelude::f16;

use super::BT_709;
use super::blocks::{check_sizes, damaged, offset, open, read_blocks, unsupported, without_panic};
use crate::image::{DecodeError, Image};

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
    without_panic(|| decode_layer(bytes))
}

fn decode_layer(bytes: &[u8]) -> Result<Image, DecodeError> {
    let reader = open(bytes)?;
    let (layer, selection) = select_layer(reader.headers())?;
    let header = &reader.headers()[layer];
    let (placement, mut image) = place(header, bytes.len() as u64)?;
    let channels = header.channels.clone();
    read_blocks(reader, layer, |block| copy_block(block, &channels, &selection, placement, &mut image))?;
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
    Err(unsupported(cause))
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
    check_sizes(header, file_size)?;
    let size = header.shared_attributes.display_window.size;
    let (Ok(width), Ok(height)) = (u32::try_from(size.0), u32::try_from(size.1)) else {
        return Err(damaged("its display window is out of range"));
    };
    let image = Image::new(width, height).map_err(|error| damaged(&error.to_string()))?;
    Ok((offset(header), image))
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
        match channels.list[location.channel].sample_type {
            Stored::F16 => {
                pairs.iter().enumerate().for_each(|(i, b)| put(i, f16::from_ne_bytes(*b).to_f32()))
            }
            Stored::F32 => words.iter().enumerate().for_each(|(i, b)| put(i, f32::from_ne_bytes(*b))),
            Stored::U32 => words.iter().enumerate().for_each(|(i, b)| put(i, u32::from_ne_bytes(*b) as f32)),
        }
    }
}
