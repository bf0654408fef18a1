//! The direct light mesh (DLM): visibility of every light from mesh points, eq. (1).

use std::ops::Range;

use glam::Vec3;
use rayon::prelude::*;

use super::directional::{self, COEFFICIENTS};
use super::lights::{LANES, LightTable, VisibilityBits, expand_bits, horizontal_sum};
use crate::accel::{Accel, Coherence, LaneMask, RayPacket};
use crate::settings::Estimator;

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
        // Groups of 16 points are the packets; a task gets several, so that tasks are neither many nor long.
        const GROUP: usize = LANES;
        self.bits[first..]
            .par_chunks_mut(GROUP * chunks)
            .zip(points.par_chunks(GROUP))
            .for_each(|(bits, points)| see_lights(accel, lights, points, bits));

        let first_value = self.values.len();
        self.values.resize(first_value + points.len() * basis.stride(), 0.0);
        let values = &mut self.values[first_value..];
        let bits = &self.bits[first..];
        match basis {
            Basis::Bits => {}
            Basis::Scalar => derive(lights, points, bits, values, direct_light),
            Basis::Directional => derive(lights, points, bits, values, irradiance_by_normal),
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
            let blocked = accel.occluded_packet(active, &mut packet, Coherence::Coherent);
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

/// Fills the `N` values per point that follow from the visibility bits without a ray.
fn derive<const N: usize>(
    lights: &LightTable,
    points: &[Vec3],
    bits: &[VisibilityBits],
    values: &mut [f32],
    of_point: impl Fn(&LightTable, Vec3, &[VisibilityBits]) -> [f32; N] + Sync,
) {
    const POINTS: usize = 64;
    let chunks = lights.chunks().len();
    values
        .par_chunks_mut(N * POINTS)
        .zip(bits.par_chunks(chunks * POINTS))
        .zip(points.par_chunks(POINTS))
        .for_each(|((values, bits), points)| {
            pulp::Arch::new().dispatch(|| {
                let values = values.chunks_exact_mut(N);
                for ((value, bits), &x) in values.zip(bits.chunks_exact(chunks)).zip(points) {
                    value.copy_from_slice(&of_point(lights, x, bits));
                }
            });
        });
}

/// Places of the set bits; chunks are filled from lane 0 on.
fn lanes_of(used: VisibilityBits) -> Range<usize> {
    0..used.count_ones() as usize
}

/// DirectLight(x) of eq. (1), and the same with V = 1: RGB and RGB.
#[inline(always)]
fn direct_light(lights: &LightTable, x: Vec3, bits: &[VisibilityBits]) -> [f32; 6] {
    let mut sums = [[0.0f32; LANES]; 6];
    lights.for_each_chunk_from(x, |index, _, reciprocal| {
        let visible = expand_bits(bits[index]);
        for channel in 0..3 {
            let intensity = &lights.chunks()[index].intensity[channel];
            for lane in 0..LANES {
                let unoccluded = intensity[lane] * reciprocal[lane];
                sums[channel][lane] += visible[lane] * unoccluded;
                sums[channel + 3][lane] += unoccluded;
            }
        }
    });
    sums.map(|sum| horizontal_sum(&sum))
}

/// Irradiance by normal at x: Σ_i V_i E_i/φ1 times the cosine lobe of light i's direction.
#[inline(always)]
fn irradiance_by_normal(lights: &LightTable, x: Vec3, bits: &[VisibilityBits]) -> [f32; directional::STRIDE] {
    let mut sums = [[0.0f32; LANES]; 3 * COEFFICIENTS];
    lights.for_each_chunk_from(x, |index, direction, reciprocal| {
        if bits[index] == 0 {
            return;
        }
        let visible = expand_bits(bits[index]);
        let mut lobe = [[0.0f32; LANES]; COEFFICIENTS];
        for lane in 0..LANES {
            let one = directional::cosine_lobe(direction.map(|axis| axis[lane]));
            for (coefficient, value) in lobe.iter_mut().zip(one) {
                coefficient[lane] = value;
            }
        }
        for channel in 0..3 {
            let intensity = &lights.chunks()[index].intensity[channel];
            for (j, coefficient) in lobe.iter().enumerate() {
                let sum = &mut sums[channel * COEFFICIENTS + j];
                for lane in 0..LANES {
                    sum[lane] += visible[lane] * intensity[lane] * reciprocal[lane] * coefficient[lane];
                }
            }
        }
    });
    let mut coefficients = [0.0; directional::STRIDE];
    for (coefficient, sum) in coefficients.iter_mut().zip(&sums) {
        *coefficient = horizontal_sum(sum);
    }
    coefficients
}
