//! The indirect light mesh (ILM): what mesh points receive from surfaces, eqs. (4) and (5).
//!
//! From every mesh point N rays go out, one through each part of a partition of the sphere. What a hit surface sends back
//! is Emiss + k_d·I from the direct light mesh, plus k_d·Ĩ_d from this mesh's previous iteration where there are
//! several bounces. Points that such hits need are evaluated the same lazy way, until nothing is missing.

use glam::Vec3;
use rayon::prelude::*;

use super::directional::{self, COEFFICIENTS};
use super::estimator::{DirectMesh, Scratch};
use super::leaks::{amounts_differ, is_inside_by_share};
use super::neighbours::Neighbours;
use super::points::{MeshError, MeshPoints};
use super::sphere::SphereStrata;
use super::store::{NeededPoints, PointMask};
use crate::accel::{Accel, Coherence, Hit, PacketLanes, Ray, RayHitPacket, hit_of_lane};
use crate::scene::{Scene, SurfacePoint};
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
    /// IndirectLight by slot, [`IndirectMesh::stride`] numbers each, as means over directions.
    values: Vec<f32>,
    /// Mean light from all around by slot, summed over the channels.
    amounts: Vec<f32>,
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
            points: MeshPoints::new(scene.bounds(), &settings.points)?,
            strata: SphereStrata::new(settings.directions),
            settings: settings.clone(),
            values: Vec::new(),
            amounts: Vec::new(),
            inside: Vec::new(),
        })
    }

    /// Numbers per mesh point.
    fn stride(&self) -> usize {
        match self.settings.form {
            IndirectForm::Scalar => 3,
            IndirectForm::Directional => directional::STRIDE,
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
                        self.for_each_hit(scene, x, hits, |_, surface| {
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
        hits.par_chunks_mut(directions * POINTS_PER_TASK).zip(points.par_chunks(POINTS_PER_TASK)).for_each(
            |(hits, points)| {
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
            },
        );
        hits
    }

    /// Calls `each(direction, surface)` for a mesh point's directions; `None` where a ray left the scene.
    #[inline(always)]
    fn for_each_hit(
        &self,
        scene: &Scene,
        x: Vec3,
        hits: &[Option<Hit>],
        mut each: impl FnMut(Vec3, Option<SurfacePoint>),
    ) {
        for (cell, hit) in hits.iter().enumerate() {
            let direction = self.strata.jittered(cell as u32, x);
            each(direction, hit.as_ref().map(|hit| scene.surface_point(hit, direction)));
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
            .map(|(points, hits)| {
                let mut needed = NeededPoints::default();
                let mut neighbours = Neighbours::default();
                for (&x, hits) in points.iter().zip(hits.chunks(directions)) {
                    self.for_each_hit(scene, x, hits, |_, surface| {
                        if let Some(surface) = surface {
                            mesh.neighbours(&surface, &mut neighbours);
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
    /// Returns the number of occlusion rays that it took to keep light from leaking.
    fn solve<A: Accel>(
        &mut self,
        accel: &A,
        scene: &Scene,
        direct: &DirectMesh,
        direct_scale: f32,
        gathering: &Gathering,
    ) -> u64 {
        let first = self.values.len();
        let (one_bounce, mut rays) = self.sweep(scene, gathering, scene.background, |surface, scratch| {
            let illumination = direct.illumination(accel, surface, scratch) * direct_scale;
            surface.emission + surface.diffuse * illumination
        });
        self.values.extend_from_slice(&one_bounce);
        self.amounts.resize(first / self.stride() + gathering.points.len(), 0.0);
        self.measure(gathering.points.len());
        let peak = |values: &[f32]| values.iter().fold(0.0f32, |peak, v| peak.max(v.abs()));
        for _ in 1..self.settings.bounces {
            let (mut next, more) = self.sweep(scene, gathering, Vec3::ZERO, |surface, scratch| {
                surface.diffuse * self.illumination(accel, surface, scratch)
            });
            rays += more;
            next.iter_mut().zip(&one_bounce).for_each(|(value, first)| *value += first);
            let change = next
                .iter()
                .zip(&self.values[first..])
                .fold(0.0f32, |change, (next, value)| change.max((next - value).abs()));
            let done = change <= self.settings.tolerance * peak(&next);
            self.values[first..].copy_from_slice(&next);
            self.measure(gathering.points.len());
            if done {
                break;
            }
        }
        rays
    }

    /// Mean over the directions of the radiance that surfaces send back, or of `background` where there is none.
    fn sweep(
        &self,
        scene: &Scene,
        gathering: &Gathering,
        background: Vec3,
        radiance: impl Fn(&SurfacePoint, &mut Scratch) -> Vec3 + Sync,
    ) -> (Vec<f32>, u64) {
        let stride = self.stride();
        let directions = self.strata.len() as usize;
        let mut values = vec![0.0f32; gathering.points.len() * stride];
        let rays = values
            .par_chunks_mut(stride)
            .zip(gathering.hits.par_chunks(directions))
            .zip(&gathering.points)
            .map(|((value, hits), &x)| {
                pulp::Arch::new().dispatch(|| {
                    let mut scratch = Scratch::default();
                    let mut sums = [0.0f32; directional::STRIDE];
                    self.for_each_hit(scene, x, hits, |direction, surface| {
                        let light = match &surface {
                            Some(surface) => radiance(surface, &mut scratch),
                            None => background,
                        };
                        self.accumulate(&mut sums, direction, light);
                    });
                    let scale = 1.0 / directions as f32;
                    for (value, sum) in value.iter_mut().zip(&sums) {
                        *value = sum * scale;
                    }
                    scratch.rays
                })
            })
            .sum();
        (values, rays)
    }

    /// Brings the amounts of the last `count` points up to date.
    fn measure(&mut self, count: usize) {
        let first = self.amounts.len() - count;
        for slot in first..self.amounts.len() {
            let value = self.value(slot as u32);
            self.amounts[slot] = match self.settings.form {
                IndirectForm::Scalar => value.iter().sum(),
                IndirectForm::Directional => directional::amount(value),
            };
        }
    }

    /// Adds light from one direction to a point's numbers.
    #[inline(always)]
    fn accumulate(&self, sums: &mut [f32; directional::STRIDE], direction: Vec3, light: Vec3) {
        match self.settings.form {
            IndirectForm::Scalar => {
                for (sum, light) in sums.iter_mut().zip(light.to_array()) {
                    *sum += light;
                }
            }
            IndirectForm::Directional => {
                // Irradiance over π is (1/π)∫ L cos dω; as a mean over the sphere that is 4 · mean of L·cos.
                let lobe = directional::cosine_lobe(direction.to_array());
                for (channel, light) in light.to_array().into_iter().enumerate() {
                    for (sum, coefficient) in sums[channel * COEFFICIENTS..].iter_mut().zip(lobe) {
                        *sum += 4.0 * light * coefficient;
                    }
                }
            }
        }
    }

    /// Ĩ_d of eq. (5) at a surface point, all of whose D_y must be known; with the mean normalization it is the
    /// radiance that an all-white surface would send back.
    #[inline(always)]
    pub fn illumination<A: Accel>(&self, accel: &A, surface: &SurfacePoint, scratch: &mut Scratch) -> Vec3 {
        scratch.find(accel, &self.points, surface, &self.inside, |slots| self.disagree(slots));
        let mut sums = [0.0f32; directional::STRIDE];
        let total = scratch.points.total_weight();
        for (slot, weight) in scratch.points.iter() {
            for (sum, value) in sums.iter_mut().zip(self.value(slot)) {
                *sum += weight * value;
            }
        }
        let mean = match self.settings.form {
            IndirectForm::Scalar => Vec3::new(sums[0], sums[1], sums[2]),
            IndirectForm::Directional => directional::irradiance(&sums, surface.shading_normal),
        };
        let scale = match self.settings.normalization {
            Normalization::Mean => 1.0 / total,
            Normalization::Integral => 4.0 * std::f32::consts::PI / total,
        };
        mean * scale
    }

    #[inline(always)]
    fn value(&self, slot: u32) -> &[f32] {
        let stride = self.stride();
        &self.values[slot as usize * stride..][..stride]
    }

    /// Whether the points see so different amounts of light that a wall may stand between them.
    #[inline(always)]
    fn disagree(&self, slots: &[u32]) -> bool {
        amounts_differ(slots.iter().map(|&slot| self.amounts[slot as usize]))
    }

    /// Bytes held by slots and values.
    pub fn memory_bytes(&self) -> usize {
        self.points.memory_bytes() + self.values.capacity() * size_of::<f32>()
    }
}
