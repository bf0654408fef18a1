//! Pictures that are written before the last one is finished.

use std::sync::Mutex;

use crate::image::{
    Image, ImageError, ImageOptions, OutputTarget, Window, exr::SampleType, tone::auto_exposure,
};
use crate::render::{Tile, TileSink};

/// Writes the pictures that are finished before the last one.
pub struct PartialPictures<'a> {
    targets: &'a [OutputTarget],
    sample_type: SampleType,
    /// The part that is written.
    window: Option<Window>,
    /// `None` for one that suits the picture.
    exposure: Option<f32>,
    /// The first file that couldn't be written.
    failed: Mutex<Option<ImageError>>,
}

impl<'a> PartialPictures<'a> {
    /// Writes pictures to `targets`, with an exposure that suits them if none is given.
    pub fn new(
        targets: &'a [OutputTarget],
        sample_type: SampleType,
        window: Option<Window>,
        exposure: Option<f32>,
    ) -> Self {
        Self { targets, sample_type, window, exposure, failed: Mutex::new(None) }
    }

    /// # Errors
    /// Of the first picture that couldn't be written.
    pub fn finish(self) -> Result<(), ImageError> {
        self.failed.into_inner().ok().flatten().map_or(Ok(()), Err)
    }
}

impl TileSink for PartialPictures<'_> {
    fn tile(&self, _: &Tile, _: &[[f32; 3]]) {}

    fn picture(&self, image: &Image) {
        let exposure = self.exposure.unwrap_or_else(|| auto_exposure(image.pixels()));
        let options = ImageOptions {
            sample_type: self.sample_type,
            exposure,
            window: self.window,
            metadata: Vec::new(),
        };
        let written = self.targets.iter().try_for_each(|target| target.write(image, &options));
        if let (Err(error), Ok(mut failed)) = (written, self.failed.lock()) {
            failed.get_or_insert(error);
        }
    }
}
