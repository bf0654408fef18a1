//! The conventional tracer (spec §10): one occlusion ray per light at every surface point.

use super::paths::PathVertex;
use crate::accel::{Accel, Coherence, LaneMask, RayPacket};
use crate::light_mesh::{LANES, LightTable, VisibilityBits};

/// Traces the occlusion rays from up to 16 surface points to their `undecided` lights, and counts them.
///
/// `undecided` and `bits` hold, point by point, a chunk of bits for each chunk of the table; lights that turn out
/// visible are added to `bits`. Packets run from the points towards one light, which is the best form that
/// backends have for neighbouring points; lights below a point's horizon cost no ray.
#[inline(always)]
pub fn see_lights_from_surface<A: Accel>(
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
