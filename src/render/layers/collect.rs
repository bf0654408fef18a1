//! Finished layers of pictures.

use std::collections::VecDeque;
use std::hash::{DefaultHasher, Hasher as _};
use std::sync::{Mutex, PoisonError};

use super::LayerChoice;
use super::layer_image::LayerImage;
use super::record::LayerRecord;
use crate::image::Image;
use crate::lights::PackedLights;
use crate::scene::Scene;

/// Pictures whose layers are kept: a render that ends early returns the one before the last.
const KEPT: usize = 2;

/// Collects the layers of pictures while they are rendered.
pub struct LayerCollector {
    choice: LayerChoice,
    /// The layers of the last pictures, with what tells these apart.
    kept: Mutex<VecDeque<(u64, LayerImage)>>,
}

impl LayerCollector {
    /// Collects these layers.
    pub fn new(choice: LayerChoice) -> Self {
        Self { choice, kept: Mutex::default() }
    }

    /// The layers of an image that was rendered with this collector, unless two others were since.
    pub fn take(&self, image: &Image) -> Option<LayerImage> {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        let identity = identity(image);
        let found = kept.iter().position(|(of, _)| *of == identity)?;
        kept.remove(found).map(|(_, layers)| layers)
    }

    /// Begins to record a picture.
    pub(in crate::render) fn begin<'a>(&'a self, scene: &'a Scene, lights: &PackedLights) -> LayerRecord<'a> {
        LayerRecord::new(&self.choice, scene, lights)
    }

    /// Keeps what was recorded of a picture.
    pub(in crate::render) fn end(&self, image: &Image, record: LayerRecord) {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        while kept.len() >= KEPT {
            kept.pop_front();
        }
        kept.push_back((identity(image), record.finish()));
    }
}

/// A number that equal pictures have in common, and others not.
fn identity(image: &Image) -> u64 {
    let mut hasher = DefaultHasher::new();
    image.pixels().iter().flatten().for_each(|value| hasher.write_u32(value.to_bits()));
    hasher.finish()
}
