//! Parts of a picture that are held out: computed without a light mesh, they tell what is wrong with the rest (method §10).

use std::collections::HashSet;
use std::ops::Range;

use glam::Vec3;
use rayon::prelude::*;

use super::accuracy::PartError;
use super::error::RenderError;
use super::frame::{BlockIntegrator, Frame};
use super::paths::TilePaths;
use super::stats::RenderStats;
use super::tiles::Tile;
use crate::accel::Accel;
use crate::image::Image;

/// Parts that a thread takes at a time.
const TASK: usize = 4;

/// Parts of a picture.
pub(super) struct HeldOut {
    tiles: Vec<Tile>,
    /// Their camera paths.
    pub paths: Vec<TilePaths>,
    samples: u32,
    /// How many times each stands for itself, where some are held out more often than others; else empty.
    weights: Vec<f64>,
}

/// Pixels of parts, row by row, means over their samples.
pub(super) type Pixels = Vec<Vec<Vec3>>;

impl HeldOut {
    /// Holds out `count` parts of `side` × `side` pixels all over the picture, or as many as it has.
    pub fn new<A: Accel>(frame: &Frame<A>, side: u32, count: usize) -> Self {
        let tiles = places(frame.view.resolution, side, count);
        Self { tiles, paths: Vec::new(), samples: frame.view.samples_per_pixel, weights: Vec::new() }
    }

    /// Holds out `count` pixels of a picture, half of them by how bright they are, squared: the few that make most of an RMSE are among the
    /// brightest. Each counts the less, the more likely it was to be taken.
    ///
    /// # Errors
    /// [`RenderError::Stopped`].
    pub fn by_brightness<A: Accel>(
        frame: &Frame<A>,
        image: &Image,
        count: usize,
    ) -> Result<Self, RenderError> {
        let square = |pixel: &[f32; 3]| {
            let brightness = f64::from(pixel[0] + pixel[1] + pixel[2]);
            if brightness.is_finite() { brightness * brightness } else { 0.0 }
        };
        let even = 1.0 / image.pixels().len() as f64;
        let sum: f64 = image.pixels().iter().map(square).sum();
        let (width, step) = (image.width(), 1.0 / count as f64);
        let mut held_out = Self::new(frame, 1, 0);
        // Equal steps along the running sum of the probabilities.
        let (mut passed, mut next) = (0.0, 0.5 * step);
        for (number, pixel) in (0u32..).zip(image.pixels()) {
            let by_square = if sum > 0.0 { square(pixel) / sum } else { even };
            let probability = 0.5 * (even + by_square);
            passed += probability;
            while passed > next {
                held_out.tiles.push(Tile { x: number % width, y: number / width, width: 1, height: 1 });
                held_out.weights.push(even / probability);
                next += step;
            }
        }
        held_out.trace(frame, usize::MAX)?;
        Ok(held_out)
    }

    /// Traces the camera paths of the next `count` parts.
    ///
    /// # Errors
    /// [`RenderError::Stopped`].
    pub fn trace<A: Accel>(&mut self, frame: &Frame<A>, count: usize) -> Result<(), RenderError> {
        let next: Vec<Tile> = self.tiles.iter().skip(self.paths.len()).take(count).copied().collect();
        let mut paths = Vec::new();
        frame.trace(&next, &mut paths, &mut RenderStats::default())?;
        self.paths.append(&mut paths);
        Ok(())
    }

    /// Those of some parts whose paths are traced, as an integrator shades them; and the rays from their surfaces.
    pub fn shaded(&self, integrator: &impl BlockIntegrator, which: Range<usize>) -> (Pixels, u64) {
        let parts = self.tiles.iter().zip(&self.paths).take(which.end).skip(which.start).collect::<Vec<_>>();
        let shade = |(tile, paths): &(&Tile, &TilePaths)| shade_part(integrator, tile, paths, self.samples);
        let shaded: Vec<(Vec<Vec3>, u64)> = parts.par_iter().with_max_len(TASK).map(shade).collect();
        let rays = shaded.iter().map(|(_, rays)| rays).sum();
        (shaded.into_iter().map(|(pixels, _)| pixels).collect(), rays)
    }

    /// The parts as a picture shows them.
    pub fn of_image(&self, image: &Image) -> Pixels {
        let part = |tile: &Tile| {
            let rows = tile.y..tile.y + tile.height;
            let pixels = rows.flat_map(|y| (tile.x..tile.x + tile.width).map(move |x| (x, y)));
            pixels.map(|(x, y)| image.get(x, y).map_or(Vec3::ZERO, Vec3::from)).collect()
        };
        self.tiles.iter().map(part).collect()
    }

    /// What is wrong with the first parts: `wrong` says what a difference counts.
    pub fn errors(&self, shown: &Pixels, truth: &Pixels, wrong: impl Fn(Vec3) -> f32) -> Vec<PartError> {
        let weights = self.weights.iter().copied().chain(std::iter::repeat(1.0));
        let part = |((shown, truth), weight): ((&Vec<Vec3>, &Vec<Vec3>), f64)| {
            let mut part = PartError::default();
            let pixels = shown.iter().zip(truth);
            for (shown, truth) in pixels.filter(|(shown, truth)| shown.is_finite() && truth.is_finite()) {
                part.wrong += weight * f64::from(wrong(*shown - *truth));
                part.shown += weight * f64::from(shown.element_sum());
                part.truth += weight * f64::from(truth.element_sum());
                part.values += 3.0;
            }
            part.weight = weight;
            part
        };
        shown.iter().zip(truth).zip(weights).map(part).filter(|part| part.values > 0.0).collect()
    }

    /// Whether the paths of all parts are traced.
    pub fn is_traced(&self) -> bool {
        self.paths.len() == self.tiles.len()
    }
}

/// Pixels of a part, means over the samples, and the rays that they took.
fn shade_part(
    integrator: &impl BlockIntegrator,
    tile: &Tile,
    paths: &TilePaths,
    samples: u32,
) -> (Vec<Vec3>, u64) {
    let mut light = vec![Vec3::ZERO; paths.vertices.len()];
    let counters = integrator.shade(tile, paths, &mut light, None);
    let mut radiance = paths.radiance.clone();
    for (vertex, light) in paths.vertices.iter().zip(light) {
        radiance[vertex.pixel as usize] += vertex.reflectance * light;
    }
    let scale = 1.0 / samples as f32;
    radiance.iter_mut().for_each(|pixel| *pixel *= scale);
    (radiance, counters.shadow_rays + counters.inside_rays)
}

/// Parts of a picture of `side` × `side` pixels, at its borders fewer: each once, as many as are asked for if there are. Any first ones of them are
/// spread evenly.
fn places((width, height): (u32, u32), side: u32, count: usize) -> Vec<Tile> {
    let (columns, rows) = (width.div_ceil(side), height.div_ceil(side));
    // Multiples of these, modulo 1, cover the square evenly (Roberts, 2018).
    let at = |step: f64, number: usize, count: u32| {
        let place = (0.5 + step * number as f64).fract();
        ((place * f64::from(count)) as u32).min(count - 1)
    };
    let spread = (0..4 * count).map(|number| {
        (at(0.754_877_666_246_692_7, number, columns), at(0.569_840_290_998_053_2, number, rows))
    });
    // Where nearly all places are taken, the sequence finds the same ones again and again.
    let all = (0..rows).flat_map(|row| (0..columns).map(move |column| (column, row)));
    let mut taken = HashSet::new();
    spread
        .chain(all)
        .filter(|place| taken.insert(*place))
        .take(count)
        .map(|(column, row)| {
            let (x, y) = (column * side, row * side);
            Tile { x, y, width: side.min(width - x), height: side.min(height - y) }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Parts are different, lie in the picture, and the first ones of them are in all of its quarters.
    #[test]
    fn parts_are_spread_over_the_picture() {
        for (resolution, side, count) in
            [((96, 72), 8, 1024), ((800, 600), 8, 64), ((33, 7), 1, 50), ((1, 1), 8, 9)]
        {
            let tiles = places(resolution, side, count);
            let (columns, rows) = (resolution.0.div_ceil(side), resolution.1.div_ceil(side));
            assert_eq!(tiles.len(), count.min((columns * rows) as usize));
            let different: HashSet<(u32, u32)> = tiles.iter().map(|tile| (tile.x, tile.y)).collect();
            assert_eq!(different.len(), tiles.len());
            let inside =
                |tile: &Tile| tile.x + tile.width <= resolution.0 && tile.y + tile.height <= resolution.1;
            assert!(tiles.iter().all(inside));
            let quarter = |tile: &Tile| (2 * tile.x >= resolution.0, 2 * tile.y >= resolution.1);
            let first: HashSet<(bool, bool)> = tiles.iter().take(8).map(quarter).collect();
            assert!(first.len() == 4 || tiles.len() < 8);
        }
    }
}
