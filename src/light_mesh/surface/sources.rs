//! Sources: the points of level 0 that send light on to records, and which of them matter.

use std::collections::{HashMap, HashSet};

use glam::Vec3;
use rayon::prelude::*;

use super::directions::part;
use super::gathered::{Gathered, GatheredRay};
use super::mesh::{SurfaceEvaluation, SurfaceMesh};
use crate::accel::Accel;
use crate::world::World;

/// Part of the light of records that sources may leave out that send little of it.
const LEFT_OUT: f32 = 5e-4;

/// What records see.
pub struct RecordRays {
    /// With the directions with which they were looked at.
    pub looked: Gathered,
    /// With others.
    pub rest: Gathered,
    /// The records.
    pub records: Vec<RecordSight>,
}

/// Where what a record sees is found.
#[derive(Clone, Copy)]
pub struct RecordSight {
    /// Number of the record.
    pub number: u32,
    /// Index among the looked at.
    pub looked: usize,
    /// Index among the rest.
    pub rest: Option<usize>,
}

impl RecordRays {
    /// The rays of a record: those with which it was looked at, and others.
    #[inline(always)]
    fn rays(&self, record: &RecordSight) -> [&[GatheredRay]; 2] {
        let rest = record.rest.map_or(&[][..], |rest| self.rest.rays_of(rest));
        [self.looked.rays_of(record.looked), rest]
    }

    /// What each record receives, given what falls on each point from surfaces.
    pub fn received(&self, indirect: &[Vec3]) -> Vec<Vec3> {
        let of = |record: &RecordSight| {
            let [looked, rest] = self.rays(record);
            let sum = self.looked.sum(record.looked, indirect)
                + record.rest.map_or(Vec3::ZERO, |index| self.rest.sum(index, indirect));
            sum / (looked.len() + rest.len()).max(1) as f32
        };
        self.records.par_iter().with_min_len(64).map(of).collect()
    }
}

impl SurfaceMesh {
    /// Lets sources gather that matter for what records see. Returns what they see.
    ///
    /// A source matters by how much of its light arrives at the records, over one bounce or several. Those that together matter least
    /// are left out: in a house of many rooms it is most.
    pub(super) fn find_sources<A: Accel>(
        &mut self,
        world: World<A>,
        sight: &RecordRays,
        evaluation: &mut SurfaceEvaluation,
    ) -> Gathered {
        let mut sources = Gathered::default();
        if self.settings.bounces < 2 {
            return sources;
        }
        let weight = 1.0 / sight.records.len().max(1) as f32;
        let mut importance = vec![0.0; self.points.len()];
        for record in &sight.records {
            let [looked, rest] = sight.rays(record);
            let share = weight / (looked.len() + rest.len()).max(1) as f32;
            looked.iter().chain(rest).for_each(|ray| ray.add_to(&mut importance, share));
        }
        while let Some(chosen) = self.choose(&mut importance) {
            let mean = chosen.iter().map(|(_, amount)| amount).sum::<f32>() / chosen.len() as f32;
            // Where each record has many, they need not know each light so well.
            let many = match chosen.len() / sight.records.len().max(1) {
                0..4 => 1,
                4..16 => 2,
                _ => 4,
            };
            // The noise of a source counts as much as its light does.
            let share = |amount: f32| match amount / mean {
                ..0.25 => 8 * many,
                ..1.0 => 4 * many,
                _ => 2 * many,
            };
            for of in [2 * many, 4 * many, 8 * many] {
                let (numbers, amounts): (Vec<u32>, Vec<f32>) =
                    chosen.iter().filter(|(_, amount)| share(*amount) == of).copied().unzip();
                let count = part(self.settings.directions, of);
                // Light of lights matters less after two bounces: wide cells will do.
                let gathered = self.gather(world, 0..count, f32::INFINITY, numbers, evaluation);
                evaluation.evaluated += gathered.points.len() as u64;
                importance.resize(self.points.len(), 0.0);
                for (rays, amount) in gathered.rays.chunks(count as usize).zip(&amounts) {
                    rays.iter().for_each(|ray| ray.add_to(&mut importance, amount / count as f32));
                }
                sources.append(gathered);
            }
        }
        sources
    }

    /// Takes sources out of those that some importance is known of, by number, all but the least important; `None` if no other is left.
    fn choose(&mut self, importance: &mut [f32]) -> Option<Vec<(u32, f32)>> {
        let unknown = |(number, amount): &(usize, &mut f32)| **amount > 0.0 && !self.states[*number].solved;
        let important = importance.iter_mut().enumerate().filter(unknown);
        let mut sources: Vec<(u32, f32)> =
            important.map(|(number, amount)| (number as u32, std::mem::take(amount))).collect();
        let points = &self.points;
        sources.sort_by(|a, b| a.1.total_cmp(&b.1).then_with(|| points.key(a.0).cmp(&points.key(b.0))));
        let mut left_out = 0.0;
        let first = sources.iter().position(|(_, amount)| {
            left_out += amount;
            left_out > LEFT_OUT
        })?;
        let mut chosen = sources.split_off(first);
        for (number, amount) in sources {
            importance[number as usize] = amount;
        }
        chosen.sort_by_cached_key(|&(number, _)| points.key(number));
        chosen.iter().for_each(|(number, _)| self.states[*number as usize].solved = true);
        Some(chosen)
    }

    /// Puts what records receive in place of what new sources around them do, for they know better; returns whether there were any.
    pub(super) fn correct(&mut self, sources: &Gathered, records: &[RecordSight], received: &[Vec3]) -> bool {
        let new: HashSet<u32> = sources.points.iter().copied().collect();
        let mut sums = HashMap::<u32, (Vec3, f32)>::new();
        for (record, light) in records.iter().zip(received) {
            let parent = self.points.parent(record.number);
            if new.contains(&parent) {
                let (sum, count) = sums.entry(parent).or_default();
                *sum += *light;
                *count += 1.0;
            }
        }
        for (&parent, (sum, count)) in &sums {
            self.indirect[parent as usize] = sum / count;
        }
        !sums.is_empty()
    }
}
