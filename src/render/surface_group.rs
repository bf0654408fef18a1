//! Neighbouring surface points whose occlusion rays travel together.

use glam::Vec3;

use super::trace::PathVertex;
use crate::accel::{Accel, Coherence, LaneMask, RayPacket};
use crate::lights::{LightChunk, PackedLights, VisibilityBits, expand_bits};
use crate::simd::LANES;

/// Up to 16 surface points, and the rays from them towards one light: the best packet that backends have for
/// neighbouring points.
pub(super) struct SurfaceGroup {
    packet: RayPacket<LANES>,
    /// Shading normals and geometric normals, by axis.
    normals: [[f32; LANES]; 6],
    used: LaneMask,
}

impl SurfaceGroup {
    /// Group of the first 16 of some surface points.
    #[inline(always)]
    pub fn new(vertices: &[PathVertex]) -> Self {
        let mut packet = RayPacket::<LANES>::empty();
        packet.tnear = [0.0; LANES];
        let mut normals = [[0.0f32; LANES]; 6];
        let mut used = 0;
        for (lane, vertex) in vertices.iter().enumerate().take(LANES) {
            let surface = &vertex.surface;
            let origin = surface.ray_origin();
            packet.org_x[lane] = origin.x;
            packet.org_y[lane] = origin.y;
            packet.org_z[lane] = origin.z;
            let (n, g) = (surface.shading_normal, surface.geometric_normal);
            for (row, value) in normals.iter_mut().zip([n.x, n.y, n.z, g.x, g.y, g.z]) {
                row[lane] = value;
            }
            used |= 1 << lane;
        }
        Self { packet, normals, used }
    }

    /// Aims the rays at a light; returns the points that have it above their horizon.
    #[inline(always)]
    pub fn aim(&mut self, chunk: &LightChunk, light: usize) -> LaneMask {
        let Self { packet, normals, .. } = self;
        let mut facing: LaneMask = 0;
        for lane in 0..LANES {
            let d = chunk.to_light(light, [packet.org_x[lane], packet.org_y[lane], packet.org_z[lane]]);
            let cosine = normals[0][lane] * d[0] + normals[1][lane] * d[1] + normals[2][lane] * d[2];
            let side = normals[3][lane] * d[0] + normals[4][lane] * d[1] + normals[5][lane] * d[2];
            packet.dir_x[lane] = d[0];
            packet.dir_y[lane] = d[1];
            packet.dir_z[lane] = d[2];
            facing |= LaneMask::from(cosine > 0.0 && side > 0.0) << lane;
        }
        facing & self.used
    }

    /// The points, of those given, that see the light aimed at: one ray each.
    #[inline(always)]
    pub fn seeing<A: Accel>(&mut self, accel: &A, points: LaneMask) -> LaneMask {
        self.packet.tfar = [1.0; LANES];
        points & !accel.occluded_packet(points, &mut self.packet, Coherence::Coherent)
    }
}

/// I of each vertex from the lights whose bits are set, a row of bits per vertex.
#[inline(always)]
pub(super) fn light_of_seen(
    lights: &PackedLights,
    vertices: &[PathVertex],
    seen: &[VisibilityBits],
    light: &mut [Vec3],
) {
    let chunks = lights.chunks().len();
    for (number, (vertex, light)) in vertices.iter().zip(light).enumerate() {
        let bits = &seen[number * chunks..][..chunks];
        *light =
            lights.irradiance(&vertex.surface, |chunk| (bits[chunk] != 0).then(|| expand_bits(bits[chunk])));
    }
}
