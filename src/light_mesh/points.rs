//! A set of mesh points together with what a surface point takes from it.

use glam::Vec3;

use super::lattice::Lattice;
use super::neighbours::{Ball, Neighbours};
use super::scattered::ScatteredPoints;
use super::store::{NeededPoints, PointMask, SlotTable, UNKNOWN};
use super::tiled::{TileLayout, TiledPoints};
use super::vicinity::{Group, Vicinity};
use crate::scene::{Bounds, SurfacePoint};
use crate::settings::{Leaks, Neighbourhood, PointLayout, PointSettings, Radius, Spacing};

/// How often the points of a light mesh were asked for and evaluated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct PointCounters {
    /// Points of the whole set.
    pub total: u64,
    /// Points that lay in the neighbourhood of some surface point, summed over image blocks.
    pub needed: u64,
    /// Points that got a value; never more than once each.
    pub evaluated: u64,
    /// Surface points whose neighbourhood was empty and fell back to the nearest point.
    pub nearest_fallback: u64,
}

/// Why a light mesh can't be set up.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// Spacing below what coordinates or point numbers can express.
    #[error("spacing {0} of the light mesh is too fine for a scene of this size")]
    TooFine(Vec3),
}

/// The positions of mesh points: one interface over all layouts.
enum PointSet {
    Lattice(Lattice),
    Tiled(TiledPoints),
    Scattered(ScatteredPoints),
}

/// Runs `$body` with `$set` bound to the layout's own type.
macro_rules! with_set {
    ($points:expr, $set:ident => $body:expr) => {
        match $points {
            PointSet::Lattice($set) => $body,
            PointSet::Tiled($set) => $body,
            PointSet::Scattered($set) => $body,
        }
    };
}

/// Points for one part of space.
struct Layer {
    /// Where it holds; `None` for everywhere.
    bounds: Option<Bounds>,
    points: PointSet,
    radius: f32,
    /// Id of its first point; a multiple of 64.
    first_id: u64,
}

/// Mesh points, their slots, and the shape of D_y.
pub struct MeshPoints {
    /// The whole scene first, then the regions: the last one that holds y decides.
    layers: Vec<Layer>,
    table: SlotTable,
    neighbourhood: Neighbourhood,
    hemisphere: bool,
    leaks: Leaks,
    /// Counters since creation.
    pub counters: PointCounters,
}

/// Side of the cubes whose surface points share a search for mesh points, in units of R: smaller ones are met by fewer
/// surface points, larger ones have more points around that most of them don't need.
const CUBE_SIDE: f32 = 0.3;

/// Cubes are told apart up to this far from the origin, in units of their side.
const FARTHEST_CUBE: f32 = (1 << 20) as f32;

/// With `spacing = "auto"` the scene's diagonal is this many spacings of direct mesh points long.
pub const AUTO_SPACINGS: f32 = 120.0;

impl Layer {
    fn new(
        bounds: Bounds,
        region: Option<Bounds>,
        settings: &PointSettings,
        spacing: Vec3,
        radius: f32,
        first_id: u64,
    ) -> Result<Self, MeshError> {
        let tiled = |layout, seed| TiledPoints::new(bounds, spacing, radius, layout, seed);
        let points = match &settings.layout {
            PointLayout::List(positions) => PointSet::Scattered(ScatteredPoints::new(positions, radius)),
            _ if Lattice::too_fine(bounds, spacing) => return Err(MeshError::TooFine(spacing)),
            PointLayout::Regular => PointSet::Lattice(Lattice::new(bounds, spacing, radius)),
            PointLayout::BodyCentred => PointSet::Tiled(tiled(TileLayout::BodyCentred, 0)),
            PointLayout::Jittered { seed } => PointSet::Tiled(tiled(TileLayout::Jittered, *seed)),
            PointLayout::BlueNoise { seed } => PointSet::Tiled(tiled(TileLayout::BlueNoise, *seed)),
        };
        Ok(Self { bounds: region, points, radius, first_id })
    }
}

impl MeshPoints {
    /// The points that `settings` ask for over a scene of the given bounds, all unknown.
    pub fn new(bounds: Bounds, settings: &PointSettings) -> Result<Self, MeshError> {
        Self::with_auto_spacing(bounds, settings, AUTO_SPACINGS)
    }

    /// The same; an automatic spacing is the scene's diagonal over `auto_spacings`.
    pub fn with_auto_spacing(
        bounds: Bounds,
        settings: &PointSettings,
        auto_spacings: f32,
    ) -> Result<Self, MeshError> {
        let spacing = match settings.spacing {
            Spacing::Units(spacing) => spacing,
            Spacing::Auto => {
                let diagonal = bounds.extent().length();
                Vec3::splat(if diagonal > 0.0 { diagonal / auto_spacings } else { 1.0 })
            }
        };
        let radius_for = |spacing: Vec3| match settings.radius {
            Radius::Units(radius) => radius,
            Radius::Spacings(factor) => factor * spacing.max_element(),
        };
        let mut layers = vec![Layer::new(bounds, None, settings, spacing, radius_for(spacing), 0)?];
        let mut next_id =
            |layer: &Layer| layer.first_id + with_set!(&layer.points, set => set.brick_count()) * 64;
        for region in &settings.regions {
            let spacing = region.spacing.unwrap_or(spacing);
            let radius = region.radius.unwrap_or_else(|| radius_for(spacing));
            let first_id = layers.last().map_or(0, &mut next_id);
            let layer = Layer::new(region.bounds, Some(region.bounds), settings, spacing, radius, first_id)?;
            layers.push(layer);
        }
        let bricks = layers.last().map_or(0, next_id) / 64;
        let total = layers.iter().map(|layer| with_set!(&layer.points, set => set.len())).sum();
        Ok(Self {
            layers,
            table: SlotTable::new(bricks),
            neighbourhood: settings.neighbourhood,
            hemisphere: settings.hemisphere,
            leaks: settings.leaks,
            counters: PointCounters { total, ..PointCounters::default() },
        })
    }

    /// R at a position.
    #[inline(always)]
    pub fn radius_at(&self, y: Vec3) -> f32 {
        self.layer_at(y).radius
    }

    #[inline(always)]
    fn layer_at(&self, y: Vec3) -> &Layer {
        &self.layers[self.layer_number_at(y)]
    }

    #[inline(always)]
    fn layer_number_at(&self, y: Vec3) -> usize {
        let mut found = 0;
        for (number, layer) in self.layers.iter().enumerate().skip(1) {
            if layer.bounds.is_some_and(|bounds| bounds.contains(y)) {
                found = number;
            }
        }
        found
    }

    /// D_y of a surface point with weights, in a fixed order; returns whether it was empty and the nearest
    /// point took its place. Never empty afterwards.
    #[inline(never)]
    pub fn neighbours(&self, surface: &SurfacePoint, out: &mut Neighbours) -> bool {
        out.clear();
        let layer = self.layer_at(surface.position);
        let ball = self.ball_in(layer, surface);
        with_set!(&layer.points, set => {
            if self.neighbourhood != Neighbourhood::Nearest {
                set.gather(&ball, out);
            }
            let fallback = out.is_empty();
            if fallback {
                out.push(set.nearest(&ball), 1.0);
            }
            if layer.first_id > 0 {
                out.offset_ids(layer.first_id);
            }
            fallback && self.neighbourhood != Neighbourhood::Nearest
        })
    }

    /// [`MeshPoints::neighbours`] with slots, of known points, for one of many surface points that lie close together:
    /// `vicinity` keeps what is the same for all. It must not outlive the next [`MeshPoints::claim`].
    #[inline(always)]
    pub fn neighbours_within(
        &self,
        surface: &SurfacePoint,
        vicinity: &mut Vicinity,
        out: &mut Neighbours,
    ) -> bool {
        out.clear();
        if let Some((ball, groups)) = self.around(surface, vicinity, |_| {}) {
            for group in groups {
                let (weights, lanes) = group.weigh(&ball);
                out.push_group(group, &weights, lanes);
            }
        }
        out.is_empty() && self.known_neighbours(surface, out)
    }

    /// [`MeshPoints::neighbours`] with slots, of known points.
    #[inline(never)]
    pub fn known_neighbours(&self, surface: &SurfacePoint, out: &mut Neighbours) -> bool {
        let fallback = self.neighbours(surface, out);
        out.find_slots(|id| self.slot(id));
        fallback
    }

    /// The points in the neighbourhoods of surface points, which should lie close together: bricks and masks, unordered.
    #[inline(always)]
    pub fn needed<'a>(&self, surfaces: impl Iterator<Item = &'a SurfacePoint>) -> Vec<(u64, u64)> {
        let (mut vicinity, mut neighbours) = (Vicinity::default(), Neighbours::default());
        let mut needed = NeededPoints::default();
        for surface in surfaces {
            let mut found = 0;
            if let Some((ball, groups)) = self
                .around(surface, &mut vicinity, |group| group.needed_ids().for_each(|id| needed.insert(id)))
            {
                for group in groups {
                    let (_, lanes) = group.weigh(&ball);
                    group.needed |= lanes;
                    found |= lanes;
                }
            }
            if found == 0 {
                self.neighbours(surface, &mut neighbours);
                neighbours.ids().iter().for_each(|&id| needed.insert(id));
            }
        }
        vicinity.groups().iter().flat_map(Group::needed_ids).for_each(|id| needed.insert(id));
        needed.into_bricks().collect()
    }

    /// The ball of a surface point, and all points that may lie in it; `None` where that would be no help.
    #[inline(always)]
    fn around<'a>(
        &self,
        surface: &SurfacePoint,
        vicinity: &'a mut Vicinity,
        forget: impl FnMut(&Group),
    ) -> Option<(Ball, &'a mut [Group])> {
        let number = self.layer_number_at(surface.position);
        let layer = &self.layers[number];
        let side = CUBE_SIDE * layer.radius;
        let place = (surface.position * side.recip()).floor();
        // Where coordinates can hardly tell cubes apart, cubes say nothing about their points.
        let countable = place.abs().max_element() < FARTHEST_CUBE;
        if self.neighbourhood == Neighbourhood::Nearest || !countable {
            return None;
        }
        let cube = (number as u32, place.as_ivec3());
        let groups = vicinity.around(cube, |each| self.surround(layer, place, side, each), forget);
        Some((self.ball_in(layer, surface), groups))
    }

    /// Calls `each(id, slot, position)` for the points that may lie in the ball of some point in a cube.
    fn surround(&self, layer: &Layer, place: Vec3, side: f32, each: &mut dyn FnMut(u64, u32, Vec3)) {
        let center = (place + 0.5) * side;
        // What rounding may add to R, generously.
        let slack = 1e-4 * layer.radius + 16.0 * f32::EPSILON * center.abs().max_element();
        let reach = layer.radius + slack;
        let ball = Ball::new(center, None, reach + 0.5 * 3f32.sqrt() * side, false);
        let mut found = Neighbours::default();
        with_set!(&layer.points, set => {
            set.gather(&ball, &mut found);
            for &id in found.ids() {
                let position = set.position(id);
                let beside = ((position - center).abs() - 0.5 * side).max(Vec3::ZERO);
                if beside.length_squared() < reach * reach {
                    each(layer.first_id + id, self.table.slot(layer.first_id + id), position);
                }
            }
        });
    }

    /// Region of space whose points make up D_y of a surface point, unless the neighbourhood is the nearest point.
    pub fn ball(&self, surface: &SurfacePoint) -> Ball {
        self.ball_in(self.layer_at(surface.position), surface)
    }

    #[inline(always)]
    fn ball_in(&self, layer: &Layer, surface: &SurfacePoint) -> Ball {
        let normal = self.hemisphere.then_some(surface.geometric_normal);
        let smooth = self.neighbourhood == Neighbourhood::SmoothSphere;
        Ball::new(surface.position, normal, layer.radius, smooth)
    }

    /// Position of a point.
    pub fn position(&self, id: u64) -> Vec3 {
        let index = self.layers.partition_point(|layer| layer.first_id <= id).saturating_sub(1);
        let layer = &self.layers[index];
        with_set!(&layer.points, set => set.position(id - layer.first_id))
    }

    /// Makes the needed points known; returns the positions of those that were not, in slot order.
    pub fn claim(&mut self, needed: &PointMask) -> Vec<Vec3> {
        let new = self.table.claim(needed);
        self.counters.needed += needed.len();
        self.counters.evaluated += new.len() as u64;
        new.into_iter().map(|id| self.position(id)).collect()
    }

    /// Slot of a known point.
    #[inline(always)]
    pub fn slot(&self, id: u64) -> u32 {
        let slot = self.table.slot(id);
        debug_assert_ne!(slot, UNKNOWN, "a point that is used was never claimed");
        slot
    }

    /// What is done against leaks.
    pub fn leaks(&self) -> Leaks {
        self.leaks
    }

    /// R outside of all regions, scene units.
    pub fn radius(&self) -> f32 {
        self.layers[0].radius
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        self.table.memory_bytes()
    }
}
