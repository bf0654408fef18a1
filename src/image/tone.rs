//! From linear light to the values a display expects.
//!
//! The tone mapping is the plainest there is, so that an image can be compared with other renderers': scale by
//! 2^exposure, encode with the sRGB transfer function, clamp to [0, 1].

use crate::color::srgb_from_linear;

/// Tone-maps one pixel: sRGB values in [0, 1] of linear RGB scaled by 2^`exposure` (in stops).
pub(crate) fn tone_map(pixel: [f32; 3], exposure: f32) -> [f32; 3] {
    let scale = exposure.exp2();
    pixel.map(|value| srgb_from_linear(value * scale))
}

/// Tone-maps one pixel to 8 bits per channel, rounded to nearest.
pub(crate) fn tone_map_8_bit(pixel: [f32; 3], exposure: f32) -> [u8; 3] {
    tone_map(pixel, exposure).map(|value| (value * 255.0).round() as u8)
}

/// Exposure in stops at which an image is neither dark nor washed out: nine tenths of what is lit stay below 60 % of
/// white.
pub fn auto_exposure(pixels: &[[f32; 3]]) -> f32 {
    let luminance = |[r, g, b]: &[f32; 3]| 0.2126 * r + 0.7152 * g + 0.0722 * b;
    let lit = pixels.iter().map(luminance).filter(|l| l.is_finite() && *l > 0.0);
    let mut lit: Vec<f32> = lit.collect();
    if lit.is_empty() {
        return 0.0;
    }
    let tenth = lit.len() * 9 / 10;
    let (_, bright, _) = lit.select_nth_unstable_by(tenth, f32::total_cmp);
    // Quarters of a stop, so that two renders of nearly the same image get the same.
    ((0.6 / *bright).log2() * 4.0).round().clamp(-160.0, 160.0) / 4.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 18 % grey is 46.1 % of full scale, half of the light is 73.5 %: values of the sRGB curve as tabulated in
    /// every colour reference (118 and 188 of 255).
    #[test]
    fn known_greys_get_the_codes_of_the_srgb_standard() {
        assert_eq!(tone_map_8_bit([0.18, 0.5, 1.0], 0.0), [118, 188, 255]);
        assert_eq!(tone_map_8_bit([0.0, 0.003_130_8, 2.0], 0.0), [0, 10, 255]);
    }

    #[test]
    fn one_stop_of_exposure_doubles_the_light() {
        assert_eq!(tone_map([0.1, 0.2, 0.25], 1.0), tone_map([0.2, 0.4, 0.5], 0.0));
        assert_eq!(tone_map([0.5; 3], -1.0), tone_map([0.25; 3], 0.0));
    }

    #[test]
    fn what_a_display_cannot_show_is_clamped() {
        assert_eq!(tone_map_8_bit([f32::NAN, -1.0, f32::INFINITY], 0.0), [0, 0, 255]);
    }
}
