//! Solving: eq. (4) for new mesh points, bounce after bounce.

use std::f32::consts::PI;

use glam::Vec3;
use rayon::prelude::*;

use super::gather::{Gathering, POINTS_PER_TASK};
use super::interpolation::{DirectTransport, IndirectInterpolation};
use super::mesh::IndirectMesh;
use super::octahedral::IrradianceSums;
use crate::accel::{Accel, Coherence, LaneMask, PacketLanes, RayPacket};
use crate::light_mesh::direct::DirectMesh;
use crate::light_mesh::lookup::LookupScratch;
use crate::light_mesh::series::Series;
use crate::sampling::{hash_to_unit_cube, rotation_at};
use crate::scene::Ray;
use crate::settings::IndirectForm;
use crate::world::World;

impl IndirectMesh {
    /// Eq. (4) for new points: one bounce, then as many more as the settings allow or until no value changes any more.
    /// Returns the number of occlusion rays that it took to light patches, to see emitters and to keep light from leaking.
    pub(super) fn solve<A: Accel>(
        &mut self,
        world: World<A>,
        direct: &DirectMesh,
        transport: DirectTransport,
        interpolation: &IndirectInterpolation,
        gathering: &Gathering,
    ) -> u64 {
        let World { accel, scene, lights, .. } = world;
        let first = self.values.len();
        let mut rays = 0;
        if !self.looks_up_hits() {
            rays += self.patches.find_direct(world, transport.scale);
        }
        let emitted = |point: usize, sums: &mut IrradianceSums, scratch: &mut LookupScratch| {
            for &(direction, light) in &gathering.emitted[point] {
                self.accumulate(sums, direction, light);
            }
            scratch.rays += self.add_emissive(world, gathering.points[point], sums);
        };
        let (one_bounce, traced) = if self.looks_up_hits() {
            let direct = direct.view(lights, transport.interpolation);
            let directions = self.directions.len();
            self.sweep(gathering, |point, sums, scratch| {
                let (x, hits) =
                    (gathering.points[point], &gathering.hits[point * directions..][..directions]);
                self.for_each_hit(scene, x, hits, |direction, hit| {
                    let light = hit.map_or(scene.background, |(_, surface)| {
                        surface.diffuse
                            * direct.illumination(accel, &surface.point, scratch)
                            * transport.scale
                    });
                    self.accumulate(sums, direction, light);
                });
                emitted(point, sums, scratch);
            })
        } else {
            self.sweep(gathering, |point, sums, scratch| {
                self.add_patches(gathering, point, self.patches.direct(), scene.background, sums);
                emitted(point, sums, scratch);
            })
        };
        rays += traced;
        self.values.extend_from_slice(&one_bounce);
        if self.settings.bounces == 1 {
            return rays;
        }
        let view = self.view(interpolation);
        // Of patches that only earlier points see nothing is asked.
        let mut seen = vec![false; self.patches.len()];
        for ray in &gathering.rays {
            if let Some(seen) = seen.get_mut(ray.patch as usize) {
                *seen = true;
            }
        }
        let stencils = self.patches.map(&seen, |surface| {
            let mut scratch = LookupScratch::default();
            (view.stencil(accel, surface, &mut scratch), scratch.rays)
        });
        rays += stencils.iter().flatten().map(|(_, rays)| rays).sum::<u64>();
        let mut series = Series::default();
        for bounce in 1..self.settings.bounces {
            let view = self.view(interpolation);
            let received: Vec<Vec3> = stencils
                .par_iter()
                .map(|stencil| {
                    stencil.as_ref().map_or(Vec3::ZERO, |(stencil, _)| view.illumination_at(stencil))
                })
                .collect();
            let (mut next, _) = self.sweep(gathering, |point, sums, _| {
                self.add_patches(gathering, point, &received, Vec3::ZERO, sums);
            });
            let flat = next.as_flattened_mut();
            flat.iter_mut().zip(one_bounce.as_flattened()).for_each(|(value, first)| *value += first);
            let values = self.values[first..].as_flattened_mut();
            let remaining = self.settings.bounces - 1 - bounce;
            let done = series.add(values, flat, remaining, self.settings.tolerance);
            values.copy_from_slice(flat);
            if done {
                break;
            }
        }
        rays
    }

    /// Adds what patches send to a point along its rays, given what each patch receives, and the light of where no surface is.
    #[inline(always)]
    fn add_patches(
        &self,
        gathering: &Gathering,
        point: usize,
        received: &[Vec3],
        background: Vec3,
        sums: &mut IrradianceSums,
    ) {
        let rotation = rotation_at(gathering.points[point]);
        let count = self.directions.len();
        let rays = &gathering.rays[point * count..][..count];
        for (&direction, ray) in self.directions.iter().zip(rays) {
            let light = received.get(ray.patch as usize).map_or(background, |light| ray.diffuse() * *light);
            self.accumulate(sums, rotation * direction, light);
        }
    }

    /// MIS weight of rays that could find a point on an emissive triangle: the share of the directions of eq. (4) in the pdf of
    /// all such rays, the others being chosen with a pdf of `pdf` each.
    #[inline(always)]
    pub(super) fn mis_weight(&self, pdf: f32) -> f32 {
        if self.settings.emitter_samples == 0 {
            return 1.0;
        }
        let ours = self.directions.len() as f32 / (4.0 * PI);
        ours / (ours + self.settings.emitter_samples as f32 * pdf)
    }

    /// Adds the light of points on emissive triangles, chosen by their power, that the mesh point at `x` sees; returns the
    /// number of rays.
    #[inline(always)]
    fn add_emissive<A: Accel>(&self, world: World<A>, x: Vec3, sums: &mut IrradianceSums) -> u64 {
        let World { accel, scene, lights, emissive } = world;
        const WIDTH: u32 = 16;
        let count = if lights.has_emitters() { 0 } else { self.settings.emitter_samples };
        let noise = hash_to_unit_cube(x);
        let mut rays = 0;
        for first in (0..count).step_by(WIDTH as usize) {
            let mut packet = RayPacket::<{ WIDTH as usize }>::empty();
            let mut active: LaneMask = 0;
            let mut found = [(Vec3::ZERO, Vec3::ZERO); WIDTH as usize];
            for (lane, k) in (first..count.min(first + WIDTH)).enumerate() {
                if let Some(sample) = emissive.sample(scene, x, k, count, noise) {
                    packet.set_lane(lane, &Ray::between(x, sample.surface.ray_origin()));
                    active |= 1 << lane;
                    let light = sample.emission * self.mis_weight(sample.pdf);
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
        gather: impl Fn(usize, &mut IrradianceSums, &mut LookupScratch) + Sync,
    ) -> (Vec<[f32; 3]>, u64) {
        let entries = self.entries();
        let directions = self.directions.len() as f32;
        let mut values = vec![[0.0f32; 3]; gathering.points.len() * entries];
        let rays = values
            .par_chunks_mut(entries)
            .enumerate()
            .with_max_len(POINTS_PER_TASK)
            .map_init(IrradianceSums::default, |sums, (point, values)| {
                sums.clear();
                let mut scratch = LookupScratch::default();
                gather(point, sums, &mut scratch);
                sums.write_means(directions, values);
                scratch.rays
            })
            .sum();
        (values, rays)
    }

    /// Adds light from one direction to a point's sums.
    #[inline(always)]
    fn accumulate(&self, sums: &mut IrradianceSums, direction: Vec3, light: Vec3) {
        sums.add(direction, light, self.settings.form == IndirectForm::Directional);
    }
}
