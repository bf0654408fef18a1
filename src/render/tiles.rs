//! How the image is cut up: tiles for the threads, blocks of tiles for the memory.

use crate::image::Window;

/// Edge of a tile in pixels. Tiles lie on a fixed raster, so that neither the number of threads nor the
/// block size changes which rays travel together.
pub const TILE: u32 = 32;

/// Tiles that a thread takes at a time.
///
/// Rayon would cut a stage in few pieces and stop cutting once no thread is idle: at the end one thread waits for the other
/// to do the rest of its last piece, which took 5 to 10 % of a stage. A tile takes long enough to be handed out alone.
pub const TILES_PER_TASK: usize = 1;

/// Edge of the squares of pixels whose rays form one packet of 16.
const SQUARE: u32 = 4;

/// A rectangle of at most 32 × 32 pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tile {
    /// Left column.
    pub x: u32,
    /// Top row.
    pub y: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl Tile {
    /// Its place in the image.
    pub fn window(&self) -> Window {
        let Self { x, y, width, height } = *self;
        Window { x, y, width, height }
    }

    /// Number of pixels.
    pub fn pixels(&self) -> usize {
        (self.width * self.height) as usize
    }

    /// Number of the square of 4×4 pixels that a pixel of the tile lies in, row by row.
    pub(super) fn square_of(&self, pixel: u32) -> u8 {
        let (x, y) = (pixel % self.width, pixel / self.width);
        (y / SQUARE * (TILE / SQUARE) + x / SQUARE) as u8
    }

    /// Some squares of a tile, one bit each, together with all that touch them.
    pub(super) fn around(squares: u64) -> u64 {
        const LEFT: u64 = 0x0101_0101_0101_0101;
        let row = squares | (squares & !(LEFT << 7)) << 1 | (squares & !LEFT) >> 1;
        row | row << 8 | row >> 8
    }

    /// Squares of up to 4×4 pixels, row by row: for each pixel its column, row, and index within the tile.
    pub(super) fn squares(&self) -> impl Iterator<Item = impl Iterator<Item = (u32, u32, u32)> + '_> + '_ {
        let steps = |length: u32| (0..length).step_by(SQUARE as usize);
        steps(self.height).flat_map(move |top| {
            steps(self.width).map(move |left| {
                (top..(top + SQUARE).min(self.height)).flat_map(move |y| {
                    (left..(left + SQUARE).min(self.width))
                        .map(move |x| (self.x + x, self.y + y, y * self.width + x))
                })
            })
        })
    }
}

/// The tiles of an image, in blocks of at most `block_pixels` pixels each (at least one tile).
pub fn blocks(resolution: (u32, u32), block_pixels: u64) -> Vec<Vec<Tile>> {
    let (width, height) = resolution;
    let mut blocks: Vec<Vec<Tile>> = Vec::new();
    let mut pixels = u64::MAX;
    for y in (0..height).step_by(TILE as usize) {
        for x in (0..width).step_by(TILE as usize) {
            let tile = Tile { x, y, width: TILE.min(width - x), height: TILE.min(height - y) };
            let size = tile.pixels() as u64;
            match blocks.last_mut() {
                Some(block) if pixels + size <= block_pixels => {
                    block.push(tile);
                    pixels += size;
                }
                _ => {
                    blocks.push(vec![tile]);
                    pixels = size;
                }
            }
        }
    }
    blocks
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The squares around one are those that touch it, and none beyond the tile's edges; rows of narrow tiles don't mix.
    #[test]
    fn squares_know_their_neighbours() {
        for square in 0..64i32 {
            let (x, y) = (square % 8, square / 8);
            let touching = (0..64).filter(|other| (other % 8 - x).abs() <= 1 && (other / 8 - y).abs() <= 1);
            assert_eq!(Tile::around(1 << square), touching.fold(0, |mask, other| mask | 1 << other));
        }
        let narrow = Tile { x: 0, y: 0, width: 6, height: 32 };
        assert_eq!([0, 3, 4, 5, 6 * 4, 6 * 31 + 5].map(|pixel| narrow.square_of(pixel)), [0, 0, 1, 1, 8, 57]);
    }

    /// Every pixel belongs to exactly one square of one tile of one block.
    #[test]
    fn tiles_cover_the_image_once() {
        let (width, height) = (101, 67);
        for block_pixels in [1, 3000, u64::MAX] {
            let mut seen = vec![0; (width * height) as usize];
            for tile in blocks((width, height), block_pixels).iter().flatten() {
                let mut inside = vec![false; tile.pixels()];
                for (x, y, index) in tile.squares().flatten() {
                    seen[(y * width + x) as usize] += 1;
                    assert!(!std::mem::replace(&mut inside[index as usize], true));
                }
            }
            assert!(seen.iter().all(|&count| count == 1));
        }
    }
}
