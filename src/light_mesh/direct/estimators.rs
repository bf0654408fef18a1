//! Direct illumination of surface points from known points of a direct field: the estimators of method §4, for light meshes
//! and for the reference alike.

use glam::{Vec3, Vec4};

use super::derived::Basis;
use super::field::DirectField;
use super::spherical_harmonics;
use crate::light_mesh::leaks::{amounts_differ, lights_differ};
use crate::light_mesh::lookup::Differ;
use crate::light_mesh::points::Neighbours;
use crate::lights::{PackedGroups, PackedLights, Unoccluded, Visibility, VisibilityBits};
use crate::scene::SurfacePoint;
use crate::settings::Estimator;
use crate::simd::{LANES, Lanes};

/// Chunks of lights whose bits make a register: 128 lights at a time are compared among points.
const BLOCK: usize = 8;

/// What points agree about, of [`BLOCK`] chunks from the `first` on.
struct Agreement {
    first: usize,
    all: [VisibilityBits; BLOCK],
    any: [VisibilityBits; BLOCK],
}

/// An estimator with what it reads: a field, whose values its [`Basis`] needs must be derived, and the lights that it is of.
#[derive(Clone, Copy)]
pub struct FieldEstimator<'a> {
    /// The field.
    pub field: &'a DirectField,
    /// Its visibility bits, which don't have to be found again for every point.
    bits: &'a [VisibilityBits],
    /// The lights.
    pub lights: &'a PackedLights,
    /// How direct illumination follows from them.
    pub estimator: Estimator,
}

impl<'a> FieldEstimator<'a> {
    /// An estimator over a field.
    pub fn new(field: &'a DirectField, lights: &'a PackedLights, estimator: Estimator) -> Self {
        Self { field, bits: field.bits(), lights, estimator }
    }

    /// Visibility of the lights from the point in `slot`, by chunk of [`LANES`] lights.
    #[inline(always)]
    pub fn bits(&self, slot: u32, chunks: usize) -> &'a [VisibilityBits] {
        &self.bits[slot as usize * chunks..][..chunks]
    }

    /// Which lights of [`BLOCK`] chunks from the `first` on all of the points in some slots see, and which any does.
    #[inline(always)]
    fn agreement(&self, slots: &[u32], first: usize) -> Agreement {
        let chunks = self.lights.chunks().len();
        let mut agreement = Agreement { first, all: [VisibilityBits::MAX; BLOCK], any: [0; BLOCK] };
        for &slot in slots {
            let start = slot as usize * chunks + first;
            // What follows a short row are bits of other points, which nobody asks for.
            let mut row = [0; BLOCK];
            match self.bits.get(start..start + BLOCK) {
                Some(bits) => row.copy_from_slice(bits),
                None => row.iter_mut().zip(&self.bits[start..]).for_each(|(to, bits)| *to = *bits),
            }
            for chunk in 0..BLOCK {
                agreement.all[chunk] &= row[chunk];
                agreement.any[chunk] |= row[chunk];
            }
        }
        agreement
    }

    /// I(y), the direct illumination of a surface point without its k_d, from known points with weights.
    #[inline(always)]
    pub fn estimate(&self, surface: &SurfacePoint, points: &Neighbours) -> Vec3 {
        let scale = 1.0 / points.total_weight();
        match self.estimator {
            Estimator::PerLight => self.per_light(surface, points, scale),
            Estimator::Paper => {
                let [direct, _] = self.mean_direct_light(points, scale);
                direct * self.lights.irradiance(surface, Unoccluded)
            }
            Estimator::Ratio => {
                let [direct, unoccluded] = self.mean_direct_light(points, scale);
                let ratio = Vec3::select(unoccluded.cmpgt(Vec3::ZERO), direct / unoccluded, Vec3::ZERO);
                ratio * self.lights.irradiance(surface, Unoccluded)
            }
            Estimator::Directional => {
                let mut sums = [Vec4::ZERO; spherical_harmonics::COEFFICIENTS];
                for (slot, weight) in points.iter() {
                    let values = self.field.irradiance(slot);
                    for (sum, value) in sums.iter_mut().zip(values.as_chunks::<4>().0) {
                        *sum += Vec4::from_array(*value) * weight;
                    }
                }
                spherical_harmonics::irradiance(&sums, surface.shading_normal) * scale
            }
        }
    }

    /// Adds to `sums` what the lights of each group give a surface point by the estimator `per-light`, whichever this is: of the others
    /// groups have no sums of their own.
    #[inline(always)]
    pub(crate) fn add_by_group(
        &self,
        surface: &SurfacePoint,
        points: &Neighbours,
        groups: &PackedGroups,
        sums: &mut [Vec3],
    ) {
        let scale = 1.0 / points.total_weight();
        let visibility = MeanVisibility::new(self, points, scale);
        groups.add_irradiance(self.lights, surface, visibility, sums);
    }

    /// Σ_i Ṽ_i φ2 E_i/φ1 with Ṽ_i the mean visibility of light i over D_y.
    #[inline(always)]
    fn per_light(&self, surface: &SurfacePoint, points: &Neighbours, scale: f32) -> Vec3 {
        self.lights.irradiance(surface, MeanVisibility::new(self, points, scale))
    }

    /// Ĩ of eq. (3), and the same mean of the unoccluded field.
    #[inline(always)]
    fn mean_direct_light(&self, points: &Neighbours, scale: f32) -> [Vec3; 2] {
        let mut sums = [0.0f32; 6];
        for (slot, weight) in points.iter() {
            for (sum, value) in sums.iter_mut().zip(self.field.light(slot)) {
                *sum += weight * value;
            }
        }
        let [a, b, c, d, e, f] = sums.map(|sum| sum * scale);
        [Vec3::new(a, b, c), Vec3::new(d, e, f)]
    }
}

impl Differ for FieldEstimator<'_> {
    #[inline(always)]
    fn differ(&self, slots: &[u32]) -> bool {
        match Basis::of(self.estimator) {
            Basis::Bits => {
                let chunks = self.lights.chunks().len();
                let blocks = (0..chunks).step_by(BLOCK).map(|first| {
                    let Agreement { all, any, .. } = self.agreement(slots, first);
                    let count = (chunks - first).min(BLOCK);
                    let ones = |bits: &[VisibilityBits]| bits.iter().map(|bits| bits.count_ones()).sum();
                    (ones(&all[..count]), ones(&any[..count]))
                });
                lights_differ(blocks)
            }
            // Not a look at each light, since the cost of these must not grow with the lights.
            basis @ (Basis::Light | Basis::Irradiance) => {
                amounts_differ(slots.iter().map(|&slot| self.field.amount(basis, slot)))
            }
        }
    }
}

/// Mean visibility of every light over D_y.
struct MeanVisibility<'a> {
    estimator: &'a FieldEstimator<'a>,
    points: &'a Neighbours,
    /// 1 over the sum of the points' weights.
    scale: f32,
    agreement: Agreement,
}

impl<'a> MeanVisibility<'a> {
    #[inline(always)]
    fn new(estimator: &'a FieldEstimator<'a>, points: &'a Neighbours, scale: f32) -> Self {
        let agreement = estimator.agreement(points.slots(), 0);
        Self { estimator, points, scale, agreement }
    }
}

impl Visibility for MeanVisibility<'_> {
    #[inline(always)]
    fn of_chunk(&mut self, index: usize) -> Option<Lanes> {
        let Self { estimator, points, scale, agreement } = self;
        let lights = estimator.lights;
        let chunks = lights.chunks().len();
        if agreement.first != index / BLOCK * BLOCK {
            *agreement = estimator.agreement(points.slots(), index / BLOCK * BLOCK);
        }
        let (all, any) = (agreement.all[index % BLOCK], agreement.any[index % BLOCK]);
        // Most chunks are wholly hidden or wholly seen from all of D_y.
        if any == 0 {
            return None;
        }
        if all == lights.chunks()[index].used {
            return Some([1.0; LANES]);
        }
        let mut visible: Lanes = [0.0; LANES];
        for (slot, weight) in points.iter() {
            let bits = estimator.bits(slot, chunks)[index];
            for (lane, sum) in visible.iter_mut().enumerate() {
                *sum += if bits >> lane & 1 == 1 { weight } else { 0.0 };
            }
        }
        visible.iter_mut().for_each(|sum| *sum *= *scale);
        Some(visible)
    }
}
