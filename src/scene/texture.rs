//! Textures: images that vary a material over a surface.

use std::sync::Arc;

use glam::{Affine2, Vec2, Vec3};

use crate::color::linear_from_srgb;

/// Image with colours and coverage, 8 bits each as in the file; colours are sRGB-encoded.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Texture {
    width: u32,
    height: u32,
    texels: Vec<[u8; 4]>,
}

/// What happens to texture coordinates outside of [0, 1].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// The image repeats.
    #[default]
    Repeat,
    /// The image repeats, every other time mirrored.
    Mirror,
    /// The border's texels go on.
    Clamp,
}

/// A texture as a material uses it.
#[derive(Clone, Debug, PartialEq)]
pub struct TextureMap {
    /// The image.
    pub texture: Arc<Texture>,
    /// Applied to the vertices' texture coordinates; (0, 0) is the image's upper left corner after that.
    pub transform: Affine2,
    /// Outside of the image, by axis.
    pub wrap: [Wrap; 2],
}

impl Texture {
    /// Image of `width` · `height` RGBA texels, rows from the top; `None` if their number differs or is 0.
    pub fn new(width: u32, height: u32, texels: Vec<[u8; 4]>) -> Option<Self> {
        let count = u64::from(width) * u64::from(height);
        (count > 0 && texels.len() as u64 == count).then_some(Self { width, height, texels })
    }

    /// Width, height and texels.
    pub(super) fn contents(&self) -> (u32, u32, &[[u8; 4]]) {
        (self.width, self.height, &self.texels)
    }

    /// Whether some texel is not fully opaque.
    pub(super) fn has_transparency(&self) -> bool {
        self.texels.iter().any(|texel| texel[3] != u8::MAX)
    }

    /// The same image with the grey value (the red channel) of another one as coverage, resampled where sizes differ.
    pub(super) fn with_coverage(&self, coverage: &Self) -> Self {
        let scale = |at: u32, from: u32, to: u32| (u64::from(at) * u64::from(to) / u64::from(from)) as u32;
        let mut texels = self.texels.clone();
        for (row, line) in (0..self.height).zip(texels.chunks_mut(self.width as usize)) {
            for (column, texel) in (0..self.width).zip(line) {
                let (x, y) =
                    (scale(column, self.width, coverage.width), scale(row, self.height, coverage.height));
                texel[3] = coverage.texel(x, y)[0];
            }
        }
        Self { texels, ..*self }
    }

    /// Mean of the four channels over all texels, in [0, 1], as stored (not linearised).
    pub(super) fn mean(&self) -> [f32; 4] {
        let mut sums = [0u64; 4];
        for texel in &self.texels {
            sums.iter_mut().zip(texel).for_each(|(sum, &value)| *sum += u64::from(value));
        }
        sums.map(|sum| (sum as f64 / (255.0 * self.texels.len() as f64)) as f32)
    }

    #[inline(always)]
    fn texel(&self, x: u32, y: u32) -> [u8; 4] {
        self.texels[(y * self.width + x) as usize]
    }
}

impl Wrap {
    /// Texel number of a column or row that may lie outside of `count`.
    #[inline(always)]
    fn texel(self, at: i64, count: u32) -> u32 {
        let count = i64::from(count);
        let within = match self {
            Self::Repeat => at.rem_euclid(count),
            Self::Clamp => at.clamp(0, count - 1),
            Self::Mirror => {
                let at = at.rem_euclid(2 * count);
                if at < count { at } else { 2 * count - 1 - at }
            }
        };
        within as u32
    }
}

impl TextureMap {
    /// Linear RGB and coverage at texture coordinates, interpolated between the four nearest texels.
    #[inline(always)]
    pub fn sample(&self, uv: Vec2) -> (Vec3, f32) {
        let Texture { width, height, .. } = *self.texture;
        let at = self.transform.transform_point2(uv) * Vec2::new(width as f32, height as f32) - 0.5;
        // Coordinates of no number, or beyond what texels can be counted to, take the corner.
        let at = if at.abs().max_element() < 1e9 { at } else { Vec2::ZERO };
        let (base, fraction) = (at.floor(), at - at.floor());
        let columns = [0, 1].map(|step| self.wrap[0].texel(base.x as i64 + step, width));
        let rows = [0, 1].map(|step| self.wrap[1].texel(base.y as i64 + step, height));
        let mut sum = (Vec3::ZERO, 0.0);
        for (y, weight_y) in rows.into_iter().zip([1.0 - fraction.y, fraction.y]) {
            for (x, weight_x) in columns.into_iter().zip([1.0 - fraction.x, fraction.x]) {
                let [r, g, b, a] = self.texture.texel(x, y);
                let weight = weight_x * weight_y;
                sum.0 += weight * Vec3::new(linear(r), linear(g), linear(b));
                sum.1 += weight * f32::from(a) / 255.0;
            }
        }
        sum
    }
}

/// Linear light of an 8-bit sRGB value.
#[inline(always)]
fn linear(encoded: u8) -> f32 {
    static TABLE: std::sync::LazyLock<[f32; 256]> =
        std::sync::LazyLock::new(|| std::array::from_fn(|code| linear_from_srgb(code as f32 / 255.0)));
    TABLE[usize::from(encoded)]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn checker(wrap: Wrap) -> TextureMap {
        let (black, white) = ([0, 0, 0, 255], [255, 255, 255, 0]);
        let texture = Texture::new(2, 1, vec![black, white]);
        TextureMap {
            texture: Arc::new(texture.expect("two texels")),
            transform: Affine2::IDENTITY,
            wrap: [wrap; 2],
        }
    }

    /// At a texel's centre its own value, half-way to the next one the mean of both; beyond the border what the
    /// wrapping mode says.
    #[test]
    fn samples_are_the_texels_at_their_centres_and_blend_between() {
        for (wrap, beyond) in [(Wrap::Repeat, 0.0), (Wrap::Mirror, 1.0), (Wrap::Clamp, 1.0)] {
            let map = checker(wrap);
            assert_eq!(map.sample(Vec2::new(0.25, 0.5)), (Vec3::ZERO, 1.0));
            assert_eq!(map.sample(Vec2::new(0.75, 0.5)), (Vec3::ONE, 0.0));
            assert_eq!(map.sample(Vec2::new(0.5, 0.5)), (Vec3::splat(0.5), 0.5));
            assert_eq!(map.sample(Vec2::new(1.25, 0.5)).0, Vec3::splat(beyond), "{wrap:?}");
        }
    }

    /// Coordinates that are no numbers must not end the program.
    #[test]
    fn any_coordinates_give_a_finite_colour() {
        for odd in [f32::NAN, f32::INFINITY, -f32::MAX, 1e20] {
            let (color, coverage) = checker(Wrap::Repeat).sample(Vec2::new(odd, odd));
            assert!(color.is_finite() && coverage.is_finite());
        }
    }
}
