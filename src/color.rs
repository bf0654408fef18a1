//! The transfer function of sRGB (IEC 61966-2-1): between linear light and the values that files and displays hold.

/// Encodes linear light in [0, 1]; values outside are clamped, NaN becomes 0.
pub fn srgb_from_linear(linear: f32) -> f32 {
    let linear = if linear.is_nan() { 0.0 } else { linear.clamp(0.0, 1.0) };
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// Decodes a value in [0, 1] to linear light in [0, 1].
pub fn linear_from_srgb(encoded: f32) -> f32 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is decoded and encoded again is the same of 256 values.
    #[test]
    fn decoding_undoes_encoding() {
        for code in 0..=255_u8 {
            let encoded = srgb_from_linear(linear_from_srgb(f32::from(code) / 255.0));
            assert_eq!((encoded * 255.0).round(), f32::from(code));
        }
    }

    /// The standard's own example of its two pieces: at 0.04045 the straight piece ends, at 0.0031308 of the light.
    #[test]
    fn the_pieces_of_the_curve_meet() {
        assert!((linear_from_srgb(0.040_45) - 0.003_130_8).abs() < 1e-6);
        assert!((linear_from_srgb(0.040_46) - 0.003_130_8).abs() < 2e-6);
    }
}
