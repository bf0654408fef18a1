//! Last stage: from sums of radiance over the samples of pixels to pixels.

use glam::Vec3;
use rayon::prelude::*;

use super::paths::TilePaths;
use super::tiles::{TILE, Tile};
use crate::image::Image;
use crate::settings::Settings;

/// Receives the tiles of an image as they are finished, each once for every picture that is made, in any order and from any thread.
pub trait TileSink: Sync {
    /// A tile is finished: its pixels, row by row from the top left, linear RGB.
    fn tile(&self, tile: &Tile, pixels: &[[f32; 3]]);

    /// A picture begins, by settings that leave nothing open: the tiles that follow are its.
    fn begin(&self, _: &Settings) {}

    /// The pixels of a tile of the picture that began last, if they are known from another render by the same settings: then they are not computed
    /// again.
    fn known(&self, _: &Tile) -> Option<Vec<[f32; 3]>> {
        None
    }

    /// The render is stopped: the picture as far as its tiles are finished.
    fn interrupted(&self, _: &Image) {}

    /// A whole picture is finished; if there are steps to come, tiles of better ones follow.
    fn picture(&self, _: &Image) {}
}

/// A sink that lets everything go.
impl TileSink for () {
    fn tile(&self, _: &Tile, _: &[[f32; 3]]) {}
}

/// Means over the samples of the pixels of a tile.
pub fn resolve(radiance: &[Vec3], samples_per_pixel: u32) -> Vec<[f32; 3]> {
    let scale = 1.0 / samples_per_pixel as f32;
    radiance.iter().map(|sum| (*sum * scale).to_array()).collect()
}

/// Puts the pixels of a tile, row by row, into an image.
pub fn put_tile(tile: &Tile, pixels: &[[f32; 3]], image: &mut Image) {
    let width = image.width() as usize;
    let lines = image.pixels_mut().chunks_mut(width).skip(tile.y as usize);
    for (line, values) in lines.zip(pixels.chunks(tile.width as usize)) {
        let line = line.get_mut(tile.x as usize..).unwrap_or_default();
        line.iter_mut().zip(values).for_each(|(pixel, value)| *pixel = *value);
    }
}

/// Puts the pixels of a block of tiles, whose radiance is summed over the samples of each pixel, into an image.
pub fn resolve_block(block: &[Tile], paths: &[TilePaths], samples_per_pixel: u32, image: &mut Image) {
    let width = image.width() as usize;
    let scale = 1.0 / samples_per_pixel as f32;
    // Rows of tiles lie one after the other in the image, and in the block.
    let rows_of_tiles = image.pixels_mut().par_chunks_mut(width * TILE as usize).enumerate();
    rows_of_tiles.with_max_len(1).for_each(|(row, pixels)| {
        let top = row as u32 * TILE;
        let members = block.partition_point(|tile| tile.y < top)..block.partition_point(|tile| tile.y <= top);
        for (tile, paths) in block[members.clone()].iter().zip(&paths[members]) {
            let lines = pixels.chunks_mut(width).zip(paths.radiance.chunks(tile.width as usize));
            for (line, values) in lines {
                for (pixel, value) in line[tile.x as usize..].iter_mut().zip(values) {
                    *pixel = (*value * scale).to_array();
                }
            }
        }
    });
}
