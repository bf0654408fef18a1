//! The indirect light mesh (ILM): what mesh points receive from surfaces, eqs. (4) and (5).
//!
//! From every mesh point N rays go out, one through each part of a partition of the sphere. What a hit surface sends back
//! is Emiss + k_d·I from the direct light mesh, plus k_d·Ĩ_d from this mesh's previous iteration where there are
//! several bounces. Points that such hits need are evaluated the same lazy way, until nothing is missing.

use std::f32::consts::PI;

use glam::Vec3;
use rayon::prelude::*;

use super::emitters::Emitters;
use super::estimator::{DirectMesh, Scratch};
use super::leaks::{amounts_differ, is_inside_by_share};
use super::neighbours::Neighbours;
use super::normal_table::{self, NormalSums, NormalWeights};
use super::patches::Patches;
use super::points::{AUTO_SPACINGS, MeshError, MeshPoints};
use super::sphere::{SphereStrata, noise};
use super::store::{NeededPoints, PointMask};
use crate::accel::{Accel, Coherence, LaneMask, PacketLanes, RayHitPacket, RayPacket, hit_of_lane};
use crate::scene::{Hit, Interaction, Ray, Scene, SurfacePoint};
use crate::settings::{IndirectForm, IndirectSettings, Leaks, Normalization};

/// Rays that an evaluation traced.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct IndirectRays {
    /// Rays from indirect mesh points.
    pub indirect: u64,
    /// Occlusion rays from direct mesh points that the hits needed.
    pub shadow: u64,
}

/// Indirect light mesh.
pub struct IndirectMesh {
    /// The mesh points.
    pub points: MeshPoints,
    strata: SphereStrata,
    settings: IndirectSettings,
    emitters: Emitters,
    /// IndirectLight by slot, [`IndirectMesh::entries`] each, as means over directions; the first is that of all light.
    values: Vec<[f32; 3]>,
    /// Points inside of geometry, by slot.
    inside: Vec<bool>,
}

/// New mesh points with what their rays hit: N entries per point.
#[derive(Default)]
struct Gathering {
    points: Vec<Vec3>,
    hits: Vec<Option<Hit>>,
}

/// Mesh points per parallel task: with N = 256 some hundred microseconds of rays.
const POINTS_PER_TASK: usize = 4;

impl IndirectMesh {
    /// Mesh over a scene, with no point known.
    pub fn new(scene: &Scene, settings: &IndirectSettings) -> Result<Self, MeshError> {
        Ok(Self {
            points: MeshPoints::with_auto_spacing(
                scene.bounds(),
                &settings.points,
                AUTO_SPACINGS / IndirectSettings::COARSENESS,
            )?,
            strata: SphereStrata::new(settings.directions),
            emitters: if settings.emitter_samples > 0 {
                Emitters::of_scene(scene)
            } else {
                Emitters::default()
            },
            settings: settings.clone(),
            values: Vec::new(),
            inside: Vec::new(),
        })
    }

    /// RGB values per mesh point.
    fn entries(&self) -> usize {
        match self.settings.form {
            IndirectForm::Scalar => 1,
            IndirectForm::Directional => normal_table::ENTRIES,
        }
    }

    /// Evaluates those of the needed points that are unknown, and all that they depend on; direct mesh points at the
    /// hits are evaluated on the way.
    ///
    /// `direct_scale` multiplies the direct mesh's I(y).
    pub fn evaluate<A: Accel>(
        &mut self,
        accel: &A,
        scene: &Scene,
        direct: &mut DirectMesh,
        direct_scale: f32,
        needed: PointMask,
    ) -> IndirectRays {
        let mut rays = IndirectRays::default();
        let mut gathering = Gathering::default();
        let mut needed = needed;
        loop {
            let new = self.points.claim(&needed);
            if new.is_empty() {
                break;
            }
            let hits = self.trace(accel, &new);
            if self.points.leaks() == Leaks::Invalidate {
                let seen = new.par_iter().zip(hits.par_chunks(self.strata.len() as usize));
                let inside: Vec<bool> = seen
                    .map(|(&x, hits)| {
                        let mut backs = 0;
                        self.for_each_hit(scene, x, hits, |_, _, surface| {
                            backs += usize::from(surface.is_some_and(|surface| surface.shows_back()));
                        });
                        is_inside_by_share(backs, hits.len())
                    })
                    .collect();
                self.inside.extend(inside);
            }
            rays.indirect += hits.len() as u64;
            rays.shadow += direct.evaluate(accel, scene, &self.needed_at(scene, &new, &hits, &direct.points));
            needed = if self.settings.bounces > 1 {
                self.needed_at(scene, &new, &hits, &self.points)
            } else {
                PointMask::default()
            };
            gathering.points.extend(new);
            gathering.hits.extend(hits);
        }
        if !gathering.points.is_empty() {
            rays.shadow += self.solve(accel, scene, direct, direct_scale, &gathering);
        }
        rays
    }

    /// What each of the points sees in each of its directions.
    fn trace<A: Accel>(&self, accel: &A, points: &[Vec3]) -> Vec<Option<Hit>> {
        const WIDTH: usize = 16;
        let directions = self.strata.len() as usize;
        let mut hits = vec![None; points.len() * directions];
        hits.par_chunks_mut(directions * POINTS_PER_TASK)
            .zip(points.par_chunks(POINTS_PER_TASK))
            .with_max_len(1)
            .for_each(|(hits, points)| {
                for (hits, &x) in hits.chunks_mut(directions).zip(points) {
                    for (group, hits) in hits.chunks_mut(WIDTH).enumerate() {
                        let mut packet = RayHitPacket::<WIDTH>::empty();
                        for lane in 0..hits.len() {
                            let direction = self.strata.jittered((group * WIDTH + lane) as u32, x);
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
    fn for_each_hit(
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

    /// The points of `mesh` that lie in the neighbourhoods of the hits.
    fn needed_at(
        &self,
        scene: &Scene,
        points: &[Vec3],
        hits: &[Option<Hit>],
        mesh: &MeshPoints,
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
                            mesh.neighbours(&surface.point, &mut neighbours);
                            neighbours.ids().iter().for_each(|&id| needed.insert(id));
                        }
                    });
                }
                needed.into_bricks().collect()
            })
            .collect();
        PointMask::union(parts.into_iter().flatten())
    }

    /// Eq. (4) for new points: one bounce, then as many more as asked for or until nothing changes any more.
    /// Returns the number of occlusion rays that it took to see emitters and to keep light from leaking.
    fn solve<A: Accel>(
        &mut self,
        accel: &A,
        scene: &Scene,
        direct: &DirectMesh,
        direct_scale: f32,
        gathering: &Gathering,
    ) -> u64 {
        let first = self.values.len();
        let directions = self.strata.len() as usize;
        let (one_bounce, mut rays) = self.sweep(gathering, |point, sums, scratch| {
            let (x, hits) = (gathering.points[point], &gathering.hits[point * directions..][..directions]);
            self.for_each_hit(scene, x, hits, |cell, direction, surface| {
                let light = surface.map_or(scene.background, |surface| {
                    let illumination = direct.illumination(accel, &surface.point, scratch) * direct_scale;
                    let share = match &hits[cell] {
                        Some(hit) if surface.emission != Vec3::ZERO => {
                            self.share_of_directions(self.emitters.density(scene, x, hit, &surface.point))
                        }
                        _ => 1.0,
                    };
                    surface.emission * share + surface.diffuse * illumination
                });
                self.accumulate(sums, direction, light);
            });
            scratch.rays += self.add_emitters(accel, scene, x, sums);
        });
        self.values.extend_from_slice(&one_bounce);
        if self.settings.bounces == 1 {
            return rays;
        }
        // A quarter of R: a fraction of what the mean over D_y blurs.
        let width = |surface: &SurfacePoint| 0.25 * self.points.radius_at(surface.position);
        let patches = Patches::new(gathering.hits.len(), width, |hit| {
            let x = gathering.points[hit / directions];
            let direction = self.strata.jittered((hit % directions) as u32, x);
            gathering.hits[hit].as_ref().map(|hit| scene.interaction(hit, direction))
        });
        let peak =
            |values: &[[f32; 3]]| values.as_flattened().iter().fold(0.0f32, |peak, v| peak.max(v.abs()));
        for _ in 1..self.settings.bounces {
            let (radiance, traced): (Vec<Vec3>, Vec<u64>) = patches
                .surfaces
                .par_iter()
                .map_init(Scratch::default, |scratch, (surface, diffuse)| {
                    scratch.rays = 0;
                    (*diffuse * self.illumination(accel, surface, scratch), scratch.rays)
                })
                .unzip();
            rays += traced.iter().sum::<u64>();
            let (mut next, _) = self.sweep(gathering, |point, sums, _| {
                let x = gathering.points[point];
                for cell in 0..directions {
                    if let Some(patch) = patches.of(point * directions + cell) {
                        self.accumulate(sums, self.strata.jittered(cell as u32, x), radiance[patch]);
                    }
                }
            });
            let flat = next.as_flattened_mut();
            flat.iter_mut().zip(one_bounce.as_flattened()).for_each(|(value, first)| *value += first);
            let change = flat
                .iter()
                .zip(self.values[first..].as_flattened())
                .fold(0.0f32, |change, (next, value)| change.max((next - value).abs()));
            let done = change <= self.settings.tolerance * peak(&next);
            self.values[first..].copy_from_slice(&next);
            if done {
                break;
            }
        }
        rays
    }

    /// Share of the directions of eq. (4) in all rays that could find a point on an emitter, the other ones being chosen
    /// with a density of `density` each.
    #[inline(always)]
    fn share_of_directions(&self, density: f32) -> f32 {
        let ours = self.strata.len() as f32 / (4.0 * PI);
        ours / (ours + self.settings.emitter_samples as f32 * density)
    }

    /// Adds the light of emitters that the mesh point at `x` looks to; returns the number of rays.
    #[inline(always)]
    fn add_emitters<A: Accel>(&self, accel: &A, scene: &Scene, x: Vec3, sums: &mut NormalSums) -> u64 {
        if self.emitters.is_empty() {
            return 0;
        }
        const WIDTH: u32 = 16;
        let count = self.settings.emitter_samples;
        let noise = noise(x);
        let mut rays = 0;
        for first in (0..count).step_by(WIDTH as usize) {
            let mut packet = RayPacket::<{ WIDTH as usize }>::empty();
            let mut active: LaneMask = 0;
            let mut found = [(Vec3::ZERO, Vec3::ZERO); WIDTH as usize];
            for (lane, k) in (first..count.min(first + WIDTH)).enumerate() {
                if let Some(sample) = self.emitters.sample(scene, x, k, count, noise) {
                    packet.set_lane(lane, &Ray::between(x, sample.surface.ray_origin()));
                    active |= 1 << lane;
                    let light = sample.emission * self.share_of_directions(sample.density);
                    found[lane] = (sample.direction, light);
                }
            }
            rays += u64::from(active.count_ones());
            let blocked = accel.occluded_packet(active, &mut packet, Coherence::Incoherent);
            for (lane, &(direction, light)) in found.iter().enumerate() {
                if (active & !blocked) >> lane & 1 == 1 {
                    self.accumulate(sums, direction, light);
                }
            }
        }
        rays
    }

    /// Calls `gather(point, sums, scratch)` for all points and returns the values that the sums make, and the rays that
    /// scratch counted.
    fn sweep(
        &self,
        gathering: &Gathering,
        gather: impl Fn(usize, &mut NormalSums, &mut Scratch) + Sync,
    ) -> (Vec<[f32; 3]>, u64) {
        let entries = self.entries();
        let directions = self.strata.len() as f32;
        let mut values = vec![[0.0f32; 3]; gathering.points.len() * entries];
        let rays = values
            .par_chunks_mut(entries)
            .enumerate()
            .with_max_len(POINTS_PER_TASK)
            .map_init(NormalSums::default, |sums, (point, values)| {
                sums.clear();
                let mut scratch = Scratch::default();
                gather(point, sums, &mut scratch);
                sums.write_means(directions, values);
                scratch.rays
            })
            .sum();
        (values, rays)
    }

    /// Adds light from one direction to a point's sums.
    #[inline(always)]
    fn accumulate(&self, sums: &mut NormalSums, direction: Vec3, light: Vec3) {
        sums.add(direction, light, self.settings.form == IndirectForm::Directional);
    }

    /// Ĩ_d of eq. (5) at a surface point, all of whose D_y must be known; with the mean normalization it is the
    /// radiance that an all-white surface would send back.
    #[inline(always)]
    pub fn illumination<A: Accel>(&self, accel: &A, surface: &SurfacePoint, scratch: &mut Scratch) -> Vec3 {
        scratch.find(accel, &self.points, surface, &self.inside, |slots| self.disagree(slots));
        let points = &mut scratch.points;
        if self.settings.at_surface {
            let (y, normal) = (surface.position, surface.geometric_normal);
            points.extrapolate_to_surface(|id| normal.dot(self.points.position(id) - y));
        }
        let points = &*points;
        let mut sum = Vec3::ZERO;
        match self.settings.form {
            IndirectForm::Scalar => {
                for (slot, weight) in points.iter() {
                    sum += Vec3::from_array(self.value(slot)[0]) * weight;
                }
            }
            IndirectForm::Directional => {
                let by_normal = NormalWeights::of(surface.shading_normal);
                for (slot, weight) in points.iter() {
                    sum += by_normal.apply(self.value(slot)) * weight;
                }
            }
        }
        let scale = match self.settings.normalization {
            Normalization::Mean => 1.0 / points.total_weight(),
            Normalization::Integral => 4.0 * PI / points.total_weight(),
        };
        // The mean and far points may enter with weights below 0, so that a single lamp may leave a trace of darkness behind it.
        sum.max(Vec3::ZERO) * scale
    }

    #[inline(always)]
    fn value(&self, slot: u32) -> &[[f32; 3]] {
        let entries = self.entries();
        &self.values[slot as usize * entries..][..entries]
    }

    /// Whether the points see so different amounts of light that a wall may stand between them.
    #[inline(always)]
    fn disagree(&self, slots: &[u32]) -> bool {
        amounts_differ(slots.iter().map(|&slot| self.value(slot)[0].iter().sum()))
    }

    /// Bytes held by slots and values.
    pub fn memory_bytes(&self) -> usize {
        self.points.memory_bytes() + self.values.capacity() * size_of::<[f32; 3]>()
    }
}
