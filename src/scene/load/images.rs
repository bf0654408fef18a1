//! Image files to textures.

use std::io::Cursor;

use image::{ImageReader, Limits};

use crate::scene::Texture;

/// Sides and memory that a texture may have.
const MAX_SIDE: u32 = 32_768;
const MAX_BYTES: u64 = 4 << 30;

/// Decodes PNG, JPEG, BMP or TGA data.
///
/// # Errors
/// Why it is no image, in words.
pub fn decode(bytes: &[u8]) -> Result<Texture, String> {
    let mut reader =
        ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|error| error.to_string())?;
    if reader.format().is_none() {
        // TGA has no mark to be known by.
        reader.set_format(image::ImageFormat::Tga);
    }
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    limits.max_alloc = Some(MAX_BYTES);
    reader.limits(limits);
    let image = reader.decode().map_err(|error| error.to_string())?.into_rgba8();
    let (width, height) = image.dimensions();
    let texels = image.pixels().map(|pixel| pixel.0).collect();
    Texture::new(width, height, texels).ok_or_else(|| "the image has no pixels".to_owned())
}
