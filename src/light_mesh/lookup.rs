//! Looking up the known mesh points of D_y, and which of them count for a surface point.

use super::leaks::{LeakGuard, LeakedPoints};
use super::points::{CellCache, Kernel, Neighbourhoods, Neighbours, PointPacket, Surroundings};
use super::slot::UNKNOWN;
use super::store::{NeededPoints, PointMask, PointStore};
use crate::accel::{Accel, Coherence, LaneMask, PacketLanes, RayPacket};
use crate::scene::{Ray, SurfacePoint};
use crate::settings::Leaks;
use crate::simd::LANES;

/// A mesh's points as surface points see them: with a kernel.
#[derive(Clone, Copy)]
pub struct Lookup<'a> {
    /// The points.
    pub(crate) store: &'a PointStore,
    /// The kernel, in every part of space.
    pub(crate) neighbourhoods: &'a Neighbourhoods,
    /// Which points of D_y count.
    pub(crate) leaks: Leaks,
}

/// What [`Lookup::look`] found.
pub(super) struct SeenPoints {
    /// Which way the surface points face: what they see is in [`PointPacket::sight`] there.
    pub octant: usize,
    /// Whether any point of D_y is seen.
    pub any: bool,
    /// Rays traced.
    pub rays: u64,
}

/// Tells whether mesh points differ so much that it matters which of them a surface point sees.
///
/// A trait, since closures are compiled for the oldest processor wherever they are not inlined.
pub(crate) trait Differ {
    /// Whether the points in some slots do.
    fn differ(&self, slots: &[u32]) -> bool;
}

/// Working memory and counters of one thread while it looks up mesh points.
#[derive(Default)]
pub struct LookupScratch {
    /// D_y.
    pub(super) points: Neighbours,
    /// A half of it.
    pub(super) half: Neighbours,
    /// Searches that surface points close together share; `None` where surface points come from anywhere.
    cells: Option<CellCache>,
    /// Unions of neighbourhoods that were found.
    unions: u32,
    /// Occlusion rays traced from surface points to mesh points.
    pub rays: u64,
    /// Surface points whose D_y was empty, so that the nearest mesh point took its place.
    pub fallbacks: u64,
}

impl LookupScratch {
    /// For surface points that lie close together. It must not outlive the next evaluation of mesh points.
    pub fn for_tile() -> Self {
        Self { cells: Some(CellCache::default()), ..Self::default() }
    }
}

impl Lookup<'_> {
    /// Finds the points of D_y that count for a surface point; all must be known.
    ///
    #[inline(always)]
    pub(super) fn find<A: Accel>(
        &self,
        accel: &A,
        surface: &SurfacePoint,
        scratch: &mut LookupScratch,
        points: &impl Differ,
    ) {
        let fallback = match &mut scratch.cells {
            Some(cells) => self.known_within(surface, cells, &mut scratch.points),
            None => self.known(surface, &mut scratch.points),
        };
        scratch.fallbacks += u64::from(fallback);
        if self.leaks == Leaks::Allow {
            return;
        }
        if self.leaks == Leaks::Visibility && !fallback && scratch.cells.is_some() {
            if !points.differ(scratch.points.slots()) {
                return;
            }
            if let Some(rays) = self.keep_seen(accel, surface, scratch) {
                scratch.rays += rays;
                return;
            }
        }
        let guard = LeakGuard { accel, leaks: self.leaks, positions: self.store.positions() };
        let LeakedPoints { rays, all_dropped } = guard.keep_counting(
            surface,
            &mut scratch.points,
            |slot| self.store.is_inside(slot),
            |slots| points.differ(slots),
        );
        scratch.rays += rays;
        scratch.fallbacks += u64::from(all_dropped);
    }

    /// Keeps those points of D_y that are seen by the surface points of the cell that face the same way, all if none is. Returns
    /// the number of rays; `None` where there are no cells.
    ///
    /// Whether a wall stands between a cell and a mesh point is asked once, from the first surface point that has the mesh
    /// point in its D_y, and not for every pixel. Surfaces that face different ways, such as the two sides of a thin wall,
    /// don't answer for each other.
    #[inline(always)]
    fn keep_seen<A: Accel>(
        &self,
        accel: &A,
        surface: &SurfacePoint,
        scratch: &mut LookupScratch,
    ) -> Option<u64> {
        let LookupScratch { points, cells, .. } = scratch;
        let (kernel, around) = self.around(surface, cells.as_mut()?)?;
        let seen = self.look(accel, surface, &kernel, around.packets);
        if seen.any {
            points.clear();
            for packet in around.packets {
                let (weights, lanes) = packet.weigh(&kernel);
                points.push_packet(packet, &weights, lanes & packet.sight[seen.octant].clear);
            }
        }
        Some(seen.rays)
    }

    /// Finds out which points of D_y are seen by the surface points of a cell that face the same way, as far as that is unknown.
    #[inline(always)]
    pub(super) fn look<A: Accel>(
        &self,
        accel: &A,
        surface: &SurfacePoint,
        kernel: &Kernel,
        packets: &mut [PointPacket],
    ) -> SeenPoints {
        let octant = usize::from(surface.geometric_normal.is_negative_bitmask() as u8 & 7);
        let origin = surface.ray_origin();
        let mut seen = SeenPoints { octant, any: false, rays: 0 };
        for packet in packets {
            let (_, lanes) = packet.weigh(kernel);
            let unknown = lanes & !packet.sight[octant].known;
            if unknown != 0 {
                let mut query = RayPacket::<LANES>::empty();
                for lane in (0..LANES).filter(|lane| unknown >> lane & 1 == 1) {
                    query.set_lane(lane, &Ray::between(origin, packet.position(lane)));
                }
                let active = LaneMask::from(unknown);
                let blocked = accel.occluded_packet(active, &mut query, Coherence::Incoherent);
                packet.sight[octant].known |= unknown;
                packet.sight[octant].clear |= (active & !blocked) as u16;
                seen.rays += u64::from(unknown.count_ones());
            }
            seen.any |= lanes & packet.sight[octant].clear != 0;
        }
        seen
    }

    /// D_y with slots for one of many surface points that lie close together: `cells` keeps what is the same for all. It must
    /// not outlive the next evaluation of mesh points. Returns whether D_y was empty and the nearest point took its place.
    #[inline(always)]
    fn known_within(&self, surface: &SurfacePoint, cells: &mut CellCache, out: &mut Neighbours) -> bool {
        out.clear();
        if let Some((kernel, around)) = self.around(surface, cells) {
            for packet in around.packets {
                let (weights, lanes) = packet.weigh(&kernel);
                out.push_packet(packet, &weights, lanes);
            }
        }
        out.is_empty() && self.known(surface, out)
    }

    /// D_y with slots for any surface point; returns whether it was empty and the nearest point took its place.
    #[inline(never)]
    fn known(&self, surface: &SurfacePoint, out: &mut Neighbours) -> bool {
        let fallback = self.neighbourhoods.find(&self.store.points, surface, out);
        out.find_slots(|id| {
            let slot = self.store.slot(id);
            debug_assert_ne!(slot, UNKNOWN, "a point that is used was never evaluated");
            slot
        });
        fallback
    }

    /// The kernel of a surface point, and all points that may lie in it; `None` where that would be no help.
    #[inline(always)]
    pub(super) fn around<'c>(
        &self,
        surface: &SurfacePoint,
        cells: &'c mut CellCache,
    ) -> Option<(Kernel, Surroundings<'c>)> {
        let store = self.store;
        self.neighbourhoods.around(&store.points, surface, cells, |id| store.slot(id), |_| {})
    }

    /// The same from the scratch of a tile.
    #[inline(always)]
    pub(super) fn around_in<'c>(
        &self,
        surface: &SurfacePoint,
        scratch: &'c mut LookupScratch,
    ) -> Option<(Kernel, Surroundings<'c>)> {
        self.around(surface, scratch.cells.as_mut()?)
    }

    /// Adds the slots of all points in the neighbourhoods of some surface points to `slots`, points that lie around
    /// several cells more than once.
    #[inline(always)]
    pub(super) fn union<'a>(
        &self,
        surfaces: impl Iterator<Item = &'a SurfacePoint>,
        scratch: &mut LookupScratch,
        slots: &mut Vec<u32>,
    ) {
        scratch.unions += 1;
        let group = scratch.unions;
        for surface in surfaces {
            let mut found = 0;
            if let Some((kernel, around)) = self.around_in(surface, scratch) {
                for packet in around.packets {
                    let (_, lanes) = packet.weigh(&kernel);
                    found |= lanes;
                    if packet.group != group {
                        (packet.group, packet.needed) = (group, 0);
                    }
                    let mut new = lanes & !packet.needed;
                    packet.needed |= lanes;
                    while new != 0 {
                        slots.push(packet.slots[new.trailing_zeros() as usize % LANES]);
                        new &= new - 1;
                    }
                }
            }
            if found == 0 {
                scratch.fallbacks += u64::from(self.known(surface, &mut scratch.points));
                slots.extend_from_slice(scratch.points.slots());
            }
        }
    }

    /// The points in the neighbourhoods of surface points, which should lie close together, known or not.
    #[inline(always)]
    pub fn needed<'a>(&self, surfaces: impl Iterator<Item = &'a SurfacePoint>) -> NeededPoints {
        let (mut cells, mut neighbours) = (CellCache::default(), Neighbours::default());
        let mut needed = NeededPoints::default();
        let points = &self.store.points;
        for surface in surfaces {
            let mut found = 0;
            let forget = |packet: &PointPacket| packet.needed_ids().for_each(|id| needed.insert(id));
            if let Some((kernel, around)) =
                self.neighbourhoods.around(points, surface, &mut cells, |_| UNKNOWN, forget)
            {
                for packet in around.packets {
                    let (_, lanes) = packet.weigh(&kernel);
                    packet.needed |= lanes;
                    found |= lanes;
                }
            }
            if found == 0 {
                self.neighbourhoods.find(points, surface, &mut neighbours);
                neighbours.ids().iter().for_each(|&id| needed.insert(id));
            }
        }
        cells.packets().iter().flat_map(PointPacket::needed_ids).for_each(|id| needed.insert(id));
        needed
    }

    /// [`Lookup::needed`] of surface points that come from anywhere.
    pub fn needed_anywhere<'a>(&self, surfaces: impl Iterator<Item = &'a SurfacePoint>) -> PointMask {
        PointMask::union(self.needed(surfaces).into_bricks())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Bounds;
    use crate::light_mesh::points::{AutoSpacing, PointSet};
    use crate::sampling::SplitMix64;
    use crate::settings::{
        KernelSettings, Neighbourhood, PointLayout, PointSettings, Radius, Region, Spacing,
    };
    use glam::Vec3;

    const BOUNDS: Bounds = Bounds { min: Vec3::new(-3.0, 0.0, 2.0), max: Vec3::new(3.0, 2.5, 6.0) };

    fn surfaces(count: usize, shift: Vec3) -> Vec<SurfacePoint> {
        let mut random = SplitMix64::new(5);
        let surface = |_| {
            let normal = random.in_box(Vec3::NEG_ONE, Vec3::ONE).normalize_or(Vec3::Y);
            SurfacePoint::flat(shift + random.in_box(BOUNDS.min - 0.3, BOUNDS.max + 0.3), normal)
        };
        (0..count).map(surface).collect()
    }

    /// The mesh points found by way of cells are those that a search for each surface point finds, with the same weights
    /// in the same order, and the slots that the table gives; for every layout, neighbourhood and region, far from the
    /// origin, and with more cells than are kept.
    #[test]
    fn cells_give_what_a_search_for_every_point_gives() {
        let list: Vec<_> = (0..300).map(|i| SplitMix64::new(i).in_box(BOUNDS.min, BOUNDS.max)).collect();
        let layouts = [
            PointLayout::Regular,
            PointLayout::BodyCentred,
            PointLayout::Jittered { seed: 3 },
            PointLayout::BlueNoise { seed: 3 },
            PointLayout::List(list.into()),
        ];
        let hoods = [Neighbourhood::SmoothSphere, Neighbourhood::Sphere, Neighbourhood::Nearest];
        for (number, layout) in layouts.into_iter().enumerate() {
            for (neighbourhood, hemisphere) in hoods.into_iter().zip([true, false, true]) {
                let shift = if number == 1 { Vec3::splat(1000.0) } else { Vec3::ZERO };
                let shifted = Bounds { min: BOUNDS.min + shift, max: BOUNDS.max + shift };
                let fine = Region {
                    bounds: Bounds { min: shifted.min, max: shifted.min + 1.5 },
                    spacing: Some(Vec3::splat(0.11)),
                    radius: None,
                };
                let settings = PointSettings {
                    layout: layout.clone(),
                    spacing: Spacing::Units(Vec3::new(0.4, 0.3, 0.35)),
                    regions: vec![fine],
                    levels: 0,
                };
                let kernel = KernelSettings {
                    radius: Radius::Spacings(1.4),
                    neighbourhood,
                    hemisphere,
                    leaks: Leaks::Allow,
                };
                let mut points = PointSet::new(shifted);
                let neighbourhoods =
                    Neighbourhoods::new(&mut points, &settings, &kernel, AutoSpacing::AVERAGED);
                let neighbourhoods = neighbourhoods.expect("a modest grid");
                let mut store = PointStore::new(points);
                let surfaces = surfaces(3000, shift);

                let mut needed = NeededPoints::default();
                let mut expected = Neighbours::default();
                for surface in &surfaces {
                    neighbourhoods.find(&store.points, surface, &mut expected);
                    expected.ids().iter().for_each(|&id| needed.insert(id));
                }
                let expected_mask = PointMask::union(needed.into_bricks());
                let lookup = Lookup { store: &store, neighbourhoods: &neighbourhoods, leaks: Leaks::Allow };
                let mask = lookup.needed_anywhere(surfaces.iter());
                assert_eq!(mask, expected_mask, "{layout:?}, {neighbourhood:?}");

                store.allocate(&mask);
                let lookup = Lookup { store: &store, neighbourhoods: &neighbourhoods, leaks: Leaks::Allow };
                let (mut cells, mut found) = (CellCache::default(), Neighbours::default());
                for surface in &surfaces {
                    let fallback = lookup.known(surface, &mut expected);
                    assert_eq!(lookup.known_within(surface, &mut cells, &mut found), fallback);
                    assert_eq!(found.ids(), expected.ids(), "{layout:?}, {neighbourhood:?}");
                    assert_eq!(found.weights(), expected.weights());
                    assert_eq!(found.slots(), expected.slots());
                }
            }
        }
    }
}
