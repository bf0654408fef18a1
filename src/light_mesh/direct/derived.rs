//! What follows from the visibility bits of a mesh point without a ray: caches of the direct field for the estimators that
//! read them (method §4).

use std::marker::PhantomData;

use glam::Vec3;
use pulp::NullaryFnOnce;
use rayon::prelude::*;

use super::spherical_harmonics::{self, COEFFICIENTS};
use crate::lights::{IncidentLights, PackedLights, VisibilityBits, expand_bits};
use crate::settings::Estimator;
use crate::simd::{LANES, Lanes, horizontal_sum, vectorize};

/// What an estimator reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Basis {
    /// The visibility bits themselves.
    Bits,
    /// DirectLight and the unoccluded DirectLight, RGB each.
    Light,
    /// Irradiance by normal, see [`spherical_harmonics`].
    Irradiance,
}

impl Basis {
    /// The basis that an estimator reads.
    pub(crate) fn of(estimator: Estimator) -> Self {
        match estimator {
            Estimator::PerLight => Self::Bits,
            Estimator::Paper | Estimator::Ratio => Self::Light,
            Estimator::Directional => Self::Irradiance,
        }
    }

    /// Numbers that are derived for each mesh point, beside its amount of light.
    pub(super) fn numbers(self) -> usize {
        match self {
            Self::Bits => 0,
            Self::Light => 6,
            Self::Irradiance => spherical_harmonics::STRIDE,
        }
    }
}

/// Some numbers per mesh point, by slot, and the amount of light that they stand for.
#[derive(Default)]
pub struct DerivedValues {
    values: Vec<f32>,
    amounts: Vec<f32>,
}

impl DerivedValues {
    /// The `N` numbers of the point in `slot`.
    #[inline(always)]
    pub fn values<const N: usize>(&self, slot: u32) -> &[f32; N] {
        let at = slot as usize * N;
        self.values[at..at + N].first_chunk().unwrap_or(&[0.0; N])
    }

    /// Light at the point in `slot`, summed over channels and directions.
    #[inline(always)]
    pub fn amount(&self, slot: u32) -> f32 {
        self.amounts[slot as usize]
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        (self.values.len() + self.amounts.len()) * size_of::<f32>()
    }

    /// Makes room for `points` points in all, of some numbers each.
    pub fn reserve(&mut self, points: usize, numbers: usize) {
        self.values.reserve_exact((points * numbers).saturating_sub(self.values.len()));
        self.amounts.reserve_exact(points.saturating_sub(self.amounts.len()));
    }

    /// Derives the values of those points that follow the ones that are there.
    fn extend<D: Derived<N>, const N: usize>(
        &mut self,
        lights: &PackedLights,
        points: &[Vec3],
        bits: &[VisibilityBits],
        amount: impl Fn(&[f32]) -> f32,
    ) {
        let known = self.amounts.len();
        let Some(new) = points.get(known..).filter(|new| !new.is_empty()) else { return };
        let first = self.values.len();
        self.values.resize(points.len() * N, 0.0);
        let values = &mut self.values[first..];
        let chunks = lights.chunks().len();
        if chunks > 0 {
            derive::<D, N>(lights, new, &bits[known * chunks..], values);
        }
        self.amounts.extend(values.chunks_exact(N).map(amount));
    }
}

/// DirectLight at the points that don't have it yet; `points` and `bits` are those of all.
pub fn derive_light(
    lights: &PackedLights,
    points: &[Vec3],
    bits: &[VisibilityBits],
    values: &mut DerivedValues,
) {
    values.extend::<DirectLight, 6>(lights, points, bits, |v| v[0] + v[1] + v[2]);
}

/// The same for irradiance by normal.
pub fn derive_irradiance(
    lights: &PackedLights,
    points: &[Vec3],
    bits: &[VisibilityBits],
    values: &mut DerivedValues,
) {
    values.extend::<IrradianceByNormal, { spherical_harmonics::STRIDE }>(
        lights,
        points,
        bits,
        spherical_harmonics::amount,
    );
}

/// Values of a mesh point that follow from its visibility bits without a ray.
///
/// A trait, since closures are compiled for the oldest processor wherever they are not inlined.
trait Derived<const N: usize> {
    /// The values of the point at `x`.
    fn at(lights: &PackedLights, x: Vec3, bits: &[VisibilityBits]) -> [f32; N];
}

/// Fills the `N` values per point.
fn derive<D: Derived<N>, const N: usize>(
    lights: &PackedLights,
    points: &[Vec3],
    bits: &[VisibilityBits],
    values: &mut [f32],
) {
    const POINTS: usize = 64;
    let chunks = lights.chunks().len();
    values
        .par_chunks_mut(N * POINTS)
        .zip(bits.par_chunks(chunks * POINTS))
        .zip(points.par_chunks(POINTS))
        .for_each(|((values, bits), points)| {
            vectorize(Derive::<D, N> { lights, points, bits, values, which: PhantomData });
        });
}

/// Some points of [`derive`], as work for the best instruction set.
struct Derive<'a, D, const N: usize> {
    lights: &'a PackedLights,
    points: &'a [Vec3],
    bits: &'a [VisibilityBits],
    values: &'a mut [f32],
    which: PhantomData<D>,
}

impl<D: Derived<N>, const N: usize> NullaryFnOnce for Derive<'_, D, N> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let bits = self.bits.chunks_exact(self.lights.chunks().len());
        for ((value, bits), &x) in self.values.chunks_exact_mut(N).zip(bits).zip(self.points) {
            value.copy_from_slice(&D::at(self.lights, x, bits));
        }
    }
}

/// DirectLight(x) of eq. (1), and the same with V = 1: RGB and RGB.
struct DirectLight<'a> {
    lights: &'a PackedLights,
    bits: &'a [VisibilityBits],
    sums: [Lanes; 6],
}

impl Derived<6> for DirectLight<'_> {
    #[inline(always)]
    fn at(lights: &PackedLights, x: Vec3, bits: &[VisibilityBits]) -> [f32; 6] {
        let mut light = DirectLight { lights, bits, sums: [[0.0; LANES]; 6] };
        lights.incident_at(x, &mut light);
        light.sums.map(|sum| horizontal_sum(&sum))
    }
}

impl IncidentLights for DirectLight<'_> {
    #[inline(always)]
    fn chunk(&mut self, index: usize, _: &[Lanes; 3], reciprocal: &Lanes) {
        let visible = expand_bits(self.bits[index]);
        let (seen, unoccluded) = self.sums.split_at_mut(3);
        let intensities = &self.lights.chunks()[index].intensity;
        for ((seen, unoccluded), intensity) in seen.iter_mut().zip(unoccluded).zip(intensities) {
            for lane in 0..LANES {
                let light = intensity[lane] * reciprocal[lane];
                seen[lane] += visible[lane] * light;
                unoccluded[lane] += light;
            }
        }
    }
}

/// Irradiance by normal at x: Σ_i V_i E_i/φ1 times the cosine lobe of light i's direction.
struct IrradianceByNormal<'a> {
    lights: &'a PackedLights,
    bits: &'a [VisibilityBits],
    sums: [[Lanes; COEFFICIENTS]; 3],
}

impl Derived<{ spherical_harmonics::STRIDE }> for IrradianceByNormal<'_> {
    #[inline(always)]
    fn at(lights: &PackedLights, x: Vec3, bits: &[VisibilityBits]) -> [f32; spherical_harmonics::STRIDE] {
        let mut irradiance = IrradianceByNormal { lights, bits, sums: [[[0.0; LANES]; COEFFICIENTS]; 3] };
        lights.incident_at(x, &mut irradiance);
        let mut coefficients = [0.0; spherical_harmonics::STRIDE];
        for (channel, sums) in irradiance.sums.iter().enumerate() {
            for (coefficient, sum) in coefficients.chunks_exact_mut(4).zip(sums) {
                coefficient[channel] = horizontal_sum(sum);
            }
        }
        coefficients
    }
}

impl IncidentLights for IrradianceByNormal<'_> {
    #[inline(always)]
    fn chunk(&mut self, index: usize, direction: &[Lanes; 3], reciprocal: &Lanes) {
        if self.bits[index] == 0 {
            return;
        }
        let visible = expand_bits(self.bits[index]);
        let mut lobe = [[0.0f32; LANES]; COEFFICIENTS];
        for lane in 0..LANES {
            let one = spherical_harmonics::cosine_lobe([
                direction[0][lane],
                direction[1][lane],
                direction[2][lane],
            ]);
            for (coefficient, value) in lobe.iter_mut().zip(one) {
                coefficient[lane] = value;
            }
        }
        for (sums, intensity) in self.sums.iter_mut().zip(&self.lights.chunks()[index].intensity) {
            let mut light = [0.0f32; LANES];
            for lane in 0..LANES {
                light[lane] = visible[lane] * intensity[lane] * reciprocal[lane];
            }
            for (sum, coefficient) in sums.iter_mut().zip(&lobe) {
                for lane in 0..LANES {
                    sum[lane] += light[lane] * coefficient[lane];
                }
            }
        }
    }
}
