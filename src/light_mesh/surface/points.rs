//! The points of a surface mesh: cells that were surveyed, and which point stands for a surface point.

use std::collections::{HashMap, HashSet};
use std::ops::Range;

use glam::Vec3;
use rayon::prelude::*;

use super::cell_light::CellLight;
use super::cells::{Cell, CellPoint, Cells};
use super::last_place::LastPlace;
use super::survey::{line_between, survey};
use crate::accel::Accel;
use crate::light_mesh::direct_light::DirectLight;
use crate::sampling::{BuildKeyHasher, mix};
use crate::scene::SurfacePoint;
use crate::world::World;

/// Levels of cells; the finest are this many times halved.
pub const FINEST: u8 = 3;

/// Number of no point.
pub const NO_POINT: u32 = u32::MAX;
/// In place of the number of a point that nobody has looked for yet.
pub(super) const UNLINKED: u32 = u32::MAX - 1;

/// Points by number.
pub struct SurfacePoints {
    /// The cells.
    pub cells: Cells,
    /// Numbers of the points of each cell that was surveyed: the first, and how many.
    pub(super) by_cell: HashMap<u64, (u32, u32), BuildKeyHasher>,
    pub(super) points: Vec<CellPoint>,
    /// What a search reads of each, for which memory is waited for more than for anything else.
    sights: Vec<PointSight>,
    pub(super) levels: Vec<u8>,
    /// By point: how many its cell has.
    crowds: Vec<u32>,
    /// What falls on points of level 0 from lights.
    lights: Vec<CellLight>,
    /// By point: the point of level 0 that stands for it, or a reason why there is none.
    pub(super) parents: Vec<u32>,
}

/// What a search reads of a point.
#[derive(Clone, Copy)]
struct PointSight {
    position: Vec3,
    normal: Vec3,
    divided: bool,
    /// Where its light is among that of points of level 0.
    light: u32,
}

/// Cosine between the normals of a surface point and of a point that stands for it, at least.
const STANDS_FOR: f32 = 0.5;

impl SurfacePoints {
    /// No cell is known; those of level 0 have the given width.
    pub fn new(width: f32) -> Self {
        Self {
            cells: Cells::new(width),
            by_cell: HashMap::default(),
            points: Vec::new(),
            sights: Vec::new(),
            levels: Vec::new(),
            crowds: Vec::new(),
            lights: Vec::new(),
            parents: Vec::new(),
        }
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// The point of a number.
    #[inline(always)]
    pub fn surface(&self, number: u32) -> &SurfacePoint {
        &self.points[number as usize].surface
    }

    /// What falls on a point of level 0 from lights.
    #[inline(always)]
    pub fn light(&self, number: u32) -> Option<&CellLight> {
        self.lights.get(self.sights[number as usize].light as usize)
    }

    /// Whether a point must be seen from what it stands for.
    #[inline(always)]
    pub fn divided(&self, number: u32) -> bool {
        self.sights[number as usize].divided
    }

    /// Level of the cell of a point.
    #[inline(always)]
    pub fn level(&self, number: u32) -> u8 {
        self.levels[number as usize]
    }

    /// How many points the cell of a point has.
    #[inline(always)]
    pub fn crowd(&self, number: u32) -> u32 {
        self.crowds[number as usize]
    }

    /// Number of a set of directions for a point: other ones than its neighbours'.
    #[inline(always)]
    pub fn set(&self, number: u32) -> u8 {
        self.cells.at(self.level(number), self.surface(number).position).set()
    }

    /// Width of the cell of a point.
    #[inline(always)]
    pub fn width(&self, number: u32) -> f32 {
        self.cells.width(self.level(number))
    }

    /// Numbers of the points of a cell that was surveyed.
    #[inline(always)]
    pub fn of_cell(&self, cell: Cell) -> Option<Range<u32>> {
        self.by_cell.get(&cell.key()).map(|&(first, count)| first..first + count)
    }

    /// The same, given the cell that was looked into last.
    #[inline(always)]
    pub fn of_next_cell(&self, cell: Cell, last: &mut LastPlace) -> Option<Range<u32>> {
        last.numbers(cell, |cell| self.of_cell(cell))
    }

    /// Surveys those of the cells that were not; returns the number of rays.
    pub fn survey<A: Accel>(&mut self, world: World<A>, cells: impl Iterator<Item = Cell>) -> u64 {
        let mut seen = HashSet::<u64, BuildKeyHasher>::default();
        let new: Vec<Cell> =
            cells.filter(|cell| !self.by_cell.contains_key(&cell.key()) && seen.insert(cell.key())).collect();
        let found: Vec<(Vec<CellPoint>, Vec<CellLight>, u64)> = new
            .par_iter()
            .with_min_len(4)
            .map_init(DirectLight::default, |direct, &cell| {
                let (points, rays) = survey(world.accel, world.scene, &self.cells, cell);
                direct.rays = 0;
                // Light of lights is asked for in cells of level 0 only.
                let lit = if cell.level == 0 { &points[..] } else { &[] };
                let width = self.cells.width(cell.level);
                let lights = lit.iter().map(|point| CellLight::new(world, point, width, direct)).collect();
                (points, lights, rays + direct.rays)
            })
            .collect();
        let mut rays = 0;
        for (cell, (points, lights, traced)) in new.into_iter().zip(found) {
            self.add(cell.key(), cell.level, &points, lights);
            rays += traced;
        }
        rays
    }

    /// Finds what stands for surface points, task by task, and surveys what cells that takes. Returns the number of rays.
    pub fn place<A: Accel>(
        &mut self,
        world: World<A>,
        level: u8,
        tasks: &[Vec<&SurfacePoint>],
    ) -> (Vec<Vec<Option<u32>>>, u64) {
        let cells: Vec<Vec<Cell>> = tasks.par_iter().map(|task| self.unknown(level, task)).collect();
        let mut rays = self.survey(world, cells.into_iter().flatten());
        let points = &*self;
        let find = |task: &Vec<&SurfacePoint>| {
            let (mut rays, mut last) = (0, LastPlace::default());
            let find =
                |surface: &&SurfacePoint| points.find(world.accel, &mut last, level, surface, &mut rays);
            (task.iter().map(find).collect::<Vec<Option<u32>>>(), rays)
        };
        let mut found: Vec<(Vec<Option<u32>>, u64)> = tasks.par_iter().map(find).collect();
        let around = |(task, (found, _)): (&Vec<&SurfacePoint>, &(Vec<Option<u32>>, u64))| {
            let left = task.iter().zip(found).filter(|(_, place)| place.is_none());
            let cells = left.flat_map(|(surface, _)| points.cells.near(level, surface));
            cells.filter(|cell| points.of_cell(*cell).is_none()).collect::<Vec<Cell>>()
        };
        let cells: Vec<Vec<Cell>> = tasks.par_iter().zip(&found).map(around).collect();
        rays += self.survey(world, cells.into_iter().flatten());
        let points = &*self;
        tasks.par_iter().zip(&mut found).for_each(|(task, (found, rays))| {
            for (surface, place) in task.iter().zip(found).filter(|(_, place)| place.is_none()) {
                *place = points.find_near(world.accel, level, surface, rays);
            }
        });
        rays += found.iter().map(|(_, rays)| rays).sum::<u64>();
        (found.into_iter().map(|(found, _)| found).collect(), rays)
    }

    /// The cells that some surface points are in and that were not surveyed.
    fn unknown(&self, level: u8, surfaces: &[&SurfacePoint]) -> Vec<Cell> {
        let mut seen = HashSet::<u64, BuildKeyHasher>::default();
        let mut last = None;
        let cell = |surface: &&SurfacePoint| {
            let cell = self.cells.at(level, surface.position);
            if last == Some(cell) {
                return None;
            }
            last = Some(cell);
            (self.of_cell(cell).is_none() && seen.insert(cell.key())).then_some(cell)
        };
        surfaces.iter().filter_map(cell).collect()
    }

    pub(super) fn add(&mut self, key: u64, level: u8, points: &[CellPoint], lights: Vec<CellLight>) {
        self.by_cell.insert(key, (self.points.len() as u32, points.len() as u32));
        self.points.extend_from_slice(points);
        let lit = self.lights.len()..self.lights.len() + lights.len();
        let light = lit.map(|index| index as u32).chain(std::iter::repeat(NO_POINT));
        self.sights.extend(points.iter().zip(light).map(|(point, light)| PointSight {
            position: point.surface.position,
            normal: point.surface.shading_normal,
            divided: point.divided,
            light,
        }));
        self.lights.extend(lights);
        self.levels.resize(self.points.len(), level);
        self.crowds.resize(self.points.len(), points.len() as u32);
        self.parents.resize(self.points.len(), UNLINKED);
    }

    /// Finds the points of level 0 that stand for some points; returns the number of rays.
    pub fn link<A: Accel>(&mut self, world: World<A>, numbers: &[u32]) -> u64 {
        let new = numbers.iter().copied().filter(|&number| self.parents[number as usize] == UNLINKED);
        let new: Vec<u32> = new.collect();
        let surfaces: Vec<SurfacePoint> = new.iter().map(|&number| *self.surface(number)).collect();
        let tasks: Vec<Vec<&SurfacePoint>> =
            surfaces.chunks(64).map(|chunk| chunk.iter().collect()).collect();
        let (found, rays) = self.place(world, 0, &tasks);
        for (number, parent) in new.into_iter().zip(found.into_iter().flatten()) {
            self.parents[number as usize] = parent.unwrap_or(NO_POINT);
        }
        rays
    }

    /// The point of level 0 that stands for a point that was linked, or [`NO_POINT`].
    #[inline(always)]
    pub fn parent(&self, number: u32) -> u32 {
        self.parents[number as usize]
    }

    /// A hash of a point that does not depend on its number.
    pub fn key(&self, number: u32) -> u64 {
        own_key(self.surface(number))
    }

    /// The level of cells at most as wide as given, if there is one.
    #[inline(always)]
    pub fn level_of(&self, width: f32) -> u8 {
        let mut level = 0;
        while level < FINEST && self.cells.width(level) > width {
            level += 1;
        }
        level
    }

    /// A point that stands for itself alone, where no cell has one that does.
    pub fn own(&mut self, surface: &SurfacePoint) -> u32 {
        let key = own_key(surface);
        if let Some(&(number, _)) = self.by_cell.get(&key) {
            return number;
        }
        self.add(key, FINEST + 1, &[CellPoint::alone(surface)], Vec::new());
        self.points.len() as u32 - 1
    }

    /// The point that stands for itself alone.
    pub fn find_own(&self, surface: &SurfacePoint) -> Option<u32> {
        self.by_cell.get(&own_key(surface)).map(|&(number, _)| number)
    }

    /// The point in the cell of a surface point that stands for it: of those that face about the same way the nearest, which must be seen
    /// from it where a wall divides the cell. Counts rays.
    #[inline(always)]
    pub fn find<A: Accel>(
        &self,
        accel: &A,
        last: &mut LastPlace,
        level: u8,
        surface: &SurfacePoint,
        rays: &mut u64,
    ) -> Option<u32> {
        let numbers = self.of_next_cell(self.cells.at(level, surface.position), last)?;
        let width = self.cells.width(level);
        let best = self.best(numbers.clone(), width, surface)?;
        if !self.divided(best) {
            return Some(best);
        }
        // In the smallest cells any will do.
        let any = (level == FINEST).then_some(best);
        self.nearest_seen(accel, numbers, width, surface, rays).or(any)
    }

    /// The point that stands for a surface point for which none in its cell does: one in a cell that it is nearly in and that it sees.
    pub fn find_near<A: Accel>(
        &self,
        accel: &A,
        level: u8,
        surface: &SurfacePoint,
        rays: &mut u64,
    ) -> Option<u32> {
        let width = self.cells.width(level);
        let numbers = self.cells.near(level, surface).flat_map(|cell| self.of_cell(cell).unwrap_or_default());
        self.nearest_seen(accel, numbers, width, surface, rays)
    }

    fn nearest_seen<A: Accel>(
        &self,
        accel: &A,
        numbers: impl Iterator<Item = u32>,
        width: f32,
        surface: &SurfacePoint,
        rays: &mut u64,
    ) -> Option<u32> {
        let nearest = self.nearest(numbers, width, surface).into_iter();
        nearest
            .filter(|&number| number != NO_POINT)
            .find(|&number| self.sees(accel, number, width, surface, rays))
    }

    /// The two of some points that stand best for a surface point, the better one first.
    #[inline(always)]
    pub fn nearest(
        &self,
        numbers: impl Iterator<Item = u32>,
        width: f32,
        surface: &SurfacePoint,
    ) -> [u32; 2] {
        let mut nearest = [(f32::INFINITY, NO_POINT); 2];
        for number in numbers {
            let Some(score) = self.score(number, width, surface) else { continue };
            if score < nearest[0].0 {
                nearest = [(score, number), nearest[0]];
            } else if score < nearest[1].0 {
                nearest[1] = (score, number);
            }
        }
        nearest.map(|(_, number)| number)
    }

    fn sees<A: Accel>(
        &self,
        accel: &A,
        number: u32,
        width: f32,
        surface: &SurfacePoint,
        rays: &mut u64,
    ) -> bool {
        *rays += 1;
        !accel.occluded(&line_between(surface, self.surface(number), width))
    }

    /// How badly a point stands for a surface point; `None` if it faces another way.
    #[inline(always)]
    fn score(&self, number: u32, width: f32, surface: &SurfacePoint) -> Option<f32> {
        let other = &self.sights[number as usize];
        let cosine = other.normal.dot(surface.shading_normal);
        let way = other.position - surface.position;
        let height = way.dot(surface.geometric_normal);
        // Weighs more than any way within the cell if it is more than a layer.
        let distance = way.length_squared() + 200.0 * height * height;
        (cosine > STANDS_FOR).then_some(distance / (width * width) + 2.0 * (1.0 - cosine))
    }

    #[inline(always)]
    fn best(&self, numbers: impl Iterator<Item = u32>, width: f32, surface: &SurfacePoint) -> Option<u32> {
        let mut best = (f32::INFINITY, None);
        for number in numbers {
            if let Some(score) = self.score(number, width, surface)
                && score < best.0
            {
                best = (score, Some(number));
            }
        }
        best.1
    }

    /// Bytes held, without the room that lists keep for more.
    pub fn memory_bytes(&self) -> usize {
        self.by_cell.len() * size_of::<(u64, (u32, u32))>()
            + self.points.len() * (size_of::<CellPoint>() + size_of::<PointSight>() + 2 * size_of::<u32>())
            + self.levels.len()
            + self.lights.len() * size_of::<CellLight>()
    }
}

/// A hash of a surface point.
fn own_key(surface: &SurfacePoint) -> u64 {
    let bits =
        [surface.position, surface.geometric_normal].map(|v| v.to_array().map(|number| number.to_bits()));
    bits.as_flattened().iter().fold(0x5EED, |hash, &bits| mix(hash ^ u64::from(bits)))
}
