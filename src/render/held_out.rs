//! Parts of a picture that are held out: computed without a light mesh, they tell what is wrong with the rest (method §10).

use std::collections::HashSet;
use std::ops::Range;

use glam::Vec3;
use rayon::prelude::*;

use super::accuracy::PartError;
use super::error::RenderError;
use super::frame::{BlockIntegrator, Frame};
use super::layers::LightParts;
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
        let chances = image.pixels().iter().map(|pixel| {
            let by_square = if sum > 0.0 { square(pixel) / sum } else { even };
            0.5 * (even + by_square)
        });
        let width = image.width();
        let mut held_out = Self::new(frame, 1, 0);
        for (number, chance) in systematic(chances, count) {
            let (x, y) = (number as u32 % width, number as u32 / width);
            held_out.tiles.push(Tile { x, y, width: 1, height: 1 });
            held_out.weights.push(even / chance);
        }
        held_out.trace(frame, usize::MAX)?;
        Ok(held_out)
    }

    /// Holds out `count` of these, half of them by errors that are predicted for them: where an error is to be found, and how large it is, are then
    /// different questions. Each counts the less, the more likely it was to be taken.
    ///
    /// # Errors
    /// [`RenderError::Stopped`].
    pub fn by_prediction<A: Accel>(
        &self,
        frame: &Frame<A>,
        predicted: &[f32],
        count: usize,
    ) -> Result<Self, RenderError> {
        let of_picture = |(&error, weight): (&f32, &f64)| f64::from(error) * weight;
        let shares = predicted.iter().zip(&self.weights).map(of_picture);
        let even = 1.0 / predicted.len() as f64;
        let sum: f64 = shares.clone().sum();
        let chances = shares.map(|share| {
            let by_error = if sum > 0.0 && sum.is_finite() { share / sum } else { even };
            0.5 * (even + by_error)
        });
        let mut held_out = Self::new(frame, 1, 0);
        for (number, chance) in systematic(chances, count) {
            held_out.tiles.push(self.tiles[number]);
            held_out.weights.push(self.weights[number] * even / chance);
        }
        held_out.trace(frame, usize::MAX)?;
        Ok(held_out)
    }

    /// What an integrator estimates to be wrong with the direct light of each part, as a mean over colours and samples.
    pub fn predicted(&self, integrator: &impl BlockIntegrator) -> Vec<f32> {
        let predict = |(tile, paths): (&Tile, &TilePaths)| {
            let mut parts = LightParts::of_error(paths.vertices.len());
            let mut light = vec![Vec3::ZERO; paths.vertices.len()];
            integrator.shade(tile, paths, &mut light, Some(&mut parts));
            let errors = parts.error.iter().flatten();
            let wrong: Vec3 =
                paths.vertices.iter().zip(errors).map(|(vertex, error)| vertex.reflectance * *error).sum();
            let wrong = wrong.abs().element_sum() / (3 * self.samples) as f32;
            if wrong.is_finite() { wrong } else { 0.0 }
        };
        self.tiles.par_iter().zip(&self.paths).with_max_len(TASK).map(predict).collect()
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

/// Takes `count` of some things by their chances, whose sum is 1, in equal steps along the running sum; those with large ones more than once. Gives the
/// number and the chance of each.
fn systematic(chances: impl Iterator<Item = f64>, count: usize) -> Vec<(usize, f64)> {
    let step = 1.0 / count as f64;
    let (mut passed, mut next) = (0.0, 0.5 * step);
    let mut taken = Vec::new();
    for (number, chance) in chances.enumerate() {
        passed += chance;
        while passed > next {
            taken.push((number, chance));
            next += step;
        }
    }
    taken
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

    /// What is taken by unequal chances and counts the less for them has the mean of all: here one thing in 97 is large, with a
    /// third of the sum, and half of (1/97 + 1/3) of what is taken is such.
    #[test]
    fn what_is_taken_more_often_counts_less() {
        let value = |number: usize| if number % 97 == 7 { 50.0 } else { 1.0 };
        let (all, sum) = (1000, (0..1000).map(value).sum::<f64>());
        let chances = (0..all).map(|number| 0.5 * (1.0 / all as f64 + value(number) / sum));
        let taken = systematic(chances, 200);
        assert_eq!(taken.len(), 200);
        let weighted =
            taken.iter().map(|&(number, chance)| value(number) / (all as f64 * chance)).sum::<f64>();
        assert!((weighted / 200.0 / (sum / all as f64) - 1.0).abs() < 0.02, "{weighted}");
        let large = taken.iter().filter(|(number, _)| value(*number) > 1.0).count();
        assert!((30..=40).contains(&large), "{large} of 200");
    }
}
