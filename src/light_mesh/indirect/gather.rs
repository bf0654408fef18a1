//! Gathering: which surfaces new indirect mesh points see, and which points those depend on.

use glam::{Mat3, Vec3};
use rayon::prelude::*;

use super::mesh::IndirectMesh;
use super::patches::{NO_PATCH, PatchCell, PatchCells};
use crate::accel::{Accel, Coherence, PacketLanes, RayHitPacket, hit_of_lane};
use crate::light_mesh::leaks::is_inside_by_share;
use crate::light_mesh::lookup::Lookup;
use crate::light_mesh::packed_colour::PackedColour;
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
    /// N per point, where patches are used.
    pub rays: Vec<GatheredRay>,
    /// N hits per point, where each is looked up by itself.
    pub hits: Vec<Option<Hit>>,
}

/// What a ray found.
#[derive(Clone, Copy, Debug)]
pub struct GatheredRay {
    /// Number of the patch, or [`NO_PATCH`].
    pub patch: u32,
    diffuse: PackedColour,
}

impl GatheredRay {
    /// A ray that left the scene.
    const MISS: Self = Self { patch: NO_PATCH, diffuse: PackedColour::BLACK };

    #[inline(always)]
    fn new(patch: u32, diffuse: Vec3) -> Self {
        Self { patch, diffuse: PackedColour::new(diffuse) }
    }

    /// k_d where the ray ended.
    #[inline(always)]
    pub fn diffuse(self) -> Vec3 {
        self.diffuse.colour()
    }
}

/// Mesh points per parallel task: with N = 256 some hundred microseconds of rays.
pub const POINTS_PER_TASK: usize = 4;

/// Mesh points whose hits are sorted by themselves: so many that most patches are found more than once.
const POINTS_PER_PART: usize = 32;

/// Width of the patches that are tried where no point can stand for a patch, over that patch's.
const SMALLER_PATCH: f32 = 0.25;

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

    /// Sorts the hits of new points into patches, where these are used, and into what surfaces emit; `width` is that of a patch
    /// at a surface point. Returns the number of occlusion rays.
    pub(super) fn sort_hits<A: Accel>(
        &mut self,
        world: World<A>,
        gathering: &mut Gathering,
        points: &[Vec3],
        hits: &[Option<Hit>],
        width: impl Fn(&SurfacePoint) -> f32 + Sync,
    ) -> u64 {
        let World { scene, emissive, .. } = world;
        let directions = self.directions.len();
        let this = &*self;
        let sorted: Vec<_> = points
            .par_chunks(POINTS_PER_PART)
            .zip(hits.par_chunks(directions * POINTS_PER_PART))
            .with_max_len(1)
            .map(|(points, hits)| {
                let mut cells = PatchCells::default();
                let (mut rays, mut emitted) = (Vec::new(), Vec::with_capacity(points.len()));
                for (&x, hits) in points.iter().zip(hits.chunks(directions)) {
                    let mut towards_x = Vec::new();
                    this.for_each_hit(scene, x, hits, |direction, hit| {
                        if this.uses_patches() {
                            rays.push(hit.as_ref().map_or(GatheredRay::MISS, |(_, surface)| {
                                let cell = PatchCell::of(&surface.point, width(&surface.point));
                                GatheredRay::new(cells.number(cell), surface.diffuse)
                            }));
                        }
                        let Some((hit, surface)) = hit else { return };
                        if world.gathers(&surface) {
                            let share = this.mis_weight(emissive.pdf(scene, x, hit, &surface.point));
                            towards_x.push((direction, surface.emission * share));
                        }
                    });
                    emitted.push(towards_x);
                }
                (cells, rays, emitted)
            })
            .collect();
        let first = gathering.rays.len();
        for (cells, rays, emitted) in sorted {
            let numbers: Vec<u32> = cells.cells.into_iter().map(|cell| self.patches.number(cell)).collect();
            let renumbered = rays.into_iter().map(|ray| {
                let patch = numbers.get(ray.patch as usize).copied().unwrap_or(NO_PATCH);
                GatheredRay { patch, ..ray }
            });
            gathering.rays.extend(renumbered);
            gathering.emitted.extend(emitted);
        }
        let mut occlusion = self.patches.find_points(world);
        // Hits in cells whose surface no point stands for are sorted into smaller cells, and at last stand for themselves.
        for in_cells in [true, false] {
            let homeless: Vec<(usize, SurfacePoint)> = gathering.rays[first..]
                .par_iter()
                .zip(hits)
                .enumerate()
                .filter_map(|(number, (ray, hit))| {
                    let hit = hit.as_ref().filter(|_| !self.patches.has_point(ray.patch))?;
                    let x = points[number / directions];
                    let direction = rotation_at(x) * self.directions[number % directions];
                    Some((first + number, scene.interaction(hit, direction).point))
                })
                .collect();
            for (number, surface) in homeless {
                let width = SMALLER_PATCH * width(&surface);
                gathering.rays[number].patch = if in_cells {
                    self.patches.number(PatchCell::of(&surface, width))
                } else {
                    self.patches.number_of_point(surface, width)
                };
            }
            occlusion += self.patches.find_points(world);
        }
        occlusion
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
