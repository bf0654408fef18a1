//! Pictures that are written before the last one is finished.

use std::sync::Mutex;

use super::progress::Bar;
use crate::image::{Image, ImageError, ImageOptions, OutputTarget, exr::SampleType, tone::auto_exposure};
use crate::render::{Tile, TileSink};

/// Passes tiles on to the bar, and writes the pictures that are finished before the last one.
pub struct PartialPictures<'a> {
    bar: &'a Bar,
    targets: &'a [OutputTarget],
    sample_type: SampleType,
    /// `None` for one that suits the picture.
    exposure: Option<f32>,
    /// The first file that couldn't be written.
    failed: Mutex<Option<ImageError>>,
}

impl<'a> PartialPictures<'a> {
    /// Moves `bar` on, and writes pictures to `targets`, with an exposure that suits them if none is given.
    pub fn new(
        bar: &'a Bar,
        targets: &'a [OutputTarget],
        sample_type: SampleType,
        exposure: Option<f32>,
    ) -> Self {
        Self { bar, targets, sample_type, exposure, failed: Mutex::new(None) }
    }

    /// # Errors
    /// Of the first picture that couldn't be written.
    pub fn finish(self) -> Result<(), ImageError> {
        self.failed.into_inner().ok().flatten().map_or(Ok(()), Err)
    }
}

impl TileSink for PartialPictures<'_> {
    fn tile(&self, tile: &Tile, pixels: &[[f32; 3]]) {
        self.bar.tile(tile, pixels);
    }

    fn picture(&self, image: &Image) {
        self.bar.picture(image);
        let exposure = self.exposure.unwrap_or_else(|| auto_exposure(image.pixels()));
        let options = ImageOptions { sample_type: self.sample_type, exposure, metadata: Vec::new() };
        let written = self.targets.iter().try_for_each(|target| target.write(image, &options));
        if let (Err(error), Ok(mut failed)) = (written, self.failed.lock()) {
            failed.get_or_insert(error);
        }
    }
}
