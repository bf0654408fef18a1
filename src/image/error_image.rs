//! Where an image differs from a reference, in false colours.

use super::metrics::{MetricsError, check_sizes};
use super::{Image, is_finite};

/// Colour of pixels that are not finite in one of the images: a green that the colour map does not contain.
pub const NON_FINITE: [u8; 3] = [0, 255, 0];

/// Paints the error of every pixel: the mean over the channels of |a − b|, over the mean of the reference.
///
/// Colours are magma's, a perceptually uniform map: black for no difference, over purple and orange to light yellow
/// for `full_scale` and more. The scale is linear and fixed, so error images can be compared with each other.
/// Returns 8-bit sRGB, row-major from the top left.
///
/// # Errors
///
/// If the sizes of the images differ.
pub fn error_image(image: &Image, reference: &Image, full_scale: f64) -> Result<Vec<[u8; 3]>, MetricsError> {
    check_sizes(image, reference)?;
    let finite = reference.pixels().iter().filter(|pixel| is_finite(pixel));
    let (sum, count) = finite.fold((0.0_f64, 0_u64), |(sum, count), pixel| {
        (sum + pixel.iter().map(|&value| f64::from(value)).sum::<f64>(), count + 3)
    });
    let mean = if count > 0 { (sum / count as f64).abs() } else { 0.0 };
    let colour = |(a, b): (&[f32; 3], &[f32; 3])| {
        if !(is_finite(a) && is_finite(b)) {
            return NON_FINITE;
        }
        let error = a.iter().zip(b).map(|(&a, &b)| (f64::from(a) - f64::from(b)).abs()).sum::<f64>() / 3.0;
        // Equal pixels are black even where the reference is black as a whole and the scale has no meaning.
        let share = if error == 0.0 { 0.0 } else { (error / (mean * full_scale)).clamp(0.0, 1.0) };
        let colour = colorous::MAGMA.eval_continuous(share);
        [colour.r, colour.g, colour.b]
    };
    Ok(image.pixels().iter().zip(reference.pixels()).map(colour).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean of the reference 1, full scale 50 %: differences 0, 0.25, 0.5 and 2 are 0, 1/2, 1 and clamped to 1. The ends
    /// of magma are (0, 0, 4) and (252, 253, 191) in its authors' table, its middle (183, 55, 121).
    #[test]
    fn colours_follow_the_documented_scale() {
        let reference = Image::from_pixels(5, 1, vec![[1.0; 3]; 5]).unwrap();
        let pixels = vec![[1.0; 3], [1.25; 3], [0.5; 3], [3.0; 3], [1.0, f32::NAN, 1.0]];
        let image = Image::from_pixels(5, 1, pixels).unwrap();
        let colours = error_image(&image, &reference, 0.5).unwrap();
        let table = [[0, 0, 4], [183, 55, 121], [252, 253, 191], [252, 253, 191], NON_FINITE];
        for (colour, expected) in colours.iter().zip(&table) {
            // Implementations interpolate the table slightly differently.
            let far = colour.iter().zip(expected).any(|(&a, &b)| a.abs_diff(b) > 2);
            assert!(!far, "{colour:?} is not {expected:?}");
        }
    }
}
