//! What lights would give a tile without any occluder.

use glam::Vec3;

use crate::lights::{IncidentLights, PackedLights};
use crate::render::paths::PathVertex;
use crate::simd::{LANES, Lanes};

/// Places of a tile at which the strength of its lights is found.
const PLACES: usize = 8;

/// Share of a light's strength that doesn't follow the cosine: what a normal at one place hides, others may see.
const ANY_NORMAL: f32 = 0.1;

/// What every light would give a tile without any occluder, up to a factor, by chunk.
#[inline(always)]
pub fn strengths(lights: &PackedLights, vertices: &[PathVertex]) -> Vec<Lanes> {
    let mut strengths =
        Strengths { lights, normal: Vec3::ZERO, sums: vec![[0.0; LANES]; lights.chunks().len()] };
    let places = PLACES.min(vertices.len());
    for place in 0..places {
        let surface = &vertices[(2 * place + 1) * vertices.len() / (2 * places)].surface;
        strengths.normal = surface.shading_normal;
        lights.incident_at(surface.position, &mut strengths);
    }
    strengths.sums
}

/// Sums of what lights would give some places, see [`strengths`].
struct Strengths<'a> {
    lights: &'a PackedLights,
    normal: Vec3,
    sums: Vec<Lanes>,
}

impl IncidentLights for Strengths<'_> {
    #[inline(always)]
    fn chunk(&mut self, index: usize, direction: &[Lanes; 3], reciprocal: &Lanes) {
        let [r, g, b] = &self.lights.chunks()[index].intensity;
        let n = self.normal;
        let sums = &mut self.sums[index];
        for lane in 0..LANES {
            let cosine = n.x * direction[0][lane] + n.y * direction[1][lane] + n.z * direction[2][lane];
            let cosine = if cosine > 0.0 { cosine } else { 0.0 };
            let share = ANY_NORMAL + (1.0 - ANY_NORMAL) * cosine;
            sums[lane] += (r[lane] + g[lane] + b[lane]) * reciprocal[lane] * share;
        }
    }
}
