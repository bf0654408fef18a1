//! Neighbouring surface points whose occlusion rays travel together.

use glam::Vec3;

use super::paths::PathVertex;
use crate::accel::{Accel, Coherence, LaneMask, RayPacket};
use crate::lights::{LightChunk, PackedLights, SeenLights, SurfaceLanes, VisibilityBits, lamp_numbers};
use crate::simd::LANES;

/// Up to 16 surface points, and the rays from them towards one light: the best packet that backends have for
/// neighbouring points.
pub(super) struct SurfaceGroup {
    packet: RayPacket<LANES>,
    /// The points themselves; rays start a little in front of them.
    pub points: SurfaceLanes,
    used: LaneMask,
    /// Of the rays as they were aimed last.
    coherence: Coherence,
}

impl SurfaceGroup {
    /// Group of the first 16 of some surface points.
    #[inline(always)]
    pub fn new(vertices: &[PathVertex]) -> Self {
        let mut packet = RayPacket::<LANES>::empty();
        packet.tnear = [0.0; LANES];
        let zero = [[0.0; LANES]; 3];
        let mut points = SurfaceLanes { position: zero, shading: zero, geometric: zero };
        let mut used = 0;
        for (lane, vertex) in vertices.iter().enumerate().take(LANES) {
            let surface = &vertex.surface;
            let origin = surface.ray_origin();
            packet.org_x[lane] = origin.x;
            packet.org_y[lane] = origin.y;
            packet.org_z[lane] = origin.z;
            for axis in 0..3 {
                points.position[axis][lane] = surface.position[axis];
                points.shading[axis][lane] = surface.shading_normal[axis];
                points.geometric[axis][lane] = surface.geometric_normal[axis];
            }
            used |= 1 << lane;
        }
        Self { packet, points, used, coherence: Coherence::Coherent }
    }

    /// Aims the rays at a light; returns the points that have it above their horizon.
    #[inline(always)]
    pub fn aim(&mut self, chunk: &LightChunk, light: usize) -> LaneMask {
        let Self { packet, points: SurfaceLanes { shading: n, geometric: g, .. }, .. } = self;
        let mut facing: LaneMask = 0;
        for lane in 0..LANES {
            let d = chunk.to_light(light, [packet.org_x[lane], packet.org_y[lane], packet.org_z[lane]]);
            let cosine = n[0][lane] * d[0] + n[1][lane] * d[1] + n[2][lane] * d[2];
            let side = g[0][lane] * d[0] + g[1][lane] * d[1] + g[2][lane] * d[2];
            packet.dir_x[lane] = d[0];
            packet.dir_y[lane] = d[1];
            packet.dir_z[lane] = d[2];
            facing |= LaneMask::from(cosine > 0.0 && side > 0.0) << lane;
        }
        let facing = facing & self.used;
        self.coherence = chunk.coherence(light);
        if let Some(lamp) = chunk.lamp(light) {
            for lane in (0..LANES).filter(|lane| facing >> lane & 1 == 1) {
                let x = Vec3::new(packet.org_x[lane], packet.org_y[lane], packet.org_z[lane]);
                let to_light = Vec3::new(packet.dir_x[lane], packet.dir_y[lane], packet.dir_z[lane]);
                let way = lamp.way(to_light, x, lamp_numbers(x, 0));
                [packet.dir_x[lane], packet.dir_y[lane], packet.dir_z[lane]] = way.to_array();
            }
        }
        facing
    }

    /// Copies the ray of a point, as it was aimed last, into a lane of another packet.
    #[inline(always)]
    pub fn copy_ray(&self, lane: usize, packet: &mut RayPacket<LANES>, to: usize) {
        packet.org_x[to] = self.packet.org_x[lane];
        packet.org_y[to] = self.packet.org_y[lane];
        packet.org_z[to] = self.packet.org_z[lane];
        packet.dir_x[to] = self.packet.dir_x[lane];
        packet.dir_y[to] = self.packet.dir_y[lane];
        packet.dir_z[to] = self.packet.dir_z[lane];
        packet.tfar[to] = 1.0;
    }

    /// The points, of those given, that see the light aimed at: one ray each.
    #[inline(always)]
    pub fn seeing<A: Accel>(&mut self, accel: &A, points: LaneMask) -> LaneMask {
        self.packet.tfar = [1.0; LANES];
        points & !accel.occluded_packet(points, &mut self.packet, self.coherence)
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
        *light = lights.irradiance(&vertex.surface, SeenLights(bits));
    }
}
