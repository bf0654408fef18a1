//! What a view is, beside its camera.

/// Which camera paths are traced.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewSettings {
    /// Width and height in pixels, each at least 1; at most [`MAX_PIXELS`](crate::image::MAX_PIXELS) pixels.
    pub resolution: (u32, u32),
    /// Camera rays per pixel, at least 1.
    pub samples_per_pixel: u32,
    /// Longest path, counted in surface points, at least 1: the camera ray's alone.
    pub max_depth: u32,
    /// A path ends where its weight (the product of the k_s so far) falls below this in all channels.
    pub weight_threshold: f32,
    /// Samples per image block, which bounds the memory for camera paths and never changes the image;
    /// `None` for a good default.
    pub block_samples: Option<u64>,
}

impl Default for ViewSettings {
    fn default() -> Self {
        Self {
            resolution: (800, 600),
            samples_per_pixel: 1,
            max_depth: 5,
            weight_threshold: 1e-3,
            block_samples: None,
        }
    }
}
