//! Writing EXR files.

use std::io::Cursor;

use ::exr::error::{Error, Result};
use ::exr::image::write::WritableImage as _;
use ::exr::image::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image as ExrImage, Layer};
use ::exr::math::Vec2;
use ::exr::meta::attribute::{AttributeValue, IntegerBounds, Text};
use ::exr::meta::header::{ImageAttributes, LayerAttributes};
use ::exr::prelude::{Blocks, Compression, LineOrder};

use super::{BT_709, Channel, ChannelImage, DataWindow, SampleType, Samples};
use crate::image::{self, Image};

/// Encodes `image` as one layer with the channels R, G, B, compressed with ZIP in blocks of 16 rows.
///
/// `metadata` becomes string attributes of these names. The same image and metadata give the same bytes.
///
/// # Errors
///
/// If a metadata key is no valid attribute name.
pub fn encode(image: &Image, sample_type: SampleType, metadata: &[(String, String)]) -> Result<Vec<u8>> {
    let display = (image.width(), image.height());
    encode_part(image, display, image::Window::whole(display), sample_type, metadata)
}

/// The same for a part of a picture whose width and height are `display`: `window` says where it lies.
///
/// # Errors
///
/// As for [`encode`], or if the part is not as large as its window, or lies beyond the picture.
pub fn encode_part(
    part: &Image,
    display: (u32, u32),
    window: image::Window,
    sample_type: SampleType,
    metadata: &[(String, String)],
) -> Result<Vec<u8>> {
    let beyond = || Error::Invalid("a part beyond the picture".into());
    let mut file = ChannelImage::new(display, DataWindow::try_from(window).map_err(|_| beyond())?);
    for (index, name) in ["R", "G", "B"].into_iter().enumerate() {
        let values = part.pixels().iter().map(|pixel| pixel[index]);
        file.channels.push(Channel::new(name, Samples::of(sample_type, values)));
    }
    file.metadata = metadata.to_vec();
    encode_channels(file)
}

/// Encodes named channels as one part, compressed with ZIP in blocks of 16 rows; channels are stored in the order of their names.
///
/// `metadata` becomes string attributes of these names, in the order of the names. The same channels and metadata give the same bytes.
///
/// # Errors
///
/// If there is no channel; if two have the same name, a name is empty, or one has not a sample per pixel of the data window; if that
/// window is empty or leaves the display window; if a metadata key is no valid attribute name, or one that the format gives another type.
pub fn encode_channels(image: ChannelImage) -> Result<Vec<u8>> {
    image.check().map_err(|cause| Error::Invalid(cause.into()))?;
    let ChannelImage { display, window, channels, metadata } = image;
    let channels = channels.into_iter().map(|Channel { name, samples }| {
        let samples = match samples {
            Samples::Half(values) => FlatSamples::F16(values),
            Samples::Float(values) => FlatSamples::F32(values),
            Samples::Whole(values) => FlatSamples::U32(values),
        };
        AnyChannel::new(text(&name), samples)
    });
    let channels = AnyChannels::sort(channels.collect());
    let mut attributes = LayerAttributes {
        software_name: Some(Text::from("lightmesh")),
        layer_position: Vec2(window.x, window.y),
        ..LayerAttributes::default()
    };
    for (key, value) in &metadata {
        let value = text(value);
        // The crate has fields of their own for these, and takes them nowhere else.
        match key.as_str() {
            "capDate" => attributes.capture_date = Some(value),
            "comments" => attributes.comments = Some(value),
            "owner" => attributes.owner = Some(value),
            _ => drop(attributes.other.insert(text(key), AttributeValue::Text(value))),
        }
    }
    let encoding = Encoding {
        compression: Compression::ZIP16,
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let size = |width: u32, height: u32| Vec2(width as usize, height as usize);
    let layer = Layer::new(size(window.width, window.height), attributes, encoding, channels);
    let display = IntegerBounds::from_dimensions(size(display.0, display.1));
    let mut file = ExrImage::new(ImageAttributes::new(display), layer);
    file.attributes.chromaticities = Some(BT_709);
    let mut bytes = Cursor::new(Vec::new());
    file.write().to_buffered(&mut bytes)?;
    let mut bytes = bytes.into_inner();
    sort_attributes(&mut bytes).ok_or(Error::Invalid("attributes of the header".into()))?;
    Ok(bytes)
}

/// Texts of the format are bytes; other programs write and expect UTF-8.
fn text(string: &str) -> Text {
    Text::from_slice_unchecked(string.as_bytes())
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::exr::decode;

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
