//! The conventional tracer (spec §10): one occlusion ray per light at every surface point.

use glam::Vec3;

use super::paths::{PathVertex, TilePaths};
use super::stats::RenderStats;
use super::wavefront::{BlockIntegrator, ShadeCounters};
use crate::accel::{Accel, Coherence, LaneMask, RayPacket};
use crate::light_mesh::{LANES, LightTable, VisibilityBits, expand_bits};

/// Traces the occlusion rays from up to 16 surface points to their `undecided` lights, and counts them.
///
/// `undecided` and `bits` hold, point by point, a chunk of bits for each chunk of the table; lights that turn out
/// visible are added to `bits`. Packets run from the points towards one light, which is the best form that
/// backends have for neighbouring points; lights below a point's horizon cost no ray.
#[inline(always)]
fn see_lights_from_surface<A: Accel>(
    accel: &A,
    lights: &LightTable,
    vertices: &[PathVertex],
    undecided: &[VisibilityBits],
    bits: &mut [VisibilityBits],
) -> u64 {
    let chunks = lights.chunks().len();
    let mut packet = RayPacket::<LANES>::empty();
    packet.tnear = [0.0; LANES];
    let mut normals = [[0.0f32; LANES]; 6];
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
    }
    let mut rays = 0;
    for (index, chunk) in lights.chunks().iter().enumerate() {
        let any = (0..vertices.len()).fold(0, |any, point| any | undecided[point * chunks + index]);
        for light in (0..LANES).filter(|light| any >> light & 1 == 1) {
            let mut asked: LaneMask = 0;
            for point in 0..vertices.len() {
                asked |= LaneMask::from(undecided[point * chunks + index] >> light & 1) << point;
            }
            let mut active: LaneMask = 0;
            for lane in 0..LANES {
                let d = chunk.way_from(light, [packet.org_x[lane], packet.org_y[lane], packet.org_z[lane]]);
                let cosine = normals[0][lane] * d[0] + normals[1][lane] * d[1] + normals[2][lane] * d[2];
                let side = normals[3][lane] * d[0] + normals[4][lane] * d[1] + normals[5][lane] * d[2];
                packet.dir_x[lane] = d[0];
                packet.dir_y[lane] = d[1];
                packet.dir_z[lane] = d[2];
                active |= LaneMask::from(cosine > 0.0 && side > 0.0) << lane;
            }
            active &= asked;
            if active == 0 {
                continue;
            }
            packet.tfar = [1.0; LANES];
            rays += u64::from(active.count_ones());
            let blocked = accel.occluded_packet(active, &mut packet, Coherence::Coherent);
            let visible = active & !blocked;
            for point in 0..vertices.len() {
                bits[point * chunks + index] |= ((visible >> point & 1) << light) as VisibilityBits;
            }
        }
    }
    rays
}

/// Shades with occlusion rays from the surface points to those lights that `decide` leaves open.
///
/// `decide(vertex, seen, undecided)` fills in, per chunk, the lights known to be visible and the lights to ask.
/// Returns the number of rays.
#[inline(always)]
pub(super) fn shade_traced<A: Accel>(
    accel: &A,
    lights: &LightTable,
    vertices: &[PathVertex],
    emit: &mut dyn FnMut(&PathVertex, Vec3),
    mut decide: impl FnMut(&PathVertex, &mut [VisibilityBits], &mut [VisibilityBits]),
) -> u64 {
    let mut rays = 0;
    let chunks = lights.chunks().len();
    let mut bits = vec![0; chunks * LANES];
    let mut undecided = bits.clone();
    for group in vertices.chunks(LANES) {
        for (point, vertex) in group.iter().enumerate() {
            let range = point * chunks..(point + 1) * chunks;
            decide(vertex, &mut bits[range.clone()], &mut undecided[range]);
        }
        rays += see_lights_from_surface(accel, lights, group, &undecided, &mut bits);
        for (point, vertex) in group.iter().enumerate() {
            let visible = &bits[point * chunks..];
            let illumination = lights.illuminate(&vertex.surface, |chunk| {
                (visible[chunk] != 0).then(|| expand_bits(visible[chunk]))
            });
            emit(vertex, illumination);
        }
    }
    rays
}

/// Shades with all shadow rays traced.
pub(super) struct ConventionalIntegrator<'a, A> {
    pub accel: &'a A,
    pub lights: LightTable,
    /// What direct light is multiplied by before k_d.
    pub scale: f32,
}

impl<A: Accel> BlockIntegrator for ConventionalIntegrator<'_, A> {
    fn prepare(&mut self, _: &[TilePaths], _: &mut RenderStats) {}

    fn shade(&self, vertices: &[PathVertex], emit: &mut dyn FnMut(&PathVertex, Vec3)) -> ShadeCounters {
        pulp::Arch::new().dispatch(|| {
            let mut scaled = |vertex: &PathVertex, light: Vec3| emit(vertex, light * self.scale);
            let shadow_rays =
                shade_traced(self.accel, &self.lights, vertices, &mut scaled, |_, seen, undecided| {
                    seen.fill(0);
                    for (bits, chunk) in undecided.iter_mut().zip(self.lights.chunks()) {
                        *bits = chunk.used;
                    }
                });
            ShadeCounters { shadow_rays, ..ShadeCounters::default() }
        })
    }
}
