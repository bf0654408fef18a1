//! Several receivers of one render.

use crate::image::Image;
use crate::render::{Tile, TileSink};
use crate::settings::Settings;

/// Passes everything on to all of them.
pub struct Sinks<'a>(pub Vec<&'a dyn TileSink>);

impl TileSink for Sinks<'_> {
    fn tile(&self, tile: &Tile, pixels: &[[f32; 3]]) {
        self.0.iter().for_each(|sink| sink.tile(tile, pixels));
    }

    fn begin(&self, settings: &Settings) {
        self.0.iter().for_each(|sink| sink.begin(settings));
    }

    fn known(&self, tile: &Tile) -> Option<Vec<[f32; 3]>> {
        self.0.iter().find_map(|sink| sink.known(tile))
    }

    fn interrupted(&self, image: &Image) {
        self.0.iter().for_each(|sink| sink.interrupted(image));
    }

    fn picture(&self, image: &Image) {
        self.0.iter().for_each(|sink| sink.picture(image));
    }
}
