//! How far an image is from a reference.
//!
//! All sums run over pixels that are finite in both images; the others are counted and left out.

use super::tone::tone_map;
use super::{Image, is_finite};

/// Side of the blocks of [`Metrics::block_mean_relative_error`], in pixels.
const BLOCK: usize = 8;

/// Relative errors divide by at least this share of the reference's mean, so that a pixel that is black in the
/// reference counts in proportion to the image and not by a division by almost zero.
const DARKEST: f64 = 0.01;

/// Two images that cannot be compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MetricsError {
    /// The sides differ.
    #[error("the images differ in size: {}x{} and {}x{} pixels", .0.0, .0.1, .1.0, .1.1)]
    Sizes((u32, u32), (u32, u32)),
}

/// How the images are compared.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MetricsOptions {
    /// Exposure in stops of the tone mapping before PSNR and FLIP.
    pub exposure: f32,
    /// A pixel differs if a channel differs by more than this share of the reference's mean; without it, if any
    /// bit differs.
    pub threshold: Option<f64>,
}

/// The largest difference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaxDifference {
    /// Absolute difference in one channel, linear.
    pub value: f64,
    /// Column from the left and row from the top.
    pub pixel: (u32, u32),
    /// 0 red, 1 green, 2 blue.
    pub channel: usize,
}

/// Differences between an image and its reference. `None` where a number is not defined.
#[derive(Clone, Debug, PartialEq)]
pub struct Metrics {
    /// Root of the mean squared difference over all channels, linear.
    pub rmse: Option<f64>,
    /// [`rmse`](Self::rmse) over the mean of all channels of the reference; undefined for a black reference.
    pub relative_rmse: Option<f64>,
    /// Mean over the pixels of Σ|a − b| / max(Σ|b|, 3 · 1 % of the reference's mean), sums over the channels.
    pub mean_relative_error: Option<f64>,
    /// The same of means of 8×8-pixel blocks, in which the noise of path-traced references averages out. Blocks
    /// cut by the right and lower edge count by their pixels.
    pub block_mean_relative_error: Option<f64>,
    /// Peak signal-to-noise ratio in dB of the tone-mapped images (not rounded to 8 bits), peak 1; undefined
    /// if these are equal.
    pub psnr: Option<f64>,
    /// Mean FLIP error of the tone-mapped 8-bit images at 67 pixels per degree: 0 equal, 1 black against white.
    /// Undefined above 2²⁵ pixels and without the feature `flip`.
    pub flip: Option<f64>,
    /// The largest difference; undefined without finite pixels.
    pub max: Option<MaxDifference>,
    /// Pixels that differ by [`MetricsOptions::threshold`], those counted as not finite included unless their
    /// bits are equal.
    pub differing_pixels: u64,
    /// Pixels of the image with a NaN or infinite channel.
    pub non_finite_pixels: u64,
    /// The same of the reference.
    pub reference_non_finite_pixels: u64,
    /// Mean of all channels of the image over the pixels compared.
    pub mean: Option<f64>,
    /// The same of the reference.
    pub reference_mean: Option<f64>,
}

/// Compares `image` with `reference`.
///
/// # Errors
///
/// If their sizes differ.
pub fn compare(image: &Image, reference: &Image, options: MetricsOptions) -> Result<Metrics, MetricsError> {
    check_sizes(image, reference)?;
    let pairs = || image.pixels().iter().zip(reference.pixels());
    let finite = || pairs().filter(|(a, b)| is_finite(a) && is_finite(b));

    let mut count = 0_u64;
    let (mut sum, mut reference_sum, mut squares, mut display_squares) = (0.0_f64, 0.0_f64, 0.0_f64, 0.0_f64);
    for (a, b) in finite() {
        count += 1;
        let shown = (tone_map(*a, options.exposure), tone_map(*b, options.exposure));
        for channel in 0..3 {
            let (value, wanted) = (f64::from(a[channel]), f64::from(b[channel]));
            sum += value;
            reference_sum += wanted;
            squares += (value - wanted).powi(2);
            display_squares += f64::from(shown.0[channel] - shown.1[channel]).powi(2);
        }
    }
    let over_samples = |sum: f64| (count > 0).then(|| sum / (3 * count) as f64);
    let rmse = over_samples(squares).map(f64::sqrt);
    let reference_mean = over_samples(reference_sum);
    let scale = reference_mean.unwrap_or(0.0).abs();
    let display_mse = over_samples(display_squares);

    let darkest = 3.0 * DARKEST * scale;
    let relative: f64 = finite().map(|(a, b)| relative_error(&to_f64(a), &to_f64(b), darkest)).sum();

    let threshold = options.threshold.map(|share| share * scale);
    Ok(Metrics {
        rmse,
        relative_rmse: rmse.and_then(|rmse| ratio(rmse, scale)),
        mean_relative_error: (count > 0).then(|| relative / count as f64).filter(|v| v.is_finite()),
        block_mean_relative_error: block_error(image, reference, darkest),
        psnr: display_mse.filter(|&mse| mse > 0.0).map(|mse| -10.0 * mse.log10()),
        flip: (count > 0).then(|| flip(image, reference, options.exposure)).flatten(),
        max: max_difference(image, reference),
        differing_pixels: pairs().filter(|(a, b)| differ(a, b, threshold)).count() as u64,
        non_finite_pixels: image.non_finite_pixels(),
        reference_non_finite_pixels: reference.non_finite_pixels(),
        mean: over_samples(sum),
        reference_mean,
    })
}

/// Refuses images of different sizes.
pub(super) fn check_sizes(image: &Image, reference: &Image) -> Result<(), MetricsError> {
    let size = |image: &Image| (image.width(), image.height());
    if size(image) == size(reference) {
        Ok(())
    } else {
        Err(MetricsError::Sizes(size(image), size(reference)))
    }
}

fn to_f64(pixel: &[f32; 3]) -> [f64; 3] {
    pixel.map(f64::from)
}

/// `a / b`, where 0 / 0 is 0 (equal images have no error) and anything else over 0 is undefined.
fn ratio(a: f64, b: f64) -> Option<f64> {
    if a == 0.0 { Some(0.0) } else { Some(a / b).filter(|quotient| quotient.is_finite()) }
}

/// Σ|a − b| / max(Σ|b|, `darkest`): infinite if only the denominator is 0.
fn relative_error(a: &[f64; 3], b: &[f64; 3], darkest: f64) -> f64 {
    let difference: f64 = a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum();
    let size = b.iter().map(|b| b.abs()).sum::<f64>().max(darkest);
    if difference == 0.0 { 0.0 } else { difference / size }
}

/// Mean relative error of block means, weighted by the blocks' pixels.
fn block_error(image: &Image, reference: &Image, darkest: f64) -> Option<f64> {
    let (width, height) = (image.width() as usize, image.height() as usize);
    let (mut weighted, mut pixels) = (0.0_f64, 0_u64);
    for top in (0..height).step_by(BLOCK) {
        for left in (0..width).step_by(BLOCK) {
            let (mut sums, mut count) = (([0.0_f64; 3], [0.0_f64; 3]), 0_u64);
            for y in top..(top + BLOCK).min(height) {
                let row = y * width + left..y * width + (left + BLOCK).min(width);
                let row = image.pixels()[row.clone()].iter().zip(&reference.pixels()[row]);
                for (a, b) in row.filter(|(a, b)| is_finite(a) && is_finite(b)) {
                    count += 1;
                    for channel in 0..3 {
                        sums.0[channel] += f64::from(a[channel]);
                        sums.1[channel] += f64::from(b[channel]);
                    }
                }
            }
            if count > 0 {
                let mean = |sum: [f64; 3]| sum.map(|sum| sum / count as f64);
                weighted += relative_error(&mean(sums.0), &mean(sums.1), darkest) * count as f64;
                pixels += count;
            }
        }
    }
    (pixels > 0).then(|| weighted / pixels as f64).filter(|v| v.is_finite())
}

/// The largest difference of one channel, the first in reading order among equals.
fn max_difference(image: &Image, reference: &Image) -> Option<MaxDifference> {
    let mut largest: Option<MaxDifference> = None;
    for (i, (a, b)) in image.pixels().iter().zip(reference.pixels()).enumerate() {
        if !(is_finite(a) && is_finite(b)) {
            continue;
        }
        for channel in 0..3 {
            let value = (f64::from(a[channel]) - f64::from(b[channel])).abs();
            if largest.is_none_or(|largest| value > largest.value) {
                let width = image.width() as usize;
                let pixel = ((i % width) as u32, (i / width) as u32);
                largest = Some(MaxDifference { value, pixel, channel });
            }
        }
    }
    largest
}

/// Whether two pixels differ: by any bit, or in a channel by more than `threshold`.
fn differ(a: &[f32; 3], b: &[f32; 3], threshold: Option<f64>) -> bool {
    let same_bits = a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits());
    match threshold {
        _ if same_bits => false,
        // A comparison with NaN is false, so a NaN differs.
        Some(limit) => !a.iter().zip(b).all(|(&a, &b)| (f64::from(a) - f64::from(b)).abs() <= limit),
        None => true,
    }
}

/// Mean FLIP error, or `None` for images too large for it. Pixels that are not finite in one image are black
/// in both.
#[cfg(feature = "flip")]
fn flip(image: &Image, reference: &Image, exposure: f32) -> Option<f64> {
    use nv_flip::{DEFAULT_PIXELS_PER_DEGREE, FlipImageRgb8};

    // The library takes some 100 bytes per pixel and ends the process when there are none left; 8K fits.
    const MAX_FLIP_PIXELS: u64 = 1 << 25;
    if image.pixels().len() as u64 > MAX_FLIP_PIXELS {
        return None;
    }
    let codes = |shown: &Image, other: &Image| {
        let pixel = |(pixel, other): (&[f32; 3], &[f32; 3])| {
            let pixel = if is_finite(pixel) && is_finite(other) { *pixel } else { [0.0; 3] };
            super::tone::tone_map_8_bit(pixel, exposure)
        };
        let codes: Vec<[u8; 3]> = shown.pixels().iter().zip(other.pixels()).map(pixel).collect();
        FlipImageRgb8::with_data(shown.width(), shown.height(), codes.as_flattened())
    };
    let errors = nv_flip::flip(codes(reference, image), codes(image, reference), DEFAULT_PIXELS_PER_DEGREE);
    let errors = errors.to_vec();
    Some(errors.iter().map(|&error| f64::from(error)).sum::<f64>() / errors.len() as f64)
}

/// Without the feature `flip` the number is not defined.
#[cfg(not(feature = "flip"))]
fn flip(_: &Image, _: &Image, _: f32) -> Option<f64> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn make(width: u32, height: u32, pixels: &[[f32; 3]]) -> Image {
        Image::from_pixels(width, height, pixels.to_vec()).unwrap()
    }

    fn close(value: Option<f64>, expected: f64) {
        let value = value.unwrap();
        assert!((value - expected).abs() <= 1e-6 * expected.abs(), "{value} is not {expected}");
    }

    /// Differences 0.5, 0, 0 | 0, 0, −0.25: squares sum to 0.3125, over 6 samples 0.0520833. The reference's mean is
    /// 4.5 / 6 = 0.75. Relative: 0.5 / 3 and 0.25 / 1.5, both 1/6.
    #[test]
    fn errors_agree_with_sums_by_hand() {
        let reference = make(2, 1, &[[1.0, 1.0, 1.0], [0.5, 0.5, 0.5]]);
        let image = make(2, 1, &[[1.5, 1.0, 1.0], [0.5, 0.5, 0.25]]);
        let metrics = compare(&image, &reference, MetricsOptions::default()).unwrap();
        let rmse = (0.3125_f64 / 6.0).sqrt();
        close(metrics.rmse, rmse);
        close(metrics.relative_rmse, rmse / 0.75);
        close(metrics.mean_relative_error, 1.0 / 6.0);
        // One block: means (1, 0.75, 0.625) against 0.75: (0.25 + 0.125) / 2.25.
        close(metrics.block_mean_relative_error, 0.375 / 2.25);
        assert_eq!(metrics.max, Some(MaxDifference { value: 0.5, pixel: (0, 0), channel: 0 }));
        assert_eq!(metrics.differing_pixels, 2);
        close(metrics.mean, 4.75 / 6.0);
    }

    /// Tone-mapped, 0 against 1 in one of twelve samples: −10 log10(1/12) = 10.79 dB; what is above 1 is clamped.
    #[test]
    fn psnr_is_that_of_the_displayed_image() {
        let reference = make(2, 2, &[[0.0; 3], [1.0; 3], [1.0; 3], [0.0; 3]]);
        let image = make(2, 2, &[[1.0, 0.0, 0.0], [5.0; 3], [1.0; 3], [-1.0; 3]]);
        let metrics = compare(&image, &reference, MetricsOptions::default()).unwrap();
        close(metrics.psnr, 10.0 * 12.0_f64.log10());
    }

    #[test]
    fn equal_images_have_no_error_even_if_black() {
        for value in [0.0, 0.7] {
            let same = make(9, 1, &[[value; 3]; 9]);
            let metrics = compare(&same, &same, MetricsOptions::default()).unwrap();
            let zeros = [metrics.rmse, metrics.relative_rmse, metrics.mean_relative_error];
            assert_eq!(zeros, [Some(0.0); 3]);
            assert_eq!(metrics.block_mean_relative_error, Some(0.0));
            assert_eq!((metrics.psnr, metrics.differing_pixels), (None, 0));
        }
    }

    #[test]
    fn errors_relative_to_a_black_reference_are_undefined() {
        let metrics =
            compare(&make(1, 1, &[[1.0; 3]]), &make(1, 1, &[[0.0; 3]]), MetricsOptions::default()).unwrap();
        close(metrics.rmse, 1.0);
        assert_eq!((metrics.relative_rmse, metrics.mean_relative_error), (None, None));
    }

    /// The reference's mean is 0.5, a hundredth of it 0.005: 0.001 against black is an error of 0.2 in that pixel.
    #[test]
    fn black_pixels_count_in_proportion_to_the_image() {
        let reference = make(2, 1, &[[0.0; 3], [1.0; 3]]);
        let image = make(2, 1, &[[0.001; 3], [1.0; 3]]);
        let metrics = compare(&image, &reference, MetricsOptions::default()).unwrap();
        close(metrics.mean_relative_error, 0.1);
    }

    /// Noise of ±0.5 that cancels in each 8×8 block is no error of the block means, also not in the cut block.
    #[test]
    fn noise_averages_out_in_block_means() {
        let reference = make(10, 8, &[[1.0; 3]; 80]);
        let noisy: Vec<[f32; 3]> = (0..80).map(|i| [if i % 2 == 0 { 0.5 } else { 1.5 }; 3]).collect();
        let metrics = compare(&make(10, 8, &noisy), &reference, MetricsOptions::default()).unwrap();
        assert_eq!(metrics.block_mean_relative_error, Some(0.0));
        close(metrics.mean_relative_error, 0.5);
    }

    #[test]
    fn non_finite_pixels_are_counted_and_left_out() {
        let reference = make(4, 1, &[[1.0; 3], [1.0; 3], [f32::INFINITY; 3], [1.0; 3]]);
        let image = make(4, 1, &[[1.5; 3], [1.0, f32::NAN, 1.0], [1.0; 3], [1.0; 3]]);
        let metrics = compare(&image, &reference, MetricsOptions::default()).unwrap();
        assert_eq!((metrics.non_finite_pixels, metrics.reference_non_finite_pixels), (1, 1));
        close(metrics.rmse, 0.125_f64.sqrt());
        assert_eq!(metrics.max.unwrap().pixel, (0, 0));
        assert_eq!(metrics.differing_pixels, 3);

        let nothing = compare(
            &make(1, 1, &[[f32::NAN; 3]]),
            &make(1, 1, &[[1.0; 3]]),
            MetricsOptions { threshold: Some(10.0), ..MetricsOptions::default() },
        )
        .unwrap();
        assert_eq!((nothing.rmse, nothing.flip, nothing.max), (None, None, None));
        assert_eq!(nothing.differing_pixels, 1);
    }

    /// The reference's mean is 1: differences of 0.01 and 0.03 lie on both sides of 2 %.
    #[test]
    fn the_threshold_is_a_share_of_the_references_mean() {
        let reference = make(3, 1, &[[1.0; 3]; 3]);
        let image = make(3, 1, &[[1.0; 3], [1.01; 3], [1.0, 1.0, 1.03]]);
        let count = |threshold| {
            compare(&image, &reference, MetricsOptions { threshold, ..MetricsOptions::default() })
                .unwrap()
                .differing_pixels
        };
        assert_eq!((count(None), count(Some(0.02)), count(Some(0.5))), (2, 1, 0));
    }

    #[test]
    fn images_of_different_sizes_are_not_compared() {
        let error =
            compare(&make(2, 1, &[[0.0; 3]; 2]), &make(1, 2, &[[0.0; 3]; 2]), MetricsOptions::default());
        assert_eq!(error, Err(MetricsError::Sizes((2, 1), (1, 2))));
    }

    /// FLIP is 0 for equal images, and close to 1, its largest value, for black against white.
    #[cfg(feature = "flip")]
    #[test]
    fn flip_spans_from_equal_to_black_against_white() {
        let (black, white) = (make(32, 32, &[[0.0; 3]; 1024]), make(32, 32, &[[1.0; 3]; 1024]));
        let flip = |a, b| compare(a, b, MetricsOptions::default()).unwrap().flip.unwrap();
        assert_eq!(flip(&white, &white), 0.0);
        assert!(flip(&black, &white) > 0.95);
    }
}
