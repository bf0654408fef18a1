//! How files are written.

/// The range of exposures in stops: from −`MAX_EXPOSURE` to `MAX_EXPOSURE`.
pub const MAX_EXPOSURE: f32 = 100.0;

/// How images are written.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OutputSettings {
    /// Exposure of tone-mapped images in stops, at most [`MAX_EXPOSURE`] either way.
    pub exposure: f32,
}
