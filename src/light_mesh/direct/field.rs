//! The direct field at known mesh points, eq. (1): visibility of every light as bits, and what follows from them.

use glam::Vec3;
use rayon::prelude::*;

use super::derived::{Basis, DerivedValues, derive_irradiance, derive_light};
use super::spherical_harmonics;
use super::stored_bits::StoredBits;
use crate::accel::{Accel, Coherence, LaneMask, RayPacket};
use crate::lights::{PackedLights, VisibilityBits};
use crate::simd::LANES;

/// Values at known mesh points, indexed by slot.
///
/// Visibility is what is kept, one bit per light and point: every other form of the direct field follows from it without a
/// ray. Those are caches, filled for the estimators that read them and emptied when the lights' intensities change.
#[derive(Default)]
pub struct DirectField {
    pub(super) bits: StoredBits,
    /// The bits that something moved in front of, by slot and chunk as `bits`; those of points behind its end are all right.
    pub(super) stale: Vec<VisibilityBits>,
    light: DerivedValues,
    irradiance: DerivedValues,
}

impl DirectField {
    /// Visibility of the lights, by slot and chunk of [`LANES`] lights.
    pub(super) fn bits(&self) -> &[VisibilityBits] {
        self.bits.as_slice()
    }

    /// Of points whose bits are known.
    pub(super) fn of_bits(bits: StoredBits) -> Self {
        Self { bits, ..Self::default() }
    }

    /// Adds the bits of some points of another field, whose slots here follow those that are there.
    pub(super) fn append(&mut self, other: &Self, slots: &[u32], chunks: usize) {
        if slots.is_empty() || chunks == 0 {
            return;
        }
        let bits = self.bits.to_mut();
        let known = other.bits();
        let of_point = |slot: &u32| known.get(*slot as usize * chunks..).and_then(|bits| bits.get(..chunks));
        bits.extend(slots.iter().flat_map(|slot| of_point(slot).unwrap_or_default()));
    }

    /// DirectLight and the unoccluded DirectLight at the point in `slot`, RGB each.
    #[inline(always)]
    pub(crate) fn light(&self, slot: u32) -> &[f32; 6] {
        self.light.values(slot)
    }

    /// Irradiance by normal at the point in `slot`, see [`spherical_harmonics`].
    #[inline(always)]
    pub(crate) fn irradiance(&self, slot: u32) -> &[f32; spherical_harmonics::STRIDE] {
        self.irradiance.values(slot)
    }

    /// Amount of light at the point in `slot`, summed over channels and directions, to compare points with; of one basis.
    #[inline(always)]
    pub(crate) fn amount(&self, basis: Basis, slot: u32) -> f32 {
        match basis {
            Basis::Bits => 0.0,
            Basis::Light => self.light.amount(slot),
            Basis::Irradiance => self.irradiance.amount(slot),
        }
    }

    /// Traces the lights' visibility from further mesh points, whose slots follow those that are there; returns the number of
    /// occlusion rays.
    pub fn trace<A: Accel>(&mut self, accel: &A, lights: &PackedLights, points: &[Vec3]) -> u64 {
        let chunks = lights.chunks().len();
        if chunks == 0 || points.is_empty() {
            return 0;
        }
        let bits = self.bits.to_mut();
        let first = bits.len();
        bits.resize(first + points.len() * chunks, 0);
        // Sixteen points make a packet; a task gets so many that tasks are neither many nor long: without a limit the
        // last one, which nobody can help with, is long (see `TILES_PER_TASK` in the renderer).
        const PACKET: usize = LANES;
        const RAYS_PER_TASK: usize = 1 << 10;
        let packets_per_task = (RAYS_PER_TASK / (PACKET * lights.len())).max(1);
        bits[first..]
            .par_chunks_mut(PACKET * chunks)
            .zip(points.par_chunks(PACKET))
            .with_max_len(packets_per_task)
            .for_each(|(bits, points)| trace_visibility(accel, lights, points, bits));
        (points.len() * lights.len()) as u64
    }

    /// Derives the values of a basis at all known points that don't have them yet; `points` are the positions of all.
    pub fn derive(&mut self, lights: &PackedLights, basis: Basis, points: &[Vec3]) {
        match basis {
            Basis::Bits => {}
            Basis::Light => derive_light(lights, points, self.bits.as_slice(), &mut self.light),
            Basis::Irradiance => {
                derive_irradiance(lights, points, self.bits.as_slice(), &mut self.irradiance);
            }
        }
    }

    /// Forgets all derived values, since the lights' intensities have changed.
    pub(crate) fn forget_derived(&mut self) {
        (self.light, self.irradiance) = Default::default();
    }

    /// Bytes held.
    pub(crate) fn memory_bytes(&self) -> usize {
        self.bits.bytes_with(0)
            + self.stale.len() * size_of::<VisibilityBits>()
            + self.light.memory_bytes()
            + self.irradiance.memory_bytes()
    }

    /// The same once `known` points have become `all`, of so many chunks of lights, and a basis is derived.
    pub(super) fn bytes_with(&self, known: usize, all: usize, chunks: usize, basis: Basis) -> usize {
        let derived = match basis {
            Basis::Bits => None,
            Basis::Light => Some(&self.light),
            Basis::Irradiance => Some(&self.irradiance),
        };
        let derived = derived.map_or(0, |held| {
            (all * (basis.numbers() + 1) * size_of::<f32>()).saturating_sub(held.memory_bytes())
        });
        let bits = self.bits.bytes_with((all - known) * chunks) - self.bits.bytes_with(0);
        self.memory_bytes() + bits + derived
    }

    /// Makes room for that.
    pub(super) fn reserve(&mut self, known: usize, all: usize, chunks: usize, basis: Basis) {
        if all > known {
            self.bits.to_mut().reserve_exact((all - known) * chunks);
        }
        match basis {
            Basis::Bits => {}
            Basis::Light => self.light.reserve(all, basis.numbers()),
            Basis::Irradiance => self.irradiance.reserve(all, basis.numbers()),
        }
    }
}

/// Traces the occlusion rays from up to 16 points to all lights: V_i(x) of eq. (1) as bits.
fn trace_visibility<A: Accel>(
    accel: &A,
    lights: &PackedLights,
    points: &[Vec3],
    bits: &mut [VisibilityBits],
) {
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
        // Chunks are filled from lane 0 on.
        for light in 0..chunk.used.count_ones() as usize {
            for lane in 0..LANES {
                let x = [packet.org_x[lane], packet.org_y[lane], packet.org_z[lane]];
                // Of a lamp with a size each mesh point knows one place, other ones of other places: where they agree, all is seen or nothing.
                [packet.dir_x[lane], packet.dir_y[lane], packet.dir_z[lane]] =
                    chunk.way(light, x, x.into(), 0);
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
