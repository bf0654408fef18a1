//! Direct light of surfaces that indirect mesh points see.

use glam::Vec3;

use crate::accel::{Accel, Coherence, LaneMask, PacketLanes, RayPacket};
use crate::lights::{IncidentLights, PackedLights};
use crate::sampling::hash_to_unit_cube;
use crate::scene::{Ray, SurfacePoint};
use crate::simd::{LANES, Lanes};

/// I at single surface points, from at most 16 occlusion rays each.
#[derive(Default)]
pub struct DirectLight {
    /// By light, in the order of the packed lights: what a light gives the surface if nothing stands in its way.
    unoccluded: Vec<f32>,
    /// Lights that a ray is traced to, and what their light is multiplied by.
    chosen: Vec<(usize, f32)>,
    /// Rays traced.
    pub rays: u64,
}

impl DirectLight {
    /// I at a surface point: Σ_i V_i · φ2 · E_i / φ1.
    ///
    /// Where more than 16 lights lie above the horizon, 16 rays are dealt out among them in proportion to what each would give, at equal
    /// steps through their sum from a start that belongs to the position, so that the mean over all starts is I.
    #[inline(always)]
    pub fn at<A: Accel>(&mut self, accel: &A, lights: &PackedLights, surface: &SurfacePoint) -> Vec3 {
        self.unoccluded.clear();
        lights.incident_at(
            surface.position,
            &mut Unoccluded { lights, surface, amounts: &mut self.unoccluded },
        );
        let above = self.unoccluded.iter().filter(|&&amount| amount > 0.0).count();
        self.chosen.clear();
        if above <= LANES {
            let above = self.unoccluded.iter().enumerate().filter(|(_, amount)| **amount > 0.0);
            self.chosen.extend(above.map(|(light, _)| (light, 1.0)));
        } else {
            let step = self.unoccluded.iter().sum::<f32>() / LANES as f32;
            // How far it is from the sum of the lights before to the next step.
            let mut ahead = hash_to_unit_cube(surface.position).x * step;
            for (light, &amount) in self.unoccluded.iter().enumerate() {
                let mut steps = 0u32;
                while ahead < amount && self.chosen.len() < LANES {
                    ahead += step;
                    steps += 1;
                    if steps == LANES as u32 {
                        break;
                    }
                }
                ahead -= amount;
                if steps > 0 {
                    self.chosen.push((light, steps as f32 * step / amount));
                }
            }
        }
        let mut packet = RayPacket::<LANES>::empty();
        let (origin, mut active): (_, LaneMask) = (surface.ray_origin(), 0);
        for (lane, &(light, _)) in self.chosen.iter().enumerate() {
            let chunk = &lights.chunks()[light / LANES];
            let way = Vec3::from_array(chunk.to_light(light % LANES, origin.to_array()));
            packet.set_lane(lane, &Ray { t_far: 1.0, ..Ray::new(origin, way) });
            active |= 1 << lane;
        }
        self.rays += u64::from(active.count_ones());
        let blocked = accel.occluded_packet(active, &mut packet, Coherence::Incoherent);
        let mut sum = Vec3::ZERO;
        for (lane, &(light, factor)) in self.chosen.iter().enumerate() {
            if blocked >> lane & 1 == 0 {
                let intensity = Vec3::from_array(lights.intensity(light / LANES, light % LANES));
                let amount = self.unoccluded[light] * factor;
                sum += intensity * (amount / intensity.element_sum());
            }
        }
        sum
    }
}

/// Writes what lights give a surface without occluders: the sum of the colours.
struct Unoccluded<'a> {
    lights: &'a PackedLights,
    surface: &'a SurfacePoint,
    amounts: &'a mut Vec<f32>,
}

impl IncidentLights for Unoccluded<'_> {
    #[inline(always)]
    fn chunk(&mut self, index: usize, direction: &[Lanes; 3], reciprocal: &Lanes) {
        let [r, g, b] = &self.lights.chunks()[index].intensity;
        let (n, h) = (self.surface.shading_normal, self.surface.geometric_normal);
        let mut amounts = [0.0; LANES];
        for lane in 0..LANES {
            let [x, y, z] = [direction[0][lane], direction[1][lane], direction[2][lane]];
            let cosine = n.x * x + n.y * y + n.z * z;
            let side = h.x * x + h.y * y + h.z * z;
            let lit = if side > 0.0 && cosine > 0.0 { cosine } else { 0.0 };
            amounts[lane] = (r[lane] + g[lane] + b[lane]) * reciprocal[lane] * lit;
        }
        self.amounts.extend_from_slice(&amounts);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::BruteForce;
    use crate::lights::Unoccluded as AllSeen;
    use crate::scene::{Falloff, Light};

    fn lights(count: usize) -> PackedLights {
        let at = |i: usize| Vec3::new((i % 7) as f32 - 3.0, 1.0 + (i % 3) as f32, (i / 7) as f32 - 2.0);
        let lights: Vec<Light> =
            (0..count).map(|i| Light::point(at(i), Vec3::new(1.0, 0.5, (i % 4) as f32))).collect();
        PackedLights::new(&lights, Falloff::InverseSquare, 0.0)
    }
}
