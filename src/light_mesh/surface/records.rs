//! Records: the points that surface points of a view are interpolated from.

use std::collections::HashSet;

use glam::Vec3;
use rayon::prelude::*;

use super::directions::part;
use super::gathered::Gathered;
use super::mesh::{FINENESS, LOOK, SurfaceEvaluation, SurfaceMesh, SurfaceView};
use super::points::FINEST;
use super::sources::{RecordRays, RecordSight};
use crate::accel::Accel;
use crate::scene::SurfacePoint;
use crate::world::World;

/// Widths of the cells of records: at most this part of the harmonic mean distance of what they see, which is how fast light changes there (Ward
/// and Heckbert, 1992), but not so few pixels that it can't be seen, nor so small a part of the picture's height: the number of records does not
/// grow with the picture.
const WIDTH_PER_DISTANCE: f32 = 1.0 / 3.0;
const LEAST_PIXELS: f32 = 4.0;
const LEAST_OF_HEIGHT: f32 = 1.0 / 64.0;
/// The widest that they may be, over the narrowest.
const MOST_PER_LEAST: f32 = 2.0;
/// Cells with more points, such as those full of leaves, are not made smaller for what is near: there is no end to it.
const CROWD: u32 = 12;
/// In cells with more points, records gather with half of the directions that stand for less of the view than that part of a square of the
/// least width, and with a quarter that stand for less than half of it. Elsewhere, what another view sees more of would show.
const FEW: u32 = 4;
const WELL_SEEN: f32 = 0.25;
impl SurfaceMesh {
    /// Takes in the surface points of some tiles that are going to be interpolated.
    pub fn need<'s, A: Accel>(
        &mut self,
        world: World<A>,
        tiles: Vec<Vec<&'s SurfacePoint>>,
    ) -> SurfaceEvaluation {
        let mut evaluation = SurfaceEvaluation::default();
        struct Left<'s> {
            surface: &'s SurfacePoint,
            /// Level to look into next.
            level: u8,
            /// The last point that was found has to do where smaller cells have none.
            found: Option<u32>,
            /// Whether it will do.
            done: bool,
        }
        let left = |surface| Left { surface, level: self.first_level(surface), found: None, done: false };
        let mut tiles: Vec<Vec<Left>> =
            tiles.into_par_iter().map(|tile| tile.into_iter().map(left).collect()).collect();
        for level in 0..=FINEST {
            let of_level = |tile: &Vec<Left<'s>>| {
                let left = tile.iter().filter(|left| left.level == level && !left.done);
                left.map(|left| left.surface).collect()
            };
            let tasks: Vec<Vec<&SurfacePoint>> = tiles.par_iter().map(of_level).collect();
            let (found, rays) = self.points.place(world, level, &tasks);
            evaluation.shadow += rays;
            self.extend();
            let unknown = |number: &u32| self.states[*number as usize].distance == 0.0;
            self.look(world, numbers(&found).into_iter().filter(unknown).collect(), &mut evaluation);
            tiles.par_iter_mut().zip(found).for_each(|(tile, found)| {
                let here = tile.iter_mut().filter(|left| left.level == level && !left.done);
                for (left, place) in here.zip(found) {
                    left.level += 1;
                    left.found = place.or(left.found);
                    left.done = place.is_some_and(|number| !self.refined(number));
                }
            });
        }
        let left = tiles.into_iter().flatten();
        let chosen: Vec<u32> =
            left.map(|left| left.found.unwrap_or_else(|| self.points.own(left.surface))).collect();
        self.extend();
        for number in chosen {
            let standing = &mut self.states[number as usize].stands_for;
            if *standing == 0 {
                self.records.push(number);
            }
            *standing += 1;
        }
        evaluation
    }

    /// Lets records, which were looked at, gather with the rest of their directions: the noise of one counts as much as what is seen of it.
    pub(super) fn see<A: Accel>(
        &mut self,
        world: World<A>,
        records: &[u32],
        evaluation: &mut SurfaceEvaluation,
    ) -> RecordRays {
        let count = self.settings.directions;
        let looked = std::mem::take(&mut self.looked);
        let looked_at = |&number: &u32| self.states[number as usize].looked_at as usize - 1;
        let mut sights: Vec<RecordSight> = records
            .iter()
            .map(|number| RecordSight { number: *number, looked: looked_at(number), rest: None })
            .collect();
        looked.points.iter().for_each(|&number| self.states[number as usize].looked_at = 0);
        let mut rest = Gathered::default();
        let well_seen = WELL_SEEN * least_pixels(self.view.height).powi(2);
        let share = |number: u32| {
            let (state, few) = (&self.states[number as usize], self.points.crowd(number) <= FEW);
            match state.stands_for as f32 / well_seen {
                _ if few => 1,
                1.0.. => 1,
                0.5.. => 2,
                _ => LOOK,
            }
        };
        let shares: Vec<u32> = sights.iter().map(|sight| share(sight.number)).collect();
        for of in [1, 2] {
            let mut numbers = Vec::new();
            for (sight, _) in sights.iter_mut().zip(&shares).filter(|(_, share)| **share == of) {
                sight.rest = Some(rest.points.len() + numbers.len());
                numbers.push(sight.number);
            }
            let range = part(count, LOOK)..part(count, of);
            rest.append(self.gather(world, range, FINENESS, numbers, evaluation));
        }
        RecordRays { looked, rest, records: sights }
    }

    /// The widest cell that a record may have at a position, and the narrowest that could be seen there.
    #[inline(always)]
    fn limits(&self, position: Vec3) -> (f32, f32) {
        let SurfaceView { footprint, height } = self.view;
        let pixel = footprint.edge * position.distance(footprint.eye);
        let least = least_pixels(height) * pixel;
        (MOST_PER_LEAST * least, least)
    }

    /// The level of the first cell to look into for a record.
    #[inline(always)]
    pub(super) fn first_level(&self, surface: &SurfacePoint) -> u8 {
        self.points.level_of(self.limits(surface.position).0)
    }

    /// Whether smaller cells should take the place of a point that was looked at.
    #[inline(always)]
    pub(super) fn refined(&self, number: u32) -> bool {
        let (most, least) = self.limits(self.points.surface(number).position);
        let crowded = self.points.crowd(number) > CROWD;
        let width = if crowded { most } else { WIDTH_PER_DISTANCE * self.states[number as usize].distance };
        self.points.level(number) < FINEST && self.points.width(number) > width.min(most).max(least)
    }
}

/// Pixels along the narrowest cell of a record in a picture of so many rows.
fn least_pixels(height: u32) -> f32 {
    LEAST_PIXELS.max(LEAST_OF_HEIGHT * height as f32)
}

/// The numbers of points that were found, each once.
fn numbers(tasks: &[Vec<Option<u32>>]) -> Vec<u32> {
    let mut seen = HashSet::new();
    let mut last = None;
    let new = |&number: &u32| last.replace(number) != Some(number) && seen.insert(number);
    tasks.iter().flatten().flatten().copied().filter(new).collect()
}
