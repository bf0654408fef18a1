//! Solving: eq. (4) for surface points that send light to each other, bounce after bounce.

use glam::Vec3;
use rayon::prelude::*;

use super::gathered::Gathered;
use crate::light_mesh::series::Series;

impl Gathered {
    /// Sum of the light that reaches the point of an index along its rays, given what falls on each point from surfaces.
    #[inline(always)]
    pub fn sum(&self, index: usize, indirect: &[Vec3]) -> Vec3 {
        let mut sum = Vec3::ZERO;
        for ray in self.rays_of(index) {
            if let Some(&light) = indirect.get(ray.point as usize) {
                sum += ray.diffuse() * light;
            }
        }
        let share = self.shares.get(index).copied().unwrap_or(1.0);
        self.emitted.get(index).copied().unwrap_or_default() + share * sum
    }

    /// Finds the light of at most `bounces` bounces from surfaces that falls on its points, over π: adds it to that which is known, by
    /// number. Ends when nothing changes by more than a tolerance.
    pub fn solve(&self, indirect: &mut [Vec3], bounces: u32, tolerance: f32) {
        if self.points.is_empty() {
            return;
        }
        let mut series = Series::default();
        let mut before = vec![[0.0; 3]; self.points.len()];
        for bounce in 0..bounces {
            let mut after: Vec<[f32; 3]> = (0..self.points.len())
                .into_par_iter()
                .with_min_len(64)
                .map(|index| (self.sum(index, indirect) / self.rays_of(index).len() as f32).to_array())
                .collect();
            let remaining = bounces - 1 - bounce;
            let done = series.add(before.as_flattened(), after.as_flattened_mut(), remaining, tolerance);
            for (&number, value) in self.points.iter().zip(&after) {
                indirect[number as usize] = Vec3::from_array(*value);
            }
            before = after;
            if done {
                break;
            }
        }
    }
}
