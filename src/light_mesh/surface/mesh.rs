//! The surface mesh: its points, and the light that is known at them.

use std::ops::Range;

use glam::Vec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::directions::{HemisphereDirections, part};
use super::gather::Gather;
use super::gathered::Gathered;
use super::interpolate::{interpolate, neighbours};
use super::last_place::LastPlace;
use super::points::{FINEST, SurfacePoints};
use crate::accel::Accel;
use crate::scene::{PixelFootprint, SurfacePoint};
use crate::settings::IndirectSettings;
use crate::world::World;

/// Points on surfaces with the light that falls on them from other surfaces.
///
/// Points that surface points are interpolated from, records, gather with all directions, with fewer if they stand for little of a view; a
/// quarter of these tell first whether smaller cells should take their place. What the rays hit belongs to points of level 0. Light of lights there
/// is that of the point where it is even, and asked for with a shadow ray where it isn't. Light from surfaces comes from the point, a source, which
/// gathers it with the more directions the more of its light arrives at records.
pub struct SurfaceMesh {
    pub(super) settings: IndirectSettings,
    pub(super) points: SurfacePoints,
    directions: HemisphereDirections,
    /// The view that is rendered.
    pub(super) view: SurfaceView,
    /// By point.
    pub(super) states: Vec<State>,
    /// What direct light is multiplied by before k_d.
    scale: f32,
    /// By point: what falls on sources from surfaces over π.
    pub(super) indirect: Vec<Vec3>,
    /// By point: what falls on records from surfaces over π.
    pub(super) received: Vec<Vec3>,
    /// Records that surface points around each are interpolated from, by point: stretches of `lists`.
    list_of: Vec<Range<u32>>,
    lists: Vec<u32>,
    /// What points that were looked at see, until they are evaluated.
    pub(super) looked: Gathered,
    /// Records of the view.
    pub(super) records: Vec<u32>,
}

/// How fine a picture is.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceView {
    /// Pixels where camera rays end.
    pub footprint: PixelFootprint,
    /// Rows of pixels.
    pub height: u32,
}

/// What is known of a point.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct State {
    /// Where what it sees is among the looked at, plus one.
    pub(super) looked_at: u32,
    /// Harmonic mean distance of the surfaces that it sees, 0 if it has not been looked at.
    pub(super) distance: f32,
    /// Whether light from surfaces is known: as a record, as a source.
    pub(super) received: bool,
    pub(super) solved: bool,
    /// Surface points of the view that it is the nearest record of: if there are any, it is one.
    pub(super) stands_for: u32,
}

impl State {
    /// Forgets what belongs to a view.
    pub(super) fn leave_view(&mut self) {
        (self.looked_at, self.stands_for) = (0, 0);
    }
}

/// Points are looked at with one in so many directions.
pub(super) const LOOK: u32 = 4;
/// Width of cells, per distance along a ray, whose mean light will do.
pub(super) const FINENESS: f32 = 0.5;

/// What the evaluation of a surface mesh took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SurfaceEvaluation {
    /// Points that gathered light.
    pub evaluated: u64,
    /// Points that surface points are interpolated from.
    pub needed: u64,
    /// Rays that gather.
    pub rays: u64,
    /// Occlusion rays, and rays that look for surfaces in cells.
    pub shadow: u64,
}

impl SurfaceMesh {
    /// With no point known; cells have the given width, `scale` is that of direct light.
    pub fn new(settings: &IndirectSettings, width: f32, scale: f32) -> Self {
        let footprint = PixelFootprint { eye: Vec3::ZERO, edge: 0.0 };
        Self {
            settings: settings.clone(),
            points: SurfacePoints::new(width),
            directions: HemisphereDirections::new(settings.directions),
            view: SurfaceView { footprint, height: 1 },
            states: Vec::new(),
            scale,
            indirect: Vec::new(),
            received: Vec::new(),
            list_of: Vec::new(),
            lists: Vec::new(),
            looked: Gathered::default(),
            records: Vec::new(),
        }
    }

    /// Turns to another view: surface points that are needed from now on belong to it.
    pub fn turn_to(&mut self, view: SurfaceView) {
        self.view = view;
        self.records.iter().for_each(|&number| self.states[number as usize].stands_for = 0);
        self.records.clear();
        self.lists.clear();
    }

    /// The view that it was turned to.
    pub fn view(&self) -> &SurfaceView {
        &self.view
    }

    /// Finds which records of the view surface points around each record are interpolated from; returns the number of rays.
    fn list<A: Accel>(&mut self, accel: &A) -> u64 {
        let (points, states) = (&self.points, &self.states);
        let lists: Vec<(Vec<u32>, u64)> = self
            .records
            .par_iter()
            .map(|&number| {
                let mut list = Vec::new();
                let rays = neighbours(
                    accel,
                    points,
                    number,
                    |other| states[other as usize].stands_for > 0,
                    &mut list,
                );
                (list, rays)
            })
            .collect();
        for (&number, (list, _)) in self.records.iter().zip(&lists) {
            let first = self.lists.len() as u32;
            self.lists.extend_from_slice(list);
            self.list_of[number as usize] = first..self.lists.len() as u32;
        }
        lists.iter().map(|(_, rays)| rays).sum()
    }

    /// Evaluates the records of the view, and all that they depend on.
    pub fn evaluate<A: Accel>(&mut self, world: World<A>) -> SurfaceEvaluation {
        let mut evaluation = SurfaceEvaluation::default();
        // Sums must not depend on the order in which points were found.
        self.records.sort_by_cached_key(|&number| self.points.key(number));
        evaluation.shadow += self.list(world.accel);
        let states = &self.states;
        let unknown = |number: &u32| !states[*number as usize].received;
        let new: Vec<u32> = self.records.iter().copied().filter(unknown).collect();
        evaluation.needed = self.records.len() as u64;
        evaluation.evaluated = new.len() as u64;
        self.look(world, new.clone(), &mut evaluation);
        let sight = self.see(world, &new, &mut evaluation);
        evaluation.shadow += self.points.link(world, &new);
        let sources = self.find_sources(world, &sight, &mut evaluation);
        let IndirectSettings { bounces, tolerance, .. } = self.settings;
        sources.solve(&mut self.indirect, bounces.saturating_sub(1), tolerance);
        let mut received = sight.received(&self.indirect);
        if self.correct(&sources, &sight.records, &received) {
            received = sight.received(&self.indirect);
        }
        for (record, light) in sight.records.iter().zip(received) {
            self.received[record.number as usize] = light;
            self.states[record.number as usize].received = true;
        }
        evaluation
    }

    /// Lets points that may become records look around, which shows how near other surfaces are.
    pub(super) fn look<A: Accel>(
        &mut self,
        world: World<A>,
        mut numbers: Vec<u32>,
        evaluation: &mut SurfaceEvaluation,
    ) {
        numbers.retain(|&number| self.states[number as usize].looked_at == 0);
        let count = part(self.settings.directions, LOOK);
        let gathered = self.gather(world, 0..count, FINENESS, numbers, evaluation);
        for (index, (&number, &closeness)) in gathered.points.iter().zip(&gathered.closeness).enumerate() {
            let state = &mut self.states[number as usize];
            state.looked_at = (self.looked.points.len() + index) as u32 + 1;
            state.distance = count as f32 / closeness.max(f32::MIN_POSITIVE);
        }
        self.looked.append(gathered);
    }

    /// Traces the rays of some points in a range of the directions.
    pub(super) fn gather<A: Accel>(
        &mut self,
        world: World<A>,
        range: Range<u32>,
        fineness: f32,
        numbers: Vec<u32>,
        evaluation: &mut SurfaceEvaluation,
    ) -> Gathered {
        let share = range.len() as u32 * self.settings.emitter_samples;
        let gather = Gather {
            world,
            scale: self.scale,
            directions: &self.directions,
            emitter_samples: share / self.settings.directions.max(1),
            range,
            fineness,
        };
        let (gathered, shadow) = gather.run(&mut self.points, numbers);
        evaluation.rays += gathered.rays.len() as u64;
        evaluation.shadow += shadow;
        self.extend();
        gathered
    }

    /// Makes room for points that were added.
    pub(super) fn extend(&mut self) {
        let count = self.points.len();
        self.states.resize(count, State::default());
        self.indirect.resize(count, Vec3::ZERO);
        self.received.resize(count, Vec3::ZERO);
        self.list_of.resize(count, 0..0);
    }

    /// Adds what surface points, which were needed, receive from surfaces, over π and times `scale`, to their light; counts rays.
    #[inline(always)]
    pub fn illuminate<'s, A: Accel>(
        &self,
        accel: &A,
        surfaces: impl Iterator<Item = &'s SurfacePoint>,
        scale: f32,
        light: &mut [Vec3],
    ) -> u64 {
        let mut scratch = SurfaceScratch::default();
        for (surface, light) in surfaces.zip(light) {
            let Some(number) = self.place(accel, surface, &mut scratch) else { continue };
            let list = self.list_of[number as usize].clone();
            let list = self.lists.get(list.start as usize..list.end as usize).unwrap_or_default();
            *light += interpolate(&self.points, surface, list, &self.received) * scale;
        }
        scratch.rays
    }

    #[inline(always)]
    fn place<A: Accel>(
        &self,
        accel: &A,
        surface: &SurfacePoint,
        scratch: &mut SurfaceScratch,
    ) -> Option<u32> {
        let mut found = None;
        for level in self.first_level(surface)..=FINEST {
            let last = &mut scratch.last[usize::from(level)];
            let place = self.points.find(accel, last, level, surface, &mut scratch.rays);
            let place = place.or_else(|| self.points.find_near(accel, level, surface, &mut scratch.rays));
            found = place.or(found);
            if place.is_some_and(|number| !self.refined(number)) {
                break;
            }
        }
        found.or_else(|| self.points.find_own(surface))
    }

    /// Bytes held, without the room that lists keep for more.
    pub fn memory_bytes(&self) -> usize {
        self.points.memory_bytes()
            + self.states.len() * size_of::<State>()
            + (self.indirect.len() + self.received.len()) * size_of::<Vec3>()
            + self.list_of.len() * size_of::<Range<u32>>()
            + (self.lists.len() + self.records.len()) * size_of::<u32>()
    }
}

/// Working memory and counters of one thread.
#[derive(Default)]
struct SurfaceScratch {
    last: [LastPlace; FINEST as usize + 1],
    /// Occlusion rays.
    rays: u64,
}
