//! Gathering: which surfaces new indirect mesh points see, and which points those depend on.

use glam::{Mat3, Vec3};
use rayon::prelude::*;

use super::mesh::IndirectMesh;
use super::patches::Patches;
use crate::accel::{Accel, Coherence, PacketLanes, RayHitPacket, hit_of_lane};
use crate::light_mesh::leaks::is_inside_by_share;
use crate::light_mesh::lookup::Lookup;
use crate::light_mesh::points::Neighbours;
use crate::light_mesh::store::{NeededPoints, PointMask};
use crate::sampling::rotation_at;
use crate::scene::{Hit, Interaction, Ray, Scene, SurfacePoint};
use crate::world::World;

/// New mesh points with what their rays hit: N rays per point.
#[derive(Default)]
pub struct Gathering {
    /// The points.
    pub points: Vec<Vec3>,
    /// What surfaces emit towards a point, by point: direction and light, times the MIS weight.
    pub emitted: Vec<Vec<(Vec3, Vec3)>>,
    /// The patches that the rays hit.
    pub patches: Patches,
    /// N hits per point, where each is looked up by itself.
    pub hits: Vec<Option<Hit>>,
}

/// Mesh points per parallel task: with N = 256 some hundred microseconds of rays.
pub const POINTS_PER_TASK: usize = 4;

/// Width of a patch that is seen from afar, over the distance between neighbouring rays there.
const PATCH_PER_RAY: f32 = 0.5;

impl IndirectMesh {
    /// What each of the points sees in each of its directions.
    pub(super) fn trace<A: Accel>(&self, accel: &A, points: &[Vec3]) -> Vec<Option<Hit>> {
        const WIDTH: usize = 16;
        let directions = self.directions.len();
        let mut hits = vec![None; points.len() * directions];
        hits.par_chunks_mut(directions * POINTS_PER_TASK)
            .zip(points.par_chunks(POINTS_PER_TASK))
            .with_max_len(1)
            .for_each(|(hits, points)| {
                for (hits, &x) in hits.chunks_mut(directions).zip(points) {
                    let rotation = rotation_at(x);
                    for (hits, directions) in hits.chunks_mut(WIDTH).zip(self.directions.chunks(WIDTH)) {
                        let mut packet = RayHitPacket::<WIDTH>::empty();
                        for (lane, &direction) in directions.iter().enumerate() {
                            packet.set_lane(lane, &Ray::new(x, rotation * direction));
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

    /// Calls `each(direction, hit)` for a mesh point's directions; `None` where a ray left the scene.
    #[inline(always)]
    pub(super) fn for_each_hit(
        &self,
        scene: &Scene,
        x: Vec3,
        hits: &[Option<Hit>],
        mut each: impl FnMut(Vec3, Option<(&Hit, Interaction)>),
    ) {
        let rotation: Mat3 = rotation_at(x);
        for (&direction, hit) in self.directions.iter().zip(hits) {
            let direction = rotation * direction;
            each(direction, hit.as_ref().map(|hit| (hit, scene.interaction(hit, direction))));
        }
    }

    /// Which of the points lie inside of geometry, by the share of back faces that their rays hit.
    pub(super) fn inside_by_hits(&self, scene: &Scene, points: &[Vec3], hits: &[Option<Hit>]) -> Vec<bool> {
        let seen = points.par_iter().zip(hits.par_chunks(self.directions.len()));
        seen.map(|(&x, hits)| {
            let mut backs = 0;
            self.for_each_hit(scene, x, hits, |_, hit| {
                backs += usize::from(hit.is_some_and(|(_, surface)| surface.shows_back()));
            });
            is_inside_by_share(backs, hits.len())
        })
        .collect()
    }

    /// Sorts the hits of new points into patches; `finest` is the least width of a patch at a surface point.
    ///
    /// Where rays lie far apart, patches are as much wider, by a power of 2, so that all points have the same few widths.
    pub(super) fn sort_hits<A: Accel>(
        &self,
        world: World<A>,
        gathering: &mut Gathering,
        points: &[Vec3],
        hits: &[Option<Hit>],
        finest: impl Fn(&SurfacePoint) -> f32 + Sync,
    ) {
        let World { scene, emissive, .. } = world;
        let directions = self.directions.len();
        let apart = PATCH_PER_RAY * (4.0 * std::f32::consts::PI / directions as f32).sqrt();
        let sorted: Vec<_> = points
            .par_chunks(POINTS_PER_TASK)
            .zip(hits.par_chunks(directions * POINTS_PER_TASK))
            .with_max_len(1)
            .map(|(points, hits)| {
                let (mut patches, mut emitted) = (Patches::default(), Vec::with_capacity(points.len()));
                for (&x, hits) in points.iter().zip(hits.chunks(directions)) {
                    let mut towards_x = Vec::new();
                    self.for_each_hit(scene, x, hits, |direction, hit| {
                        let Some((hit, surface)) = hit else { return patches.push(None) };
                        let finest = finest(&surface.point);
                        let coarser = (apart * hit.t / finest).max(1.0).log2().floor().exp2();
                        patches.push(Some((&surface, finest * coarser)));
                        if surface.emission != Vec3::ZERO {
                            let share = self.mis_weight(emissive.pdf(scene, x, hit, &surface.point));
                            towards_x.push((direction, surface.emission * share));
                        }
                    });
                    emitted.push(towards_x);
                }
                (patches, emitted)
            })
            .collect();
        for (patches, emitted) in sorted {
            gathering.patches.extend(patches);
            gathering.emitted.extend(emitted);
        }
    }

    /// The points of a mesh that lie in the neighbourhoods of the hits.
    pub(super) fn needed_at(
        &self,
        scene: &Scene,
        points: &[Vec3],
        hits: &[Option<Hit>],
        lookup: Lookup,
    ) -> PointMask {
        let directions = self.directions.len();
        let parts: Vec<Vec<(u64, u64)>> = points
            .par_chunks(POINTS_PER_TASK * 4)
            .zip(hits.par_chunks(directions * POINTS_PER_TASK * 4))
            .with_max_len(1)
            .map(|(points, hits)| {
                let mut needed = NeededPoints::default();
                let mut neighbours = Neighbours::default();
                for (&x, hits) in points.iter().zip(hits.chunks(directions)) {
                    self.for_each_hit(scene, x, hits, |_, hit| {
                        if let Some((_, surface)) = hit {
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
