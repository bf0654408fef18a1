//! What a view is, beside its camera.

use std::f32::consts::TAU;

use glam::Vec2;

use super::names::named_enum;
use crate::image::Window;
use crate::sampling::{InverseCdf, MOST_DOUBLED, pixel_pattern};

named_enum! {
    /// How the samples of a pixel are spread, and so what each counts for.
    #[derive(Default)]
    pub enum PixelFilter {
        /// Evenly over a square; its width is 1 if none is given: the pixel
        #[default]
        Box = "box",
        /// A Gaussian of standard deviation width/4, cut off at 1.5 widths; its width is 1.5 if none is given
        Gaussian = "gaussian",
        /// The Blackman-Harris window, 2 widths across; its width is 1.5 if none is given
        BlackmanHarris = "blackman-harris",
    }
}

/// Pixels of the widest filter.
pub const MAX_FILTER_WIDTH: f32 = 16.0;

impl PixelFilter {
    /// The width if none is given, pixels.
    fn default_width(self) -> f32 {
        match self {
            Self::Box => 1.0,
            Self::Gaussian | Self::BlackmanHarris => 1.5,
        }
    }

    /// Spreads positions in the unit square as the filter asks for, so that all samples count alike: pixels from the upper left corner of
    /// the one they belong to.
    fn spread(self, width: Option<f32>, positions: Vec<Vec2>) -> Vec<Vec2> {
        let width = width.unwrap_or(self.default_width());
        let spread = |along: &dyn Fn(f32) -> f32| {
            positions.iter().map(|position| Vec2::new(along(position.x), along(position.y)) + 0.5).collect()
        };
        match self {
            Self::Box => spread(&|u| (u - 0.5) * width),
            Self::Gaussian => {
                let cdf = InverseCdf::new(1.5 * width, |x| (-8.0 * (x / width).powi(2)).exp());
                spread(&|u| cdf.at(u))
            }
            Self::BlackmanHarris => {
                let cdf = InverseCdf::new(width, |x| {
                    let phase = TAU * (0.5 * x / width + 0.5);
                    0.35875 - 0.48829 * phase.cos() + 0.14128 * (2.0 * phase).cos()
                        - 0.01168 * (3.0 * phase).cos()
                });
                spread(&|u| cdf.at(u))
            }
        }
    }
}

/// Which camera paths are traced.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewSettings {
    /// Width and height in pixels, each at least 1; at most [`MAX_PIXELS`](crate::image::MAX_PIXELS) pixels.
    pub resolution: (u32, u32),
    /// Camera rays per pixel, at least 1; from 2 to 16 twice as many where several surfaces meet in a pixel. Light is computed once for those that see
    /// the same surface, and more often at edges of shadows.
    pub samples_per_pixel: u32,
    /// How they are spread.
    pub filter: PixelFilter,
    /// Width of the filter in pixels, above 0 and at most [`MAX_FILTER_WIDTH`]; `None` for the filter's own.
    pub filter_width: Option<f32>,
    /// Longest path, counted in surface points, at least 1: the camera ray's alone.
    pub max_depth: u32,
    /// A path ends where its weight (the product of the k_s so far) falls below this in all channels.
    pub weight_threshold: f32,
    /// Samples per image block, which bounds the memory for camera paths and never changes the image;
    /// `None` for a good default.
    pub block_samples: Option<u64>,
    /// The part of the image that is rendered, within the resolution; its pixels are those of the whole image, the others stay black. `None` for all.
    pub crop: Option<Window>,
}

impl ViewSettings {
    /// The most samples of a pixel: twice as many where several surfaces meet in it, if they are few.
    pub fn most_samples(&self) -> u32 {
        let samples = self.samples_per_pixel;
        if (2..=MOST_DOUBLED).contains(&samples) { 2 * samples } else { samples }
    }

    /// Where the samples of a pixel lie at most, in pixels from its upper left corner: first those that every pixel has.
    pub fn samples(&self) -> Vec<Vec2> {
        self.filter.spread(self.filter_width, pixel_pattern(self.most_samples()))
    }
}

impl Default for ViewSettings {
    fn default() -> Self {
        Self {
            resolution: (800, 600),
            samples_per_pixel: 16,
            filter: PixelFilter::Box,
            filter_width: None,
            max_depth: 5,
            weight_threshold: 1e-3,
            block_samples: None,
            crop: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Variance along one axis of the samples' distances from the pixel's centre, by filter: that of the filter itself, w²/12 of a
    /// box, and by numerical integration 0.0625·w² of the Gaussian and 0.0767·w² of the window.
    #[test]
    fn samples_are_spread_as_their_filter_is() {
        for (filter, variance) in [
            (PixelFilter::Box, 1.0 / 12.0),
            (PixelFilter::Gaussian, 0.0625),
            (PixelFilter::BlackmanHarris, 0.0767),
        ] {
            for width in [0.5, 1.0, 3.0] {
                let view = ViewSettings {
                    samples_per_pixel: 4096,
                    filter,
                    filter_width: Some(width),
                    ..ViewSettings::default()
                };
                let samples = view.samples();
                let mean = samples.iter().sum::<Vec2>() / 4096.0;
                assert!((mean - 0.5).abs().max_element() < 0.01 * width, "{filter}: {mean}");
                let found = samples.iter().map(|s| (*s - 0.5) * (*s - 0.5)).sum::<Vec2>() / 4096.0;
                let error = (found / (width * width) - variance).abs().max_element();
                assert!(error < 0.002, "{filter}: {found}");
            }
        }
    }

    /// A single sample goes through the pixel's centre whatever the filter.
    #[test]
    fn one_sample_is_the_centre() {
        for filter in [PixelFilter::Box, PixelFilter::Gaussian, PixelFilter::BlackmanHarris] {
            assert_eq!(filter.spread(None, pixel_pattern(1)), [Vec2::splat(0.5)]);
        }
    }
}
