//! Gathering: which surfaces new indirect mesh points see, and which points those depend on.

use glam::Vec3;
use rayon::prelude::*;

use super::mesh::IndirectMesh;
use crate::accel::{Accel, Coherence, PacketLanes, RayHitPacket, hit_of_lane};
use crate::light_mesh::leaks::is_inside_by_share;
use crate::light_mesh::lookup::Lookup;
use crate::light_mesh::points::Neighbours;
use crate::light_mesh::store::{NeededPoints, PointMask};
use crate::scene::{Hit, Interaction, Ray, Scene};

/// New mesh points with what their rays hit: N entries per point.
#[derive(Default)]
pub struct Gathering {
    /// The points.
    pub points: Vec<Vec3>,
    /// N per point.
    pub hits: Vec<Option<Hit>>,
}

/// Mesh points per parallel task: with N = 256 some hundred microseconds of rays.
pub const POINTS_PER_TASK: usize = 4;

impl IndirectMesh {
    /// What each of the points sees in each of its directions.
    pub(super) fn trace<A: Accel>(&self, accel: &A, points: &[Vec3]) -> Vec<Option<Hit>> {
        const WIDTH: usize = 16;
        let directions = self.strata.len() as usize;
        let mut hits = vec![None; points.len() * directions];
        hits.par_chunks_mut(directions * POINTS_PER_TASK)
            .zip(points.par_chunks(POINTS_PER_TASK))
            .with_max_len(1)
            .for_each(|(hits, points)| {
                for (hits, &x) in hits.chunks_mut(directions).zip(points) {
                    for (number, hits) in hits.chunks_mut(WIDTH).enumerate() {
                        let mut packet = RayHitPacket::<WIDTH>::empty();
                        for lane in 0..hits.len() {
                            let direction = self.strata.jittered((number * WIDTH + lane) as u32, x);
                            packet.set_lane(lane, &Ray::new(x, direction));
                        }
                        let active = ((1u64 << hits.len()) - 1) as u32;
                        accel.intersect_packet(active, &mut packet, Coherence::Incoherent);
                        for (lane, hit) in hits.iter_mut().enumerate() {
                            *hit = hit_of_lane(&packet, lane);
                        }
                    }
                }
            });
        hits
    }

    /// Calls `each(cell, direction, surface)` for a mesh point's directions; `None` where a ray left the scene.
    #[inline(always)]
    pub(super) fn for_each_hit(
        &self,
        scene: &Scene,
        x: Vec3,
        hits: &[Option<Hit>],
        mut each: impl FnMut(usize, Vec3, Option<Interaction>),
    ) {
        for (cell, hit) in hits.iter().enumerate() {
            let direction = self.strata.jittered(cell as u32, x);
            each(cell, direction, hit.as_ref().map(|hit| scene.interaction(hit, direction)));
        }
    }

    /// Which of the points lie inside of geometry, by the share of back faces that their rays hit.
    pub(super) fn inside_by_hits(&self, scene: &Scene, points: &[Vec3], hits: &[Option<Hit>]) -> Vec<bool> {
        let seen = points.par_iter().zip(hits.par_chunks(self.strata.len() as usize));
        seen.map(|(&x, hits)| {
            let mut backs = 0;
            self.for_each_hit(scene, x, hits, |_, _, surface| {
                backs += usize::from(surface.is_some_and(|surface| surface.shows_back()));
            });
            is_inside_by_share(backs, hits.len())
        })
        .collect()
    }

    /// The points of a mesh that lie in the neighbourhoods of the hits.
    pub(super) fn needed_at(
        &self,
        scene: &Scene,
        points: &[Vec3],
        hits: &[Option<Hit>],
        lookup: Lookup,
    ) -> PointMask {
        let directions = self.strata.len() as usize;
        let parts: Vec<Vec<(u64, u64)>> = points
            .par_chunks(POINTS_PER_TASK * 4)
            .zip(hits.par_chunks(directions * POINTS_PER_TASK * 4))
            .with_max_len(1)
            .map(|(points, hits)| {
                let mut needed = NeededPoints::default();
                let mut neighbours = Neighbours::default();
                for (&x, hits) in points.iter().zip(hits.chunks(directions)) {
                    self.for_each_hit(scene, x, hits, |_, _, surface| {
                        if let Some(surface) = surface {
                            lookup.neighbourhoods.find(&lookup.store.points, &surface.point, &mut neighbours);
                            neighbours.ids().iter().for_each(|&id| needed.insert(id));
                        }
                    });
                }
                needed.into_bricks().collect()
            })
            .collect();
        PointMask::union(parts.into_iter().flatten())
    }
}
