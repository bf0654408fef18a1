//! Light of lights on the surfaces in a cell: its mean, and which light to ask about at a single point.

use glam::Vec3;

use super::cells::CellPoint;
use crate::accel::Accel;
use crate::light_mesh::direct_light::{Candidate, DirectLight};
use crate::sampling::hash_to_unit_cube;
use crate::simd::LANES;
use crate::world::World;

/// What falls on the surfaces that a point stands for from lights.
#[derive(Clone, Debug)]
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

    /// The candidate for a number in [0, 1): evenly spread numbers choose lights by what they give, those that were seen to be hidden less
    /// often. `None` if no light lies above the horizon.
    #[inline(always)]
    pub fn choose(&self, number: f32) -> Option<Candidate> {
        let candidates = self.candidates.get(..usize::from(self.count))?;
        let chosen = candidates.iter().find(|(_, end)| number < *end).or(candidates.last());
        chosen.map(|(candidate, _)| *candidate)
    }
}
