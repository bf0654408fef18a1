//! Light of lights on the surfaces in a cell: its mean, and which light to ask about at a single point.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::cells::CellPoint;
use crate::accel::Accel;
use crate::light_mesh::direct_light::{Candidate, DirectLight};
use crate::lights::PackedLights;
use crate::sampling::hash_to_unit_cube;
use crate::simd::LANES;
use crate::world::World;

/// What falls on the surfaces that a point stands for from lights.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct CellLight {
    /// I, the mean over places spread over them.
    pub mean: Vec3,
    /// Difference between the most and the least of it at the places, over the mean.
    pub unevenness: f32,
    /// Candidates, each with the end of the numbers that choose it.
    candidates: [(Candidate, f32); LANES],
    count: u8,
}

impl CellLight {
    /// Light at a point of a cell of the given width.
    pub fn new<A: Accel>(world: World<A>, point: &CellPoint, width: f32, direct: &mut DirectLight) -> Self {
        let (mean, unevenness) = direct.mean(world.accel, world.lights, &point.spread(), 0.5 * width);
        let amounts: Vec<(u32, f32)> = direct.amounts().collect();
        let sum = amounts.iter().map(|(_, amount)| amount).sum::<f32>();
        let mut light = Self { mean, unevenness, candidates: [Default::default(); LANES], count: 0 };
        let mut add = |light_index: u32, amount: f32, end: f32| {
            light.candidates[usize::from(light.count)] =
                (Candidate { light: light_index, weight: sum / amount }, end);
            light.count += 1;
        };
        if amounts.len() <= LANES {
            let mut end = 0.0;
            for &(index, amount) in &amounts {
                end += amount / sum;
                add(index, amount, end);
            }
        } else {
            // Equal steps through the sum, from a start that belongs to the point.
            let start = hash_to_unit_cube(point.surface.position).y;
            let (mut passed, mut steps) = (0.0, 0.0f32);
            for &(index, amount) in &amounts {
                passed += amount / sum * LANES as f32;
                let reached = (passed - start).ceil().clamp(steps, LANES as f32);
                if reached > steps {
                    steps = reached;
                    add(index, amount, steps / LANES as f32);
                }
            }
        }
        light
    }

    /// Whether the candidates are lights of a scene.
    pub fn is_among(&self, lights: &PackedLights) -> bool {
        let candidates = self.candidates.get(..usize::from(self.count));
        let exists =
            |(candidate, _): &(Candidate, f32)| (candidate.light as usize) < lights.chunks().len() * LANES;
        candidates.is_some_and(|candidates| candidates.iter().all(exists))
    }

    /// The candidate for a number in [0, 1): evenly spread numbers choose lights by what they give, those that were seen to be hidden less
    /// often. `None` if no light lies above the horizon.
    #[inline(always)]
    pub fn choose(&self, number: f32) -> Option<Candidate> {
        let candidates = self.candidates.get(..usize::from(self.count))?;
        let chosen = candidates.iter().find(|(_, end)| number < *end).or(candidates.last());
        chosen.map(|(candidate, _)| *candidate)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::BruteForceAccel;
    use crate::lights::{EmissiveTriangles, Unoccluded};
    use crate::scene::{Falloff, Light, Scene, SurfacePoint};

    /// What a point of a floor gets by asking about one light for each of many even numbers, over what all lights give it, averaged over
    /// some cells.
    fn asked(count: usize) -> Vec3 {
        let at = |i: usize| Vec3::new((i % 7) as f32 - 3.0, 1.0 + (i % 3) as f32, (i / 7) as f32 - 2.0);
        let lamps: Vec<Light> =
            (0..count).map(|i| Light::point(at(i), Vec3::new(1.0, 0.5, (i % 4) as f32 + 0.5))).collect();
        let (scene, lights) = (Scene::default(), PackedLights::new(&lamps, Falloff::InverseSquare, 0.0));
        let (accel, emissive) = (BruteForceAccel::new(&scene), EmissiveTriangles::of_scene(&scene));
        let world = World { accel: &accel, scene: &scene, lights: &lights, emissive: &emissive };
        let (cells, numbers) = (200, 500);
        let mut sum = Vec3::ZERO;
        for cell in 0..cells {
            let middle = SurfacePoint::flat(Vec3::X * 1e-4 * cell as f32, Vec3::Y);
            let light = CellLight::new(world, &CellPoint::alone(&middle), 0.0, &mut DirectLight::default());
            let surface = SurfacePoint::flat(middle.position + Vec3::Z * 0.05, Vec3::Y);
            let mut found = Vec3::ZERO;
            for number in 0..numbers {
                let chosen = light.choose((number as f32 + 0.5) / numbers as f32).expect("lights above");
                let (chunk, lane) = (chosen.light as usize / LANES, chosen.light as usize % LANES);
                let intensity = Vec3::from_array(lights.intensity(chunk, lane));
                found += intensity * lights.factor(chunk, lane, &surface) * chosen.weight;
            }
            sum += found / numbers as f32 / lights.irradiance(&surface, Unoccluded);
        }
        sum / cells as f32
    }

    /// One light at a time makes all the light: exactly for up to 16 lights, on average over cells for more.
    #[test]
    fn one_light_at_a_time_is_all_of_them() {
        for (count, most) in [(1, 0.005), (5, 0.005), (16, 0.005), (60, 0.02)] {
            let share = asked(count);
            assert!((share - 1.0).abs().max_element() < most, "{share} of the light of {count}");
        }
    }
}
