//! The shape of D_y in every part of space (method §3, §8).

use glam::{UVec3, Vec3};

use super::cells::{CellCache, PacketWriter, PointPacket, Surroundings};
use super::ids::finest;
use super::kernel::Kernel;
use super::neighbours::Neighbours;
use super::point_set::{MeshError, PointSet};
use super::rounded_box::RoundedBox;
use crate::Bounds;
use crate::scene::{PixelFootprint, SurfacePoint};
use crate::settings::{
    IndirectSettings, KernelSettings, Neighbourhood, PointLayout, PointSettings, Radius, Spacing,
};

/// A part of space with points and a radius of its own.
struct Zone {
    /// Where it holds; `None` for everywhere.
    bounds: Option<Bounds>,
    /// Number of its layer of points.
    layer: usize,
    /// The layer's largest spacing along an axis.
    spacing: f32,
    radius: f32,
    /// The kernel of this radius, around any point.
    kernel: Kernel,
    /// Side of the cells whose surface points share a search for mesh points, and 1 over it; `None` where D_y is no
    /// ball, or where coordinates are so large that cells are hardly distinct.
    cells: Option<(f32, f32)>,
}

/// Side of the cells in units of R: smaller ones hold fewer surface points, larger ones have more mesh points around
/// that most of them don't need.
const CELL_SIDE: f32 = 0.3;

/// Cells are distinct up to this far from the origin, in units of their side.
const FARTHEST_CELL: f32 = (1 << 20) as f32;

/// Which layer of points and which kernel a surface point takes.
pub struct Neighbourhoods {
    /// The whole scene first, then its rings around the eye, then the regions: the last one that holds y decides.
    zones: Vec<Zone>,
    eye: Vec3,
    /// Squared distances from the eye at which rings begin, in ascending order.
    rings: Vec<f32>,
    neighbourhood: Neighbourhood,
    hemisphere: bool,
    /// Points per cell of the layout.
    per_cell: f32,
}

impl Neighbourhoods {
    /// Adds the layers that the settings name to `points`; `auto` says what an automatic spacing follows from.
    ///
    /// # Errors
    /// See [`MeshError`].
    pub(crate) fn new(
        points: &mut PointSet,
        settings: &PointSettings,
        kernel: &KernelSettings,
        auto: AutoSpacing,
    ) -> Result<Self, MeshError> {
        let bounds = points.bounds();
        let diagonal = bounds.extent().length();
        let (mut levels, mut eye, mut rings) = (Vec::new(), Vec3::ZERO, Vec::new());
        let spacing = match (settings.spacing, auto) {
            (Spacing::Units(spacing), _) => spacing,
            (Spacing::Auto, AutoSpacing::Pixels(footprint)) if diagonal > 0.0 => {
                eye = footprint.eye;
                levels = ring_levels(bounds, footprint);
                rings = levels.iter().skip(1).map(|level| level.begin * level.begin).collect();
                Vec3::splat(levels.first().map_or(diagonal, |level| level.spacing))
            }
            (Spacing::Auto, AutoSpacing::Scene { spacings }) if diagonal > 0.0 => {
                Vec3::splat((diagonal / spacings).max(finest(bounds)))
            }
            _ => Vec3::ONE,
        };
        let radius_for = |spacing: Vec3| match kernel.radius {
            Radius::Units(radius) => radius,
            Radius::Spacings(factor) => factor * spacing.max_element(),
        };
        let mut zone = |region: Option<Bounds>, spacing: Vec3, radius: f32| {
            let layer = points.layer(&settings.layout, spacing, settings.levels)?;
            Ok(Zone::new(bounds, region, kernel.neighbourhood, layer, spacing.max_element(), radius))
        };
        let mut zones = vec![zone(None, spacing, radius_for(spacing))?];
        for level in levels.iter().skip(1) {
            let spacing = Vec3::splat(level.spacing);
            zones.push(zone(None, spacing, radius_for(spacing))?);
        }
        for region in &settings.regions {
            let spacing = region.spacing.unwrap_or(spacing);
            let radius = region.radius.unwrap_or_else(|| radius_for(spacing));
            zones.push(zone(Some(region.bounds), spacing, radius)?);
        }
        let (neighbourhood, hemisphere) = (kernel.neighbourhood, kernel.hemisphere);
        let per_cell = if settings.layout == PointLayout::BodyCentred { 2.0 } else { 1.0 };
        Ok(Self { zones, eye, rings, neighbourhood, hemisphere, per_cell })
    }

    /// About how many points the neighbourhoods of surface points can reach.
    pub(crate) fn count(&self, points: &PointSet) -> u64 {
        let bounds = points.bounds();
        let reach = |of: Bounds, zone: &Zone| {
            points.count_in(zone.layer, Bounds { min: of.min - zone.radius, max: of.max + zone.radius })
        };
        // The part of the scene in a box around the ball of a radius.
        let within = |squared: f32| Bounds {
            min: bounds.min.max(self.eye - squared.sqrt()),
            max: bounds.max.min(self.eye + squared.sqrt()),
        };
        let count = |(number, zone): (usize, &Zone)| {
            if number > self.rings.len() || self.rings.is_empty() {
                return reach(zone.bounds.unwrap_or(bounds), zone);
            }
            let outer = self.rings.get(number).map_or(bounds, |end| within(*end));
            let inner = number.checked_sub(1).and_then(|inner| self.rings.get(inner));
            let count = |of: Bounds| if of.is_empty() { 0 } else { reach(of, zone) };
            count(outer).saturating_sub(inner.map_or(0, |begin| count(within(*begin))))
        };
        if bounds.is_empty() { 0 } else { self.zones.iter().enumerate().map(count).sum() }
    }

    /// A box in parts of at most some hundred thousand points each.
    pub(crate) fn parts_of(&self, bounds: Bounds) -> Vec<Bounds> {
        let finest = self.zones.iter().map(|zone| zone.spacing).fold(f32::INFINITY, f32::min);
        let side = Vec3::splat(64.0 * finest);
        let counts = (bounds.extent() / side).ceil().max(Vec3::ONE).min(Vec3::splat(1024.0)).as_uvec3();
        let side = bounds.extent() / counts.as_vec3();
        let part = |x: u32, y: u32, z: u32| {
            let min = bounds.min + UVec3::new(x, y, z).as_vec3() * side;
            Bounds { min, max: min + side }
        };
        let rows = (0..counts.z).flat_map(|z| (0..counts.y).map(move |y| (y, z)));
        rows.flat_map(|(y, z)| (0..counts.x).map(move |x| part(x, y, z))).collect()
    }

    /// Calls `each` with all points in a box that have the spacing of the place where they lie.
    pub(crate) fn for_each_in(&self, points: &PointSet, bounds: Bounds, mut each: impl FnMut(u64)) {
        for (number, zone) in self.zones.iter().enumerate() {
            points.for_each_in_box(zone.layer, bounds.min, bounds.max, |id, position| {
                if bounds.contains(position) && self.zone_number_at(position) == number {
                    each(id);
                }
            });
        }
    }

    #[inline(always)]
    fn zone_number_at(&self, y: Vec3) -> usize {
        let mut found = 0;
        if !self.rings.is_empty() {
            let distance = y.distance_squared(self.eye);
            found = self.rings.iter().take_while(|begin| distance >= **begin).count();
        }
        for (number, zone) in self.zones.iter().enumerate().skip(1 + self.rings.len()) {
            if zone.bounds.is_some_and(|bounds| bounds.contains(y)) {
                found = number;
            }
        }
        found
    }

    /// Spacing where neither rings nor regions have their own, along the longest axis.
    pub(crate) fn spacing(&self) -> Vec3 {
        Vec3::splat(self.zones.first().map_or(0.0, |zone| zone.spacing))
    }

    /// R where neither rings nor regions have their own.
    pub(crate) fn radius(&self) -> f32 {
        self.zones.first().map_or(0.0, |zone| zone.radius)
    }

    /// R at a position.
    #[inline(always)]
    pub(crate) fn radius_at(&self, y: Vec3) -> f32 {
        self.zones[self.zone_number_at(y)].radius
    }

    /// Whether the weights of points change smoothly with the position.
    pub(crate) fn is_smooth(&self) -> bool {
        self.neighbourhood == Neighbourhood::SmoothSphere
    }

    /// About how many points D_y has there.
    pub(crate) fn points_around(&self) -> f32 {
        self.zones.first().map_or(0.0, |zone| {
            let ball =
                4.0 / 3.0 * std::f32::consts::PI * (zone.radius / zone.spacing).powi(3) * self.per_cell;
            if self.hemisphere { 0.5 * ball } else { ball }
        })
    }

    /// Spacing of the mesh points at a position.
    #[inline(always)]
    pub(crate) fn spacing_at(&self, y: Vec3) -> f32 {
        self.zones[self.zone_number_at(y)].spacing
    }

    /// The kernel of a surface point, unless the neighbourhood is the nearest point.
    pub(crate) fn kernel(&self, surface: &SurfacePoint) -> Kernel {
        self.kernel_in(&self.zones[self.zone_number_at(surface.position)], surface)
    }

    #[inline(always)]
    fn kernel_in(&self, zone: &Zone, surface: &SurfacePoint) -> Kernel {
        let normal = self.hemisphere.then_some(surface.geometric_normal);
        zone.kernel.around(surface.position, normal)
    }

    /// D_y of a surface point with weights, in a fixed order; returns whether it was empty and the nearest
    /// point took its place. Never empty afterwards.
    #[inline(never)]
    pub fn find(&self, points: &PointSet, surface: &SurfacePoint, out: &mut Neighbours) -> bool {
        out.clear();
        let zone = &self.zones[self.zone_number_at(surface.position)];
        let kernel = self.kernel_in(zone, surface);
        if self.neighbourhood != Neighbourhood::Nearest {
            points.gather(zone.layer, &kernel, out);
        }
        let fallback = out.is_empty();
        if fallback {
            out.push(points.nearest(zone.layer, &kernel), 1.0);
        }
        fallback && self.neighbourhood != Neighbourhood::Nearest
    }

    /// The kernel of a surface point, and all points that may lie in it, from the cell cache; `None` where that would be no
    /// help. `slot` gives the slots of points; `forget` receives the packets that the cache drops.
    #[inline(always)]
    pub(crate) fn around<'a>(
        &self,
        points: &PointSet,
        surface: &SurfacePoint,
        cells: &'a mut CellCache,
        slot: impl Fn(u64) -> u32,
        forget: impl FnMut(&PointPacket),
    ) -> Option<(Kernel, Surroundings<'a>)> {
        let number = self.zone_number_at(surface.position);
        let zone = &self.zones[number];
        let (side, inverse) = zone.cells?;
        let place = (surface.position * inverse).floor();
        let cell = (number as u32, place.as_ivec3());
        let surround = |packets: &mut PacketWriter| {
            zone.surround(points, place, side, |id, position| packets.push(id, slot(id), position));
        };
        let around = cells.around(cell, surround, forget);
        Some((self.kernel_in(zone, surface), around))
    }
}

/// What an automatic spacing follows from.
#[derive(Clone, Copy, Debug)]
pub enum AutoSpacing {
    /// The scene's size: its diagonal is this many spacings long.
    Scene {
        /// See above.
        spacings: f32,
    },
    /// The size of a view's pixels where it ends.
    Pixels(PixelFootprint),
}

impl AutoSpacing {
    /// What direct mesh points take whose values are averaged.
    pub const AVERAGED: Self = Self::Scene { spacings: 72.0 };
    /// What indirect mesh points take.
    pub const GATHERED: Self = Self::Scene { spacings: 120.0 / IndirectSettings::COARSENESS };
}

/// A part of space around the eye with mesh points of one spacing.
struct RingLevel {
    spacing: f32,
    /// Distance from the eye at which it begins.
    begin: f32,
}

/// Mesh points are at most this many pixels apart, and at least half as many.
const PIXELS: f32 = 40.0;
/// A scene's diagonal is at least so many spacings long, and at most.
const SPACINGS: [f32; 2] = [16.0, 4096.0];

/// The spacings of a view, nearest first. They are powers of 2, so that views share mesh points.
fn ring_levels(bounds: Bounds, footprint: PixelFootprint) -> Vec<RingLevel> {
    let per_distance = PIXELS * footprint.edge;
    let diagonal = bounds.extent().length();
    let farthest = (bounds.min - footprint.eye).abs().max((bounds.max - footprint.eye).abs()).length();
    let exponent = |spacing: f32| spacing.log2().floor() as i32;
    // Far from the origin, finer points would have one coordinate.
    let least = exponent(finest(bounds)) + 1;
    let last = exponent((farthest * per_distance).min(diagonal / SPACINGS[0])).max(least);
    let first = exponent(diagonal / SPACINGS[1]).max(least).min(last);
    (first..=last)
        .map(|exponent| {
            let spacing = (exponent as f32).exp2();
            RingLevel { spacing, begin: spacing / per_distance }
        })
        .collect()
}

impl Zone {
    fn new(
        bounds: Bounds,
        region: Option<Bounds>,
        neighbourhood: Neighbourhood,
        layer: usize,
        spacing: f32,
        radius: f32,
    ) -> Self {
        let kernel = Kernel::new(Vec3::ZERO, None, radius, neighbourhood == Neighbourhood::SmoothSphere);
        let side = CELL_SIDE * radius;
        let farthest = bounds.min.abs().max(bounds.max.abs()).max_element() / side;
        let shared =
            neighbourhood != Neighbourhood::Nearest && (bounds.is_empty() || farthest < FARTHEST_CELL);
        Self { bounds: region, layer, spacing, radius, kernel, cells: shared.then_some((side, 1.0 / side)) }
    }

    /// Calls `each(id, position)` for the points that may lie in the kernel of some point in a cell.
    #[inline(always)]
    fn surround(&self, points: &PointSet, place: Vec3, side: f32, each: impl FnMut(u64, Vec3)) {
        let center = (place + 0.5) * side;
        // What rounding may add to R, generously.
        let slack = 1e-4 * self.radius + 16.0 * f32::EPSILON * center.abs().max_element();
        let (half, reach) = (0.5 * side, self.radius + slack);
        let near = RoundedBox { min: center - half, max: center + half, reach };
        points.for_each_near(self.layer, &near, each);
    }
}

#[cfg(test)]
mod tests {
    use super::super::ids::too_fine;
    use super::*;

    /// Where a ring begins its spacing is at most [`PIXELS`] pixels, and more than half as many where it ends; spacings are
    /// powers of 2, whatever the scene's unit.
    #[test]
    fn rings_follow_the_size_of_pixels() {
        for scale in [1e-3, 1.0, 250.0] {
            let bounds = Bounds { min: Vec3::splat(-scale), max: Vec3::splat(3.0 * scale) };
            let footprint = PixelFootprint { eye: Vec3::ZERO, edge: 1e-3 };
            let levels = ring_levels(bounds, footprint);
            assert!(levels.len() > 2);
            for (level, next) in levels.iter().zip(&levels[1..]) {
                assert_eq!(level.spacing.log2().fract(), 0.0);
                let pixels = |distance: f32| level.spacing / (footprint.edge * distance);
                assert!((pixels(level.begin) - PIXELS).abs() < 1e-3 * PIXELS);
                assert!((pixels(next.begin) - 0.5 * PIXELS).abs() < 1e-3 * PIXELS);
            }
        }
    }

    /// However far from the origin a scene lies, its spacings are such as coordinates can hold.
    #[test]
    fn rings_far_from_the_origin_are_no_finer_than_coordinates() {
        for far in [1e2, 1e4, 1e6] {
            let bounds = Bounds { min: Vec3::splat(far), max: Vec3::splat(far + 8.0) };
            let footprint = PixelFootprint { eye: Vec3::splat(far + 4.0), edge: 1e-3 };
            let levels = ring_levels(bounds, footprint);
            assert!(!levels.is_empty());
            assert!(levels.iter().all(|level| !too_fine(bounds, Vec3::splat(level.spacing))), "{far}");
        }
    }
}
