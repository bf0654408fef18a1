//! Solving: eq. (4) for surface points that send light to each other, bounce after bounce.

use glam::Vec3;
use rayon::prelude::*;

use super::gather::Gathered;
use super::points::SurfacePoints;
use crate::light_mesh::series::Series;

/// Light that falls on points, by number.
#[derive(Default)]
pub struct FallingLight {
    /// What direct light is multiplied by.
    pub scale: f32,
    /// From surfaces, over π, on points of level 0.
    pub indirect: Vec<Vec3>,
    /// From lights and surfaces, the latter that of the cell of level 0 around a small one, times the scale of the former.
    pub total: Vec<Vec3>,
}

impl FallingLight {
    /// Makes room for as many points.
    pub fn resize(&mut self, count: usize) {
        for light in [&mut self.indirect, &mut self.total] {
            light.resize(count, Vec3::ZERO);
        }
    }

    /// Brings the totals of some points up to date.
    pub fn total_up(&mut self, points: &SurfacePoints, numbers: &[u32]) {
        for &number in numbers {
            let indirect = self.indirect.get(points.parent(number) as usize).copied().unwrap_or_default();
            self.total[number as usize] = self.scale * points.direct(number) + indirect;
        }
    }
}

impl Gathered {
    /// Sum of the light that reaches the point of an index along its rays, given what falls on each point.
    #[inline(always)]
    pub fn sum(&self, index: usize, total: &[Vec3]) -> Vec3 {
        let mut sum = self.emitted.get(index).copied().unwrap_or_default();
        for ray in self.rays_of(index) {
            if let Some(&light) = total.get(ray.point as usize) {
                sum += ray.diffuse() * light;
            }
        }
        sum
    }

    /// Finds the light of at most `bounces` bounces from surfaces that falls on its points, which are of level 0; `numbers` are those whose
    /// totals depend on that. Ends when nothing changes by more than a tolerance.
    pub fn solve(
        &self,
        points: &SurfacePoints,
        numbers: &[u32],
        light: &mut FallingLight,
        bounces: u32,
        tolerance: f32,
    ) {
        if self.points.is_empty() {
            return;
        }
        let share = 1.0 / (self.rays.len() / self.points.len()) as f32;
        let mut series = Series::default();
        let mut before = vec![[0.0; 3]; self.points.len()];
        for bounce in 0..bounces {
            let mut after: Vec<[f32; 3]> = (0..self.points.len())
                .into_par_iter()
                .with_min_len(64)
                .map(|index| (self.sum(index, &light.total) * share).to_array())
                .collect();
            let remaining = bounces - 1 - bounce;
            let done = series.add(before.as_flattened(), after.as_flattened_mut(), remaining, tolerance);
            for (&number, value) in self.points.iter().zip(&after) {
                light.indirect[number as usize] = Vec3::from_array(*value);
            }
            light.total_up(points, numbers);
            before = after;
            if done {
                break;
            }
        }
    }
}
