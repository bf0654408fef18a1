//! PNG: tone-mapped sRGB out, any PNG in.

use std::borrow::Cow;

use ::png::{BitDepth, ColorType, Compression, Decoder, Encoder, SrgbRenderingIntent, Transformations};
use rayon::prelude::*;

use super::tone::tone_map_8_bit;
use super::{DecodeError, Image, MAX_PIXELS};
use crate::color::linear_from_srgb;

/// First bytes of every PNG file.
pub(crate) const SIGNATURE: [u8; 8] = [0x89, b'P', b'N', b'G', 0x0d, 0x0a, 0x1a, 0x0a];

/// Deflate's largest ratio of output to input, rounded up; a file that claims more pixels than that is damaged.
const MAX_DEFLATE_RATIO: u64 = 1040;

/// Encodes `image` as 8-bit sRGB, tone-mapped with `exposure` in stops.
///
/// `metadata` becomes text chunks. Pixels that are not a number come out black.
///
/// # Errors
///
/// If a metadata key is not 1 to 79 Latin-1 characters.
pub fn encode(
    image: &Image,
    exposure: f32,
    metadata: &[(String, String)],
) -> Result<Vec<u8>, ::png::EncodingError> {
    let rgb: Vec<[u8; 3]> = image.pixels().par_iter().map(|&pixel| tone_map_8_bit(pixel, exposure)).collect();
    encode_rgb8(image.width(), image.height(), &rgb, metadata)
}

/// Encodes 8-bit sRGB pixels, row-major from the top left.
///
/// # Errors
///
/// As [`encode`], and if the number of pixels is not `width · height`.
pub fn encode_rgb8(
    width: u32,
    height: u32,
    rgb: &[[u8; 3]],
    metadata: &[(String, String)],
) -> Result<Vec<u8>, ::png::EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, width, height);
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_source_srgb(SrgbRenderingIntent::Perceptual);
    // Balanced compression saves a quarter of the bytes, and takes twenty times as long: longer than to render the image.
    encoder.set_compression(Compression::Fast);
    for (key, value) in metadata {
        // tEXt holds Latin-1 only; the newer iTXt holds everything, but fewer programs show it.
        if value.chars().all(|c| u32::from(c) < 256) {
            encoder.add_text_chunk(key.clone(), value.clone())?;
        } else {
            encoder.add_itxt_chunk(key.clone(), value.clone())?;
        }
    }
    let mut writer = encoder.write_header()?;
    writer.write_image_data(rgb.as_flattened())?;
    writer.finish()?;
    Ok(bytes)
}

/// Texts that the file's chunks before its pixels hold; none if it is damaged there.
pub fn metadata(bytes: &[u8]) -> Vec<(String, String)> {
    let Ok(reader) = Decoder::new(std::io::Cursor::new(bytes)).read_info() else { return Vec::new() };
    let info = reader.info();
    let latin = info.uncompressed_latin1_text.iter().map(|chunk| (chunk.keyword.clone(), chunk.text.clone()));
    let other =
        info.utf8_text.iter().filter_map(|chunk| Some((chunk.keyword.clone(), chunk.get_text().ok()?)));
    latin.chain(other).collect()
}

/// Decodes a PNG of any colour type and depth to linear RGB.
///
/// The transfer function is sRGB, unless the file has a gAMA chunk with another exponent and no sRGB chunk.
/// Transparent pixels are put over black, which is also what an EXR file's premultiplied colours mean. An
/// animation's first frame is read.
///
/// # Errors
///
/// If the file is damaged or larger than an image may be.
pub fn decode(bytes: &[u8]) -> Result<Image, DecodeError> {
    let damaged = |cause: String| DecodeError::Damaged { format: "PNG", cause };
    let too_large = |cause: String| DecodeError::Unsupported { format: "PNG", cause };

    let mut decoder = Decoder::new(std::io::Cursor::new(bytes));
    decoder.set_transformations(Transformations::EXPAND);
    decoder.set_ignore_text_chunk(true);
    decoder.set_ignore_iccp_chunk(true);
    let header = decoder.read_header_info().map_err(|error| damaged(error.to_string()))?;
    let (width, height) = header.size();
    let area = u64::from(width) * u64::from(height);
    if area > MAX_PIXELS {
        return Err(too_large(format!("{width} by {height} pixels; the limit is {MAX_PIXELS} pixels")));
    }
    let row_bits = u64::from(width) * header.bits_per_pixel() as u64;
    if row_bits.div_ceil(8) * u64::from(height) > bytes.len() as u64 * MAX_DEFLATE_RATIO {
        return Err(damaged(format!("{} bytes cannot hold {width} by {height} pixels", bytes.len())));
    }

    let mut reader = decoder.read_info().map_err(|error| damaged(error.to_string()))?;
    let size = reader.output_buffer_size().ok_or_else(|| too_large("too many pixels".to_owned()))?;
    let mut samples = vec![0; size];
    let frame = reader.next_frame(&mut samples).map_err(|error| damaged(error.to_string()))?;
    samples.truncate(frame.buffer_size());
    let gamma = exponent(reader.info());

    let channels = match frame.color_type {
        ColorType::Grayscale => 1,
        ColorType::GrayscaleAlpha => 2,
        ColorType::Rgb => 3,
        ColorType::Rgba => 4,
        ColorType::Indexed => return Err(damaged("a palette image without palette".to_owned())),
    };
    let values: Cow<[u16]> = match frame.bit_depth {
        BitDepth::Sixteen => {
            samples.chunks_exact(2).map(|b| u16::from_be_bytes([b[0], b[1]])).collect::<Vec<_>>().into()
        }
        // 257 = 65535 / 255 keeps full scale.
        _ => samples.iter().map(|&b| u16::from(b) * 257).collect::<Vec<_>>().into(),
    };
    let pixels = values.chunks_exact(channels).map(|sample| pixel(sample, gamma)).collect();
    Image::from_pixels(frame.width, frame.height, pixels).map_err(|error| damaged(error.to_string()))
}

/// The exponent of the file's transfer function, if it is a pure power other than sRGB's neighbour 1/2.2.
fn exponent(info: &::png::Info<'_>) -> Option<f32> {
    let gamma = info.gamma()?.into_value();
    let is_srgb = info.srgb.is_some() || (gamma - 1.0 / 2.2).abs() < 0.01 || gamma <= 0.0;
    (!is_srgb).then_some(1.0 / gamma)
}

/// One pixel of 1 to 4 samples (grey, grey-alpha, RGB, RGBA) as linear RGB over black.
fn pixel(sample: &[u16], gamma: Option<f32>) -> [f32; 3] {
    let scaled = |value: u16| f32::from(value) / 65535.0;
    let linear = |value: u16| match gamma {
        Some(exponent) => scaled(value).powf(exponent),
        None => linear_from_srgb(scaled(value)),
    };
    let (rgb, alpha) = match *sample {
        [grey] => ([grey; 3], u16::MAX),
        [grey, alpha] => ([grey; 3], alpha),
        [r, g, b] => ([r, g, b], u16::MAX),
        [r, g, b, alpha] => ([r, g, b], alpha),
        _ => ([0; 3], 0),
    };
    rgb.map(|value| linear(value) * scaled(alpha))
}
