//! The direct light mesh, and what surface points take from it.

use glam::{Vec3, Vec4};

use super::derived::Basis;
use super::estimators::FieldEstimator;
use super::field::DirectField;
use super::moved::{KeptBits, Motion};
use super::spherical_harmonics;
use crate::Bounds;
use crate::accel::Accel;
use crate::light_mesh::leaks::amounts_differ;
use crate::light_mesh::lookup::{Lookup, LookupScratch};
use crate::light_mesh::points::{AutoSpacing, MeshError, Neighbourhoods, PointPacket, PointSet};
use crate::light_mesh::slot::UNKNOWN;
use crate::light_mesh::store::{NeededPoints, PointMask, PointStore};
use crate::lights::{PackedGroups, PackedLights, expand_bits};
use crate::scene::SurfacePoint;
use crate::settings::{Estimator, KernelSettings, Leaks, PointSettings};
use crate::simd::{LANES, horizontal_extremes, horizontal_sums};
use crate::world::World;

/// Direct light mesh: points and the field at those that are known. It belongs to one scene's geometry and to its lights'
/// places and kinds; how surface points interpolate it is no part of it.
pub struct DirectMesh {
    pub(super) store: PointStore,
    pub(super) field: DirectField,
}

/// How surface points interpolate a direct mesh.
pub struct DirectInterpolation {
    /// The kernel.
    #[doc(hidden)]
    pub neighbourhoods: Neighbourhoods,
    /// Which points of D_y count.
    pub leaks: Leaks,
    /// How direct illumination follows from the points.
    pub estimator: Estimator,
}

/// What the evaluation of mesh points took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DirectEvaluation {
    /// Points that got a value.
    pub evaluated: u64,
    /// Occlusion rays from these points to lights.
    pub shadow: u64,
    /// Rays that look for back faces around points, once for each.
    pub inside: u64,
}

impl DirectEvaluation {
    /// Adds another evaluation.
    pub(crate) fn add(&mut self, other: Self) {
        self.evaluated += other.evaluated;
        self.shadow += other.shadow;
        self.inside += other.inside;
    }
}

impl DirectMesh {
    /// Mesh over a scene of the given bounds, with no point known.
    pub fn new(bounds: Bounds) -> Self {
        Self::shifted(bounds, Vec3::ZERO)
    }

    /// The same with all points but those of lists elsewhere, by a vector in spacings.
    pub(crate) fn shifted(bounds: Bounds, shift: Vec3) -> Self {
        Self { store: PointStore::new(PointSet::shifted(bounds, shift)), field: DirectField::default() }
    }

    /// How the mesh is interpolated by these settings; the layers of points that they name are added to the mesh. An automatic
    /// spacing follows from `auto`.
    ///
    /// # Errors
    /// See [`MeshError`].
    pub fn interpolation(
        &mut self,
        points: &PointSettings,
        kernel: &KernelSettings,
        estimator: Estimator,
        auto: AutoSpacing,
    ) -> Result<DirectInterpolation, MeshError> {
        let set = &mut self.store.points;
        let neighbourhoods = Neighbourhoods::new(set, points, kernel, auto)?;
        Ok(DirectInterpolation { neighbourhoods, leaks: kernel.leaks, estimator })
    }

    /// All points in a box that surface points there might be interpolated from.
    pub fn points_in(&self, interpolation: &DirectInterpolation, bounds: Bounds) -> PointMask {
        let mut found = NeededPoints::default();
        interpolation.neighbourhoods.for_each_in(&self.store.points, bounds, |id| found.insert(id));
        PointMask::union(found.into_bricks())
    }

    /// Evaluates those of the needed points that are unknown, and whatever `interpolation` reads of all known ones beside.
    pub fn evaluate<A: Accel>(
        &mut self,
        world: World<A>,
        interpolation: &DirectInterpolation,
        needed: &PointMask,
    ) -> DirectEvaluation {
        let basis = Basis::of(interpolation.estimator);
        // What is derived, is derived of all points at once.
        let before = if basis == Basis::Bits { 0 } else { self.retrace(world, None) };
        let (evaluated, shadow) = self.trace(world, needed);
        let shadow = before + shadow;
        let Self { store, field } = self;
        field.derive(world.lights, basis, store.positions());
        let inside = if interpolation.leaks == Leaks::Invalidate {
            store.find_inside(world.accel, world.scene, usize::MAX)
        } else {
            0
        };
        DirectEvaluation { evaluated, shadow, inside }
    }

    /// Finds the visibility of the unknown ones of the needed points, coarser points first; returns the number of points and rays.
    fn trace<A: Accel>(&mut self, world: World<A>, needed: &PointMask) -> (u64, u64) {
        let corners = self.store.corners_of(needed);
        let coarser = if corners.len() > 0 { self.trace(world, &corners) } else { (0, 0) };
        let retraced = self.retrace(world, Some(needed));
        let Self { store, field } = self;
        let new = store.allocate(needed);
        let points = store.positions();
        let points = &points[points.len() - new.len()..];
        // The layers of one interpolation have as many levels each, so that either all new points build on others, or none.
        let corners: Vec<[u32; 8]> = new.iter().filter_map(|&id| store.corner_slots(id)).collect();
        let rays = if !new.is_empty() && corners.len() == new.len() {
            field.refine(world.accel, world.lights, points, &corners)
        } else {
            field.trace(world.accel, world.lights, points)
        };
        (coarser.0 + new.len() as u64, coarser.1 + retraced + rays)
    }

    /// Traces the bits of the needed points, or of all, that something moved in front of; returns the number of rays.
    fn retrace<A: Accel>(&mut self, world: World<A>, needed: Option<&PointMask>) -> u64 {
        let Self { store, field } = self;
        if field.stale.is_empty() {
            return 0;
        }
        let chunks = world.lights.chunks().len();
        let slots = match needed {
            Some(needed) => store.known_slots(needed),
            None => (0..store.positions().len() as u32).collect(),
        };
        let slots = field.stale_among(slots.into_iter(), chunks);
        field.retrace(world.accel, world.lights, store.positions(), &slots)
    }

    /// Forgets what a motion may have changed, and whatever follows from where lights are; returns what stays known.
    pub(crate) fn forget_moved(&mut self, lights: &PackedLights, motion: &Motion) -> KeptBits {
        let Self { store, field } = self;
        // Bits of finer points follow from those of coarser ones around them.
        if store.points.has_levels() {
            return self.forget_all(lights);
        }
        store.forget_inside();
        field.forget_derived();
        field.mark_moved(lights, store.positions(), motion)
    }

    /// Forgets all points; returns that none stays known.
    pub(crate) fn forget_all(&mut self, lights: &PackedLights) -> KeptBits {
        let points_changed = self.store.positions().len() as u64;
        let bits_forgotten = points_changed * lights.len() as u64;
        let points = &self.store.points;
        *self = Self::shifted(points.bounds(), points.shift());
        KeptBits { points_changed, bits_forgotten, ..KeptBits::default() }
    }

    /// The mesh as surface points interpolate it.
    pub fn view<'a>(
        &'a self,
        lights: &'a PackedLights,
        interpolation: &'a DirectInterpolation,
    ) -> DirectView<'a> {
        let DirectInterpolation { neighbourhoods, leaks, estimator } = interpolation;
        DirectView {
            lookup: Lookup { store: &self.store, neighbourhoods, leaks: *leaks },
            estimator: FieldEstimator::new(&self.field, lights, *estimator),
        }
    }

    /// Points, and what is known of them.
    // For tests and benches only.
    #[doc(hidden)]
    pub fn store(&self) -> &PointStore {
        &self.store
    }

    /// Forgets what depends on the lights' intensities. Visibility stays.
    pub(crate) fn forget_intensities(&mut self) {
        self.field.forget_derived();
    }

    /// Bytes of slots and values, without the room that lists keep for more: what the points take, however they became known.
    pub fn memory_bytes(&self) -> usize {
        self.store.memory_bytes() + self.field.memory_bytes()
    }

    /// The same at most, once some points are [evaluated](Self::evaluate).
    pub(crate) fn bytes_with(
        &self,
        lights: &PackedLights,
        interpolation: &DirectInterpolation,
        needed: &PointMask,
    ) -> usize {
        let Self { store, field } = self;
        let growth = store.growth(needed);
        let known = store.positions().len();
        let all = known + growth.points;
        let inside = if interpolation.leaks == Leaks::Invalidate { all - store.inside_len() } else { 0 };
        let basis = Basis::of(interpolation.estimator);
        store.bytes_with(growth) + inside + field.bytes_with(known, all, lights.chunks().len(), basis)
    }

    /// Makes room for that.
    pub(crate) fn reserve(
        &mut self,
        lights: &PackedLights,
        interpolation: &DirectInterpolation,
        needed: &PointMask,
    ) {
        let Self { store, field } = self;
        let growth = store.growth(needed);
        let known = store.positions().len();
        store.reserve(growth);
        let basis = Basis::of(interpolation.estimator);
        field.reserve(known, known + growth.points, lights.chunks().len(), basis);
    }
}

/// A direct mesh as surface points interpolate it.
#[derive(Clone, Copy)]
pub struct DirectView<'a> {
    /// Finds the points of D_y.
    pub lookup: Lookup<'a>,
    /// Makes direct illumination of them.
    pub(crate) estimator: FieldEstimator<'a>,
}

impl DirectView<'_> {
    /// I(y), the direct illumination of a surface point without its k_d. All points of D_y must be known.
    #[inline(always)]
    pub fn illumination<A: Accel>(
        &self,
        accel: &A,
        surface: &SurfacePoint,
        scratch: &mut LookupScratch,
    ) -> Vec3 {
        let Self { lookup, estimator } = self;
        lookup.find(accel, surface, scratch, estimator);
        estimator.estimate(surface, &scratch.points)
    }

    /// Finds the points again that the illumination of a surface point, the last that was found, follows from. That takes no ray: they are there still,
    /// or what leak rules ask is known.
    #[inline(always)]
    pub(crate) fn find_again<A: Accel>(
        &self,
        accel: &A,
        surface: &SurfacePoint,
        scratch: &mut LookupScratch,
    ) {
        if scratch.points.is_empty() {
            self.lookup.find(accel, surface, scratch, &self.estimator);
        }
    }

    /// Adds to `sums` what the lights of each group give a surface point whose points are [found](Self::find_again).
    #[inline(always)]
    pub(crate) fn add_by_group(
        &self,
        surface: &SurfacePoint,
        scratch: &LookupScratch,
        groups: &PackedGroups,
        sums: &mut [Vec3],
    ) {
        self.estimator.add_by_group(surface, &scratch.points, groups, sums);
    }

    /// Half the difference of what two halves of the points around a surface point make of its illumination (method §10): about what is wrong with the
    /// mean of both. Its points must be [found](Self::find_again); 0 where a half is empty.
    // Not inlined: only a layer asks for it.
    #[inline(never)]
    pub(crate) fn half_difference(&self, surface: &SurfacePoint, scratch: &mut LookupScratch) -> Vec3 {
        let LookupScratch { points, half, .. } = scratch;
        let set = &self.lookup.store.points;
        let mut of_half = |second: bool| {
            half.clone_from(points);
            let is_in = |index: usize, _| set.is_in_second_half(points.ids()[index]) == second;
            half.keep(is_in).then(|| self.estimator.estimate(surface, half))
        };
        match (of_half(false), of_half(true)) {
            (Some(first), Some(second)) => 0.5 * (first - second),
            _ => Vec3::ZERO,
        }
    }

    /// [`DirectView::illumination`] of a surface point that is one of several in a row of the same normal.
    ///
    /// Surface points of a row differ in the weights of the mesh points only, so that `directional` computes the irradiance
    /// that each mesh point has for their normal just once.
    #[inline(always)]
    pub fn illumination_in_row<A: Accel>(
        &self,
        accel: &A,
        surface: &SurfacePoint,
        scratch: &mut LookupScratch,
    ) -> Vec3 {
        if self.estimator.estimator == Estimator::Directional
            && let Some((light, rays)) = self.directional_in_row(accel, surface, scratch)
        {
            scratch.rays += rays;
            // Those of another surface point.
            scratch.points.clear();
            return light;
        }
        self.illumination(accel, surface, scratch)
    }

    /// The estimate `directional`, and how many rays that took; `None` where D_y is empty.
    #[inline(always)]
    fn directional_in_row<A: Accel>(
        &self,
        accel: &A,
        surface: &SurfacePoint,
        scratch: &mut LookupScratch,
    ) -> Option<(Vec3, u64)> {
        let (kernel, around) = self.lookup.around_in(surface, scratch)?;
        if *around.normal != surface.shading_normal {
            *around.normal = surface.shading_normal;
            // No closure: it would be compiled for the oldest processor.
            for packet in &mut *around.packets {
                self.light_packet(packet, surface.shading_normal);
            }
        }
        let mut sums = [[0.0f32; LANES]; 4];
        let (mut least, mut most) = ([f32::INFINITY; LANES], [0.0f32; LANES]);
        for packet in &*around.packets {
            let (weights, _) = packet.weigh(&kernel);
            packet.add_lit(&weights, &mut sums);
            for lane in 0..LANES {
                let amount = packet.amount[lane];
                let counts = amount >= 0.0 && weights[lane] > 0.0;
                let (low, high) = if counts { (amount, amount) } else { (f32::INFINITY, 0.0) };
                least[lane] = if low < least[lane] { low } else { least[lane] };
                most[lane] = if high > most[lane] { high } else { most[lane] };
            }
        }
        let differ = self.lookup.leaks == Leaks::Visibility
            && amounts_differ(horizontal_extremes(&least, &most).into_iter());
        let mut rays = 0;
        if differ {
            let seen = self.lookup.look(accel, surface, &kernel, around.packets);
            rays = seen.rays;
            if seen.any {
                sums = [[0.0; LANES]; 4];
                for packet in &*around.packets {
                    let (mut weights, _) = packet.weigh(&kernel);
                    let clear = expand_bits(packet.sight[seen.octant].clear);
                    weights.iter_mut().zip(clear).for_each(|(weight, clear)| *weight *= clear);
                    packet.add_lit(&weights, &mut sums);
                }
            }
        }
        let [r, g, b, weights] = &sums;
        let sums = horizontal_sums([r, g, b, weights]);
        (sums.w > 0.0).then(|| (sums.truncate().max(Vec3::ZERO) / sums.w, rays))
    }

    /// Whether the point in a slot counts for no surface point.
    #[inline(always)]
    fn drops(&self, slot: u32) -> bool {
        self.lookup.leaks == Leaks::Invalidate && self.lookup.store.is_inside(slot)
    }

    /// Stores the irradiance of a normal at the points of a packet, for all surface points of that normal.
    #[inline(always)]
    fn light_packet(&self, packet: &mut PointPacket, normal: Vec3) {
        let monomials = spherical_harmonics::monomials(normal);
        for lane in 0..LANES {
            let slot = packet.slots[lane];
            packet.amount[lane] = -1.0;
            if slot == UNKNOWN || self.drops(slot) {
                continue;
            }
            let mut light = Vec4::ZERO;
            let values = self.estimator.field.irradiance(slot);
            for (value, monomial) in values.as_chunks::<4>().0.iter().zip(monomials) {
                light += Vec4::from_array(*value) * monomial;
            }
            (0..3).for_each(|channel| packet.lit[channel][lane] = light[channel]);
            packet.amount[lane] = self.estimator.field.amount(Basis::Irradiance, slot);
        }
    }
}
