//! Visibility at points between coarser ones that are known: only where those disagree it has to be found out (method §8).

use glam::Vec3;
use rayon::prelude::*;

use super::field::DirectField;
use crate::accel::{Accel, Coherence, LaneMask, RayPacket};
use crate::lights::{LightChunk, PackedLights, VisibilityBits};
use crate::simd::LANES;

/// Points that are refined together: enough that those which disagree on a light fill packets.
const GROUP: usize = 64;

impl DirectField {
    /// Finds the visibility at further mesh points, whose slots follow those that are there: lights that all eight `corners` of a point see,
    /// or none of them, it sees or doesn't, the others are traced. Returns the number of occlusion rays.
    pub(super) fn refine<A: Accel>(
        &mut self,
        accel: &A,
        lights: &PackedLights,
        points: &[Vec3],
        corners: &[[u32; 8]],
    ) -> u64 {
        let chunks = lights.chunks().len();
        if chunks == 0 {
            return 0;
        }
        let mut bits = vec![0; points.len() * chunks];
        let rays = bits
            .par_chunks_mut(GROUP * chunks)
            .zip(points.par_chunks(GROUP).zip(corners.par_chunks(GROUP)))
            .with_max_len(1)
            .map(|(bits, (points, corners))| self.refine_group(accel, lights, points, corners, bits))
            .sum();
        self.bits.to_mut().extend(bits);
        rays
    }

    fn refine_group<A: Accel>(
        &self,
        accel: &A,
        lights: &PackedLights,
        points: &[Vec3],
        corners: &[[u32; 8]],
        bits: &mut [VisibilityBits],
    ) -> u64 {
        let chunks = lights.chunks().len();
        let known = self.bits();
        let mut rays = 0;
        for (index, chunk) in lights.chunks().iter().enumerate() {
            let mut open = [0 as VisibilityBits; GROUP];
            let mut anywhere = 0;
            for (point, corners) in corners.iter().enumerate() {
                let (mut all, mut any) = (VisibilityBits::MAX, 0);
                for &slot in corners {
                    let seen = known[slot as usize * chunks + index];
                    all &= seen;
                    any |= seen;
                }
                bits[point * chunks + index] = all;
                open[point] = any & !all;
                anywhere |= open[point];
            }
            while anywhere != 0 {
                let light = anywhere.trailing_zeros() as usize;
                anywhere &= anywhere - 1;
                let mut asking = (0..points.len()).filter(|&point| open[point] >> light & 1 == 1).peekable();
                while asking.peek().is_some() {
                    let mut owners = [0; LANES];
                    let count =
                        owners.iter_mut().zip(&mut asking).map(|(owner, point)| *owner = point).count();
                    let owners = &owners[..count];
                    let seen = seen_from(accel, chunk, light, points, owners);
                    rays += count as u64;
                    for (lane, &owner) in owners.iter().enumerate() {
                        bits[owner * chunks + index] |= VisibilityBits::from(seen >> lane & 1 == 1) << light;
                    }
                }
            }
        }
        rays
    }
}

/// Which of up to sixteen points see a light of a chunk.
pub(super) fn seen_from<A: Accel>(
    accel: &A,
    chunk: &LightChunk,
    light: usize,
    points: &[Vec3],
    which: &[usize],
) -> LaneMask {
    let mut packet = RayPacket::<LANES>::empty();
    for (lane, &point) in which.iter().enumerate() {
        let x = points[point];
        [packet.org_x[lane], packet.org_y[lane], packet.org_z[lane]] = x.to_array();
        [packet.dir_x[lane], packet.dir_y[lane], packet.dir_z[lane]] = chunk.way(light, x.to_array(), x, 0);
    }
    packet.tnear = [0.0; LANES];
    packet.tfar = [1.0; LANES];
    let active = ((1u64 << which.len()) - 1) as LaneMask;
    active & !accel.occluded_packet(active, &mut packet, Coherence::Incoherent)
}
