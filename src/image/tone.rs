//! From linear light to the values a display expects, and back.
//!
//! The tone mapping is the plainest there is, so that a picture can be compared with other renderers': scale by
//! 2^exposure, encode with the sRGB transfer function (IEC 61966-2-1), clamp to [0, 1].

/// Encodes linear light in [0, 1] with the sRGB transfer function; values outside are clamped, NaN becomes 0.
pub fn srgb_from_linear(linear: f32) -> f32 {
    let linear = if linear.is_nan() { 0.0 } else { linear.clamp(0.0, 1.0) };
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// Decodes an sRGB value in [0, 1] to linear light in [0, 1].
pub fn linear_from_srgb(encoded: f32) -> f32 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// Tone-maps one pixel: sRGB values in [0, 1] of linear RGB scaled by 2^`exposure` (in stops).
pub fn tone_map(pixel: [f32; 3], exposure: f32) -> [f32; 3] {
    let scale = exposure.exp2();
    pixel.map(|value| srgb_from_linear(value * scale))
}

/// Tone-maps one pixel to 8 bits per channel, rounded to nearest.
pub fn tone_map_8_bit(pixel: [f32; 3], exposure: f32) -> [u8; 3] {
    tone_map(pixel, exposure).map(|value| (value * 255.0).round() as u8)
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

    #[test]
    fn decoding_undoes_encoding() {
        for code in 0..=255_u8 {
            let linear = linear_from_srgb(f32::from(code) / 255.0);
            assert_eq!(tone_map_8_bit([linear; 3], 0.0), [code; 3]);
        }
    }
}
