//! A set of mesh points together with what a surface point takes from it.

use glam::Vec3;

use super::ids::{LAYER_SHIFT, MOST_LAYERS, anchor, too_fine};
use super::lattice::Lattice;
use super::neighbours::{Ball, Neighbours};
use super::scattered::ScatteredPoints;
use super::store::{NeededPoints, PointMask, SlotTable, UNKNOWN};
use super::tiled::{TileLayout, TiledPoints};
use super::vicinity::{Group, Surroundings, Vicinity};
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
    /// More different spacings than point numbers can tell apart.
    #[error("the regions of the light mesh have {0} different spacings; at most {MOST_LAYERS} are possible")]
    TooManySpacings(usize),
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

/// All points of one spacing.
struct Layer {
    spacing: Vec3,
    points: PointSet,
    /// Id of its first point.
    first_id: u64,
}

/// A part of space with points and a radius of its own.
struct Zone {
    /// Where it holds; `None` for everywhere.
    bounds: Option<Bounds>,
    /// Number of its layer.
    layer: usize,
    radius: f32,
    /// The ball of this radius, around any point.
    ball: Ball,
    /// Side of the cubes whose surface points share a search for mesh points, and 1 over it; `None` where D_y is no
    /// ball, or where coordinates are so large that they hardly tell cubes apart.
    cubes: Option<(f32, f32)>,
}

/// Mesh points, their slots, and the shape of D_y.
pub struct MeshPoints {
    layers: Vec<Layer>,
    /// The whole scene first, then the regions: the last one that holds y decides.
    zones: Vec<Zone>,
    table: SlotTable,
    neighbourhood: Neighbourhood,
    hemisphere: bool,
    leaks: Leaks,
    /// Counters since creation.
    pub counters: PointCounters,
}

/// Side of the cubes in units of R: smaller ones are met by fewer surface points, larger ones have more mesh points around
/// that most of them don't need.
const CUBE_SIDE: f32 = 0.3;

/// Cubes are told apart up to this far from the origin, in units of their side.
const FARTHEST_CUBE: f32 = (1 << 20) as f32;

/// With `spacing = "auto"` the scene's diagonal is this many spacings of direct mesh points long.
pub const AUTO_SPACINGS: f32 = 120.0;

impl Layer {
    fn new(bounds: Bounds, layout: &PointLayout, spacing: Vec3, number: usize) -> Result<Self, MeshError> {
        let anchor = anchor(bounds, spacing);
        let tiled = |layout, seed| TiledPoints::new(anchor, spacing, layout, seed);
        let points = match layout {
            PointLayout::List(positions) => PointSet::Scattered(ScatteredPoints::new(positions)),
            _ if too_fine(bounds, spacing) => return Err(MeshError::TooFine(spacing)),
            PointLayout::Regular => PointSet::Lattice(Lattice::new(anchor, spacing)),
            PointLayout::BodyCentred => PointSet::Tiled(tiled(TileLayout::BodyCentred, 0)),
            PointLayout::Jittered { seed } => PointSet::Tiled(tiled(TileLayout::Jittered, *seed)),
            PointLayout::BlueNoise { seed } => PointSet::Tiled(tiled(TileLayout::BlueNoise, *seed)),
        };
        Ok(Self { spacing, points, first_id: (number as u64) << LAYER_SHIFT })
    }
}

impl Zone {
    fn new(
        bounds: Bounds,
        region: Option<Bounds>,
        neighbourhood: Neighbourhood,
        layer: usize,
        radius: f32,
    ) -> Self {
        let ball = Ball::new(Vec3::ZERO, None, radius, neighbourhood == Neighbourhood::SmoothSphere);
        let side = CUBE_SIDE * radius;
        let farthest = bounds.min.abs().max(bounds.max.abs()).max_element() / side;
        let shared =
            neighbourhood != Neighbourhood::Nearest && (bounds.is_empty() || farthest < FARTHEST_CUBE);
        Self { bounds: region, layer, radius, ball, cubes: shared.then_some((side, 1.0 / side)) }
    }
}

fn position(layers: &[Layer], id: u64) -> Vec3 {
    let layer = &layers[(id >> LAYER_SHIFT) as usize];
    with_set!(&layer.points, set => set.position(id - layer.first_id))
}

/// Slot of a known point of another layer at the position of a point.
fn twin(layers: &[Layer], table: &SlotTable, id: u64) -> Option<u32> {
    if layers.len() == 1 {
        return None;
    }
    let at = position(layers, id);
    let others = layers.iter().enumerate().filter(|(number, _)| *number as u64 != id >> LAYER_SHIFT);
    let twins = others.filter_map(|(_, layer)| {
        with_set!(&layer.points, set => set.id_at(at)).map(|id| layer.first_id + id)
    });
    twins.map(|id| table.slot(id)).find(|slot| *slot != UNKNOWN)
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
        let mut layers: Vec<Layer> = Vec::new();
        let mut zone = |region: Option<Bounds>, spacing: Vec3, radius: f32| {
            // Parts of space with the same spacing share their points; a list has no spacing at all.
            let same =
                |layer: &Layer| layer.spacing == spacing || matches!(settings.layout, PointLayout::List(_));
            let known = layers.iter().position(same);
            let layer = known.unwrap_or(layers.len());
            if known.is_none() {
                layers.push(Layer::new(bounds, &settings.layout, spacing, layer)?);
            }
            Ok(Zone::new(bounds, region, settings.neighbourhood, layer, radius))
        };
        let mut zones = vec![zone(None, spacing, radius_for(spacing))?];
        for region in &settings.regions {
            let spacing = region.spacing.unwrap_or(spacing);
            let radius = region.radius.unwrap_or_else(|| radius_for(spacing));
            zones.push(zone(Some(region.bounds), spacing, radius)?);
        }
        if layers.len() > MOST_LAYERS {
            return Err(MeshError::TooManySpacings(layers.len()));
        }
        let mut points = Self {
            layers,
            zones,
            table: SlotTable::default(),
            neighbourhood: settings.neighbourhood,
            hemisphere: settings.hemisphere,
            leaks: settings.leaks,
            counters: PointCounters::default(),
        };
        points.counters.total = points.count_over(bounds);
        Ok(points)
    }

    /// Number of points that neighbourhoods of surface points in the bounds can reach, of each spacing over the parts of space
    /// that have it.
    fn count_over(&self, bounds: Bounds) -> u64 {
        if bounds.is_empty() {
            return 0;
        }
        let count = |zone: &Zone| {
            let of = zone.bounds.unwrap_or(bounds);
            let reached = Bounds { min: of.min - zone.radius, max: of.max + zone.radius };
            with_set!(&self.layers[zone.layer].points, set => set.count_in(reached))
        };
        self.zones.iter().map(count).sum()
    }

    /// R at a position.
    #[inline(always)]
    pub fn radius_at(&self, y: Vec3) -> f32 {
        self.zones[self.zone_number_at(y)].radius
    }

    #[inline(always)]
    fn zone_number_at(&self, y: Vec3) -> usize {
        let mut found = 0;
        for (number, zone) in self.zones.iter().enumerate().skip(1) {
            if zone.bounds.is_some_and(|bounds| bounds.contains(y)) {
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
        let zone = &self.zones[self.zone_number_at(surface.position)];
        let layer = &self.layers[zone.layer];
        let ball = self.ball_in(zone, surface);
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
        if let Some((ball, around)) = self.around(surface, vicinity, |_| {}) {
            for group in around.groups {
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
            if let Some((ball, around)) = self
                .around(surface, &mut vicinity, |group| group.needed_ids().for_each(|id| needed.insert(id)))
            {
                for group in around.groups {
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
    pub(super) fn around<'a>(
        &self,
        surface: &SurfacePoint,
        vicinity: &'a mut Vicinity,
        forget: impl FnMut(&Group),
    ) -> Option<(Ball, Surroundings<'a>)> {
        let number = self.zone_number_at(surface.position);
        let zone = &self.zones[number];
        let (side, inverse) = zone.cubes?;
        let place = (surface.position * inverse).floor();
        let cube = (number as u32, place.as_ivec3());
        let around = vicinity.around(cube, |each| self.surround(zone, place, side, each), forget);
        Some((self.ball_in(zone, surface), around))
    }

    /// Calls `each(id, slot, position)` for the points that may lie in the ball of some point in a cube.
    fn surround(&self, zone: &Zone, place: Vec3, side: f32, each: &mut dyn FnMut(u64, u32, Vec3)) {
        let center = (place + 0.5) * side;
        // What rounding may add to R, generously.
        let slack = 1e-4 * zone.radius + 16.0 * f32::EPSILON * center.abs().max_element();
        let reach = zone.radius + slack;
        let layer = &self.layers[zone.layer];
        let half = Vec3::splat(0.5 * side + reach);
        with_set!(&layer.points, set => set.for_each_in_box(center - half, center + half, |id, position| {
            let beside = ((position - center).abs() - 0.5 * side).max(Vec3::ZERO);
            if beside.length_squared() < reach * reach {
                each(layer.first_id + id, self.table.slot(layer.first_id + id), position);
            }
        }));
    }

    /// Region of space whose points make up D_y of a surface point, unless the neighbourhood is the nearest point.
    pub fn ball(&self, surface: &SurfacePoint) -> Ball {
        self.ball_in(&self.zones[self.zone_number_at(surface.position)], surface)
    }

    #[inline(always)]
    fn ball_in(&self, zone: &Zone, surface: &SurfacePoint) -> Ball {
        let normal = self.hemisphere.then_some(surface.geometric_normal);
        zone.ball.around(surface.position, normal)
    }

    /// Position of a point.
    pub fn position(&self, id: u64) -> Vec3 {
        position(&self.layers, id)
    }

    /// Makes the needed points known; returns the positions of those that were not, in slot order.
    pub fn claim(&mut self, needed: &PointMask) -> Vec<Vec3> {
        let layers = &self.layers;
        let new = self.table.claim(needed, |table, id| twin(layers, table, id));
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
        self.zones[0].radius
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        self.table.memory_bytes()
    }
}
