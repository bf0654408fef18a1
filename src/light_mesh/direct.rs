//! The direct light mesh (DLM): visibility of every light from mesh points, eq. (1).

use std::marker::PhantomData;
use std::ops::Range;

use glam::Vec3;
use pulp::NullaryFnOnce;
use rayon::prelude::*;

use super::directional::{self, COEFFICIENTS};
use super::lanes::{LANES, Lanes, VisibilityBits, expand_bits, horizontal_sum};
use super::lights::{LightTable, SeenFromPoint};
use crate::accel::{Accel, Coherence, LaneMask, RayPacket};
use crate::settings::Estimator;
use crate::simd::vectorize;

/// What is kept per mesh point beside the visibility bits, as the estimator demands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Basis {
    /// Nothing: the bits are all that `per-light` needs.
    Bits,
    /// DirectLight and the unoccluded DirectLight, RGB each.
    Scalar,
    /// Irradiance by normal, see [`directional`].
    Directional,
}

impl Basis {
    /// The basis that an estimator reads.
    pub fn of(estimator: Estimator) -> Self {
        match estimator {
            Estimator::PerLight => Self::Bits,
            Estimator::Paper | Estimator::Ratio => Self::Scalar,
            Estimator::Directional => Self::Directional,
        }
    }

    /// Numbers per mesh point.
    pub const fn stride(self) -> usize {
        match self {
            Self::Bits => 0,
            Self::Scalar => 6,
            Self::Directional => directional::STRIDE,
        }
    }
}

/// Values at known mesh points, indexed by slot.
///
/// Visibility is always kept, one bit per light and point: every other form of the direct field follows from
/// it without a ray.
#[derive(Default)]
pub struct DirectValues {
    bits: Vec<VisibilityBits>,
    values: Vec<f32>,
    /// Light at each point, summed over channels and directions; only beside scalar and directional values.
    amounts: Vec<f32>,
}

impl DirectValues {
    /// Visibility of the lights from the point in `slot`, by chunk of [`LANES`] lights.
    #[inline(always)]
    pub fn bits(&self, slot: u32, chunks: usize) -> &[VisibilityBits] {
        &self.bits[slot as usize * chunks..][..chunks]
    }

    /// The `N` numbers that the basis keeps for the point in `slot`.
    #[inline(always)]
    pub fn values<const N: usize>(&self, slot: u32) -> &[f32; N] {
        let at = slot as usize * N;
        self.values[at..at + N].first_chunk().unwrap_or(&[0.0; N])
    }

    /// Amount of light at the point in `slot`, to compare points with.
    #[inline(always)]
    pub fn amount(&self, slot: u32) -> f32 {
        self.amounts[slot as usize]
    }

    /// Evaluates further mesh points, whose slots follow those that are there; returns the number of occlusion rays.
    pub fn evaluate<A: Accel>(
        &mut self,
        accel: &A,
        lights: &LightTable,
        basis: Basis,
        points: &[Vec3],
    ) -> u64 {
        let chunks = lights.chunks().len();
        if chunks == 0 || points.is_empty() {
            self.values.resize(self.values.len() + points.len() * basis.stride(), 0.0);
            self.amounts.resize(self.amounts.len() + points.len(), 0.0);
            return 0;
        }
        let first = self.bits.len();
        self.bits.resize(first + points.len() * chunks, 0);
        // Groups of 16 points are the packets; a task gets so many that tasks are neither many nor long: without a limit the
        // last one, which nobody can help with, is long (see `TILES_PER_TASK` in the renderer).
        const GROUP: usize = LANES;
        const RAYS_PER_TASK: usize = 1 << 10;
        let groups_per_task = (RAYS_PER_TASK / (GROUP * lights.len())).max(1);
        self.bits[first..]
            .par_chunks_mut(GROUP * chunks)
            .zip(points.par_chunks(GROUP))
            .with_max_len(groups_per_task)
            .for_each(|(bits, points)| see_lights(accel, lights, points, bits));

        let first_value = self.values.len();
        self.values.resize(first_value + points.len() * basis.stride(), 0.0);
        let values = &mut self.values[first_value..];
        let bits = &self.bits[first..];
        match basis {
            Basis::Bits => {}
            Basis::Scalar => derive::<DirectLight, 6>(lights, points, bits, values),
            Basis::Directional => {
                derive::<IrradianceByNormal, { directional::STRIDE }>(lights, points, bits, values)
            }
        }
        let values = &self.values[first_value..];
        match basis {
            Basis::Bits => {}
            Basis::Scalar => self.amounts.extend(values.chunks_exact(6).map(|v| v[0] + v[1] + v[2])),
            Basis::Directional => {
                self.amounts.extend(values.chunks_exact(directional::STRIDE).map(directional::amount));
            }
        }
        (points.len() * lights.len()) as u64
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        self.bits.capacity() * size_of::<VisibilityBits>() + self.values.capacity() * size_of::<f32>()
    }
}

/// Traces the occlusion rays from up to 16 points to all lights: V_i(x) of eq. (1) as bits.
fn see_lights<A: Accel>(accel: &A, lights: &LightTable, points: &[Vec3], bits: &mut [VisibilityBits]) {
    let chunks = lights.chunks().len();
    let active: LaneMask = ((1u64 << points.len()) - 1) as LaneMask;
    let mut packet = RayPacket::<LANES>::empty();
    packet.tnear = [0.0; LANES];
    for lane in 0..LANES {
        // Lanes without a point repeat the last one: they are inactive, but must hold numbers.
        let x = points[lane.min(points.len() - 1)];
        packet.org_x[lane] = x.x;
        packet.org_y[lane] = x.y;
        packet.org_z[lane] = x.z;
    }
    for (index, chunk) in lights.chunks().iter().enumerate() {
        let mut visible = [0 as VisibilityBits; LANES];
        for light in lanes_of(chunk.used) {
            for lane in 0..LANES {
                let x = [packet.org_x[lane], packet.org_y[lane], packet.org_z[lane]];
                [packet.dir_x[lane], packet.dir_y[lane], packet.dir_z[lane]] = chunk.way_from(light, x);
            }
            // The query leaves −∞ in blocked lanes.
            packet.tfar = [1.0; LANES];
            // Points are far enough apart for their rays to part soon: as one, they would all visit what any of them does.
            let blocked = accel.occluded_packet(active, &mut packet, Coherence::Incoherent);
            visible[light] = (active & !blocked) as VisibilityBits;
        }
        // From points per light to lights per point.
        for point in 0..points.len() {
            let mut seen = 0;
            for (light, mask) in visible.iter().enumerate() {
                seen |= (mask >> point & 1) << light;
            }
            bits[point * chunks + index] = seen;
        }
    }
}

/// Values of a mesh point that follow from its visibility bits without a ray.
///
/// A trait, since closures are compiled for the oldest processor wherever they are not inlined.
trait Derived<const N: usize> {
    /// The values of the point at `x`.
    fn at(lights: &LightTable, x: Vec3, bits: &[VisibilityBits]) -> [f32; N];
}

/// Fills the `N` values per point.
fn derive<D: Derived<N>, const N: usize>(
    lights: &LightTable,
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
    lights: &'a LightTable,
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

/// Places of the set bits; chunks are filled from lane 0 on.
fn lanes_of(used: VisibilityBits) -> Range<usize> {
    0..used.count_ones() as usize
}

/// DirectLight(x) of eq. (1), and the same with V = 1: RGB and RGB.
struct DirectLight<'a> {
    lights: &'a LightTable,
    bits: &'a [VisibilityBits],
    sums: [Lanes; 6],
}

impl Derived<6> for DirectLight<'_> {
    #[inline(always)]
    fn at(lights: &LightTable, x: Vec3, bits: &[VisibilityBits]) -> [f32; 6] {
        let mut light = DirectLight { lights, bits, sums: [[0.0; LANES]; 6] };
        lights.see_from(x, &mut light);
        light.sums.map(|sum| horizontal_sum(&sum))
    }
}

impl SeenFromPoint for DirectLight<'_> {
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
    lights: &'a LightTable,
    bits: &'a [VisibilityBits],
    sums: [[Lanes; COEFFICIENTS]; 3],
}

impl Derived<{ directional::STRIDE }> for IrradianceByNormal<'_> {
    #[inline(always)]
    fn at(lights: &LightTable, x: Vec3, bits: &[VisibilityBits]) -> [f32; directional::STRIDE] {
        let mut irradiance = IrradianceByNormal { lights, bits, sums: [[[0.0; LANES]; COEFFICIENTS]; 3] };
        lights.see_from(x, &mut irradiance);
        let mut coefficients = [0.0; directional::STRIDE];
        for (channel, sums) in irradiance.sums.iter().enumerate() {
            for (coefficient, sum) in coefficients.chunks_exact_mut(4).zip(sums) {
                coefficient[channel] = horizontal_sum(sum);
            }
        }
        coefficients
    }
}

impl SeenFromPoint for IrradianceByNormal<'_> {
    #[inline(always)]
    fn chunk(&mut self, index: usize, direction: &[Lanes; 3], reciprocal: &Lanes) {
        if self.bits[index] == 0 {
            return;
        }
        let visible = expand_bits(self.bits[index]);
        let mut lobe = [[0.0f32; LANES]; COEFFICIENTS];
        for lane in 0..LANES {
            let one = directional::cosine_lobe([direction[0][lane], direction[1][lane], direction[2][lane]]);
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
