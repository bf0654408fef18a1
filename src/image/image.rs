//! An image in memory.

use super::error::ImageError;

/// Largest number of pixels of an image, 2²⁸: 3 GiB of linear RGB.
pub const MAX_PIXELS: u64 = 1 << 28;

/// An image in linear RGB with BT.709 primaries, row-major from the top left.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    width: u32,
    height: u32,
    pixels: Vec<[f32; 3]>,
}

impl Image {
    /// Makes a black image.
    ///
    /// # Errors
    ///
    /// If a side is 0 or there would be more than [`MAX_PIXELS`] pixels.
    pub fn new(width: u32, height: u32) -> Result<Self, ImageError> {
        let count = checked_area(width, height)?;
        Ok(Self { width, height, pixels: vec![[0.0; 3]; count] })
    }

    /// Makes an image of `pixels`, rows from top to bottom, each from left to right.
    ///
    /// # Errors
    ///
    /// If there are not exactly `width · height` pixels, or none, or more than [`MAX_PIXELS`].
    pub fn from_pixels(width: u32, height: u32, pixels: Vec<[f32; 3]>) -> Result<Self, ImageError> {
        match checked_area(width, height) {
            Ok(count) if count == pixels.len() => Ok(Self { width, height, pixels }),
            _ => Err(ImageError::Size { width, height, pixels: pixels.len() }),
        }
    }

    /// Width in pixels, at least 1.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height in pixels, at least 1.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// All pixels, row-major from the top left.
    pub fn pixels(&self) -> &[[f32; 3]] {
        &self.pixels
    }

    /// All pixels for change, row-major from the top left.
    pub fn pixels_mut(&mut self) -> &mut [[f32; 3]] {
        &mut self.pixels
    }

    /// The pixel in column `x` from the left and row `y` from the top, if there is one.
    pub fn get(&self, x: u32, y: u32) -> Option<[f32; 3]> {
        let inside = x < self.width && y < self.height;
        inside.then(|| self.pixels[y as usize * self.width as usize + x as usize])
    }

    /// Rows from top to bottom.
    pub fn rows(&self) -> std::slice::ChunksExact<'_, [f32; 3]> {
        self.pixels.chunks_exact(self.width as usize)
    }

    /// Mean of each channel; not finite if a pixel is not.
    pub fn mean(&self) -> [f64; 3] {
        let mut sum = [0.0_f64; 3];
        for pixel in &self.pixels {
            for (sum, &value) in sum.iter_mut().zip(pixel) {
                *sum += f64::from(value);
            }
        }
        sum.map(|sum| sum / self.pixels.len() as f64)
    }

    /// Number of pixels with a NaN or infinite channel.
    pub fn non_finite_pixels(&self) -> u64 {
        self.pixels.iter().filter(|pixel| !is_finite(pixel)).count() as u64
    }
}

/// Whether all channels are finite.
pub(crate) fn is_finite(pixel: &[f32; 3]) -> bool {
    pixel.iter().all(|value| value.is_finite())
}

/// `width · height`, if an image may have that many pixels.
fn checked_area(width: u32, height: u32) -> Result<usize, ImageError> {
    let area = u64::from(width) * u64::from(height);
    match usize::try_from(area) {
        Ok(count) if (1..=MAX_PIXELS).contains(&area) => Ok(count),
        _ => Err(ImageError::Size { width, height, pixels: 0 }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_image_has_exactly_as_many_pixels_as_its_sides_say() {
        assert!(Image::from_pixels(2, 2, vec![[0.0; 3]; 4]).is_ok());
        assert!(Image::from_pixels(2, 2, vec![[0.0; 3]; 3]).is_err());
        assert!(Image::from_pixels(0, 0, Vec::new()).is_err());
        assert!(Image::new(0, 5).is_err());
        assert!(Image::new(u32::MAX, u32::MAX).is_err());
    }

    #[test]
    fn mean_is_taken_per_channel_and_non_finite_pixels_are_counted_once_each() {
        let mut image = Image::from_pixels(2, 1, vec![[1.0, 2.0, 3.0], [3.0, 2.0, 5.0]]).unwrap();
        assert_eq!(image.mean(), [2.0, 2.0, 4.0]);
        assert_eq!(image.non_finite_pixels(), 0);
        image.pixels_mut()[1] = [f32::NAN, f32::INFINITY, 0.0];
        assert_eq!(image.non_finite_pixels(), 1);
    }

    #[test]
    fn pixels_are_addressed_from_the_top_left() {
        let pixels = (0..6).map(|i| [i as f32; 3]).collect();
        let image = Image::from_pixels(3, 2, pixels).unwrap();
        assert_eq!(image.get(2, 0), Some([2.0; 3]));
        assert_eq!(image.get(0, 1), Some([3.0; 3]));
        assert_eq!(image.get(3, 0), None);
        assert_eq!(image.get(0, 2), None);
    }
}
