//! Light of surfaces and of the background at a probe: rays in many directions, which end at surfaces whose light points of a surface mesh
//! know (method §5).

use std::f32::consts::PI;

use glam::Vec3;
use pulp::NullaryFnOnce;
use rayon::prelude::*;

use super::sensor::Values;
use super::station::Station;
use crate::accel::{Accel, Coherence, LaneMask, PacketLanes, RayHitPacket, hit_of_lane};
use crate::light_mesh::MeshError;
use crate::light_mesh::direct_light::{Candidate, DirectLight, Square};
use crate::light_mesh::surface::{SurfaceMesh, SurfaceView};
use crate::render::surface_width;
use crate::sampling::hash_to_unit_cube;
use crate::scene::{Interaction, PixelFootprint, Ray, SurfacePoint};
use crate::settings::{IndirectForm, IndirectSettings, Settings, Spacing};
use crate::simd::{LANES, vectorize};
use crate::world::World;

/// Rays that are traced before where they end is asked about: their ends take 80 bytes each.
const RAYS_PER_BATCH: usize = 1 << 20;

/// Light of surfaces, as probes gather it.
pub struct Gather<'a, A> {
    world: World<'a, A>,
    /// Light that surfaces receive from each other, if any that comes by it counts.
    mesh: Option<SurfaceMesh>,
    /// What direct light is multiplied by before k_d.
    scale: f32,
    directions: u32,
}

/// Where a ray of a probe ended.
struct End {
    /// Its number among the probe's.
    ray: u32,
    seen: Interaction,
    distance: f32,
}

impl<'a, A: Accel> Gather<'a, A> {
    /// Evaluates what probes in these places will see of the light that surfaces receive from each other.
    ///
    /// # Errors
    /// [`MeshError`].
    pub fn new(
        world: World<'a, A>,
        settings: &Settings,
        indirect: &IndirectSettings,
        directions: u32,
        stations: &[Station],
    ) -> Result<Self, MeshError> {
        let scale = settings.shading.direct_scale();
        let mut gather = Self { world, mesh: None, scale, directions };
        // The way to the probe is one of the bounces.
        let Some(bounces) = indirect
            .bounces
            .checked_sub(1)
            .filter(|&bounces| bounces > 0 && world.scene.triangle_count() > 0)
        else {
            return Ok(gather);
        };
        let mut indirect = IndirectSettings { bounces, ..indirect.clone() };
        if indirect.form != IndirectForm::Surface {
            // The spacing is that of points in free space.
            indirect.points.spacing = Spacing::Auto;
        }
        let bounds = world.scene.bounds();
        let mut mesh = SurfaceMesh::new(&indirect, surface_width(&indirect, bounds)?, scale);
        // A view from so far away that no cell of the mesh is too wide for it.
        let eye = bounds.center() + Vec3::splat(1e3 * bounds.extent().length());
        mesh.turn_to(SurfaceView { footprint: PixelFootprint { eye, edge: 1.0 }, height: 1 });
        let probes_per_batch = (RAYS_PER_BATCH / directions.max(1) as usize).max(1);
        for batch in stations.chunks(probes_per_batch) {
            let surfaces: Vec<Vec<SurfacePoint>> =
                batch.par_iter().map(|station| vectorize(Look { gather: &gather, station })).collect();
            mesh.need(world, surfaces.iter().map(|of_probe| of_probe.iter().collect()).collect());
        }
        mesh.evaluate(world);
        gather.mesh = Some(mesh);
        Ok(gather)
    }

    /// Adds what a probe sees.
    pub fn add(&self, station: &Station, values: &mut Values) {
        vectorize(MeasureGathered { gather: self, station, values });
    }
}

/// Finding where the rays of a probe end, as work for the best instruction set: those at surfaces that reflect light diffusely.
struct Look<'a, A> {
    gather: &'a Gather<'a, A>,
    station: &'a Station,
}

impl<A: Accel> NullaryFnOnce for Look<'_, A> {
    type Output = Vec<SurfacePoint>;

    #[inline(always)]
    fn call(self) -> Vec<SurfacePoint> {
        let ends = look(self.gather, self.station, |_, _, _| {});
        ends.iter().map(|end| end.seen.point).collect()
    }
}

/// Traces the rays of a probe; passes direction, solid angle and emitted light on of those that bring any.
#[inline(always)]
fn look<A: Accel>(
    gather: &Gather<A>,
    station: &Station,
    mut emitted: impl FnMut(Vec3, f32, Vec3),
) -> Vec<End> {
    let World { accel, scene, .. } = gather.world;
    let directions = station.sensor.directions(station.position, gather.directions);
    let mut ends = Vec::new();
    for first in (0..gather.directions).step_by(LANES) {
        let count = (gather.directions - first).min(LANES as u32) as usize;
        let mut packet = RayHitPacket::<LANES>::empty();
        let mut ways = [(Vec3::ZERO, 0.0); LANES];
        for (lane, way) in ways.iter_mut().enumerate().take(count) {
            *way = directions.at(first + lane as u32);
            packet.set_lane(lane, &Ray::new(station.origin, way.0));
        }
        let active = ((1u64 << count) - 1) as LaneMask;
        accel.intersect_packet(active, &mut packet, Coherence::Incoherent);
        for (lane, &(direction, solid_angle)) in ways.iter().enumerate().take(count) {
            let Some(hit) = hit_of_lane(&packet, lane) else {
                emitted(direction, solid_angle, scene.background);
                continue;
            };
            let seen = scene.interaction(&hit, direction);
            if gather.world.gathers(&seen) {
                emitted(direction, solid_angle, seen.emission);
            }
            if seen.diffuse != Vec3::ZERO {
                ends.push(End { ray: first + lane as u32, seen, distance: hit.t });
            }
        }
    }
    ends
}

/// Measuring what a probe sees, as work for the best instruction set.
struct MeasureGathered<'a, A> {
    gather: &'a Gather<'a, A>,
    station: &'a Station,
    values: &'a mut Values,
}

/// Multiples of it, modulo 1, lie as evenly as any sequence of numbers can.
const GOLDEN: f32 = 0.618_034;

impl<A: Accel> NullaryFnOnce for MeasureGathered<'_, A> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { gather, station, values } = self;
        let sensor = &station.sensor;
        let ends = look(gather, station, |direction, solid_angle, light| {
            sensor.add(values, direction, light * solid_angle);
        });
        let surfaces: Vec<SurfacePoint> = ends.iter().map(|end| end.seen.point).collect();
        let mut received = vec![Vec3::ZERO; ends.len()];
        if let Some(mesh) = &gather.mesh {
            mesh.illuminate(gather.world.accel, surfaces.iter(), 1.0, &mut received);
        }
        let directions = sensor.directions(station.position, gather.directions);
        let shift = hash_to_unit_cube(station.position).z;
        let mut scratch = DirectLight::default();
        for (end, received) in ends.iter().zip(received) {
            let number = (shift + GOLDEN * end.ray as f32).fract();
            let direct = gather.direct_light(end, number, &mut scratch);
            let (direction, solid_angle) = directions.at(end.ray);
            let radiance = end.seen.diffuse * (direct * gather.scale + received);
            sensor.add(values, direction, radiance * solid_angle);
        }
    }
}

impl<A: Accel> Gather<'_, A> {
    /// I where a ray ended, from one light that a number in [0, 1) chooses: over even numbers the mean is that of all lights.
    #[inline(always)]
    fn direct_light(&self, end: &End, number: f32, scratch: &mut DirectLight) -> Vec3 {
        let World { accel, lights, .. } = self.world;
        let surface = &end.seen.point;
        // The ray stands for a part of the surface.
        let square = Square::new(lights, end.distance * (4.0 * PI / self.directions as f32).sqrt());
        let Some(Candidate { light, weight }) = scratch.choose(lights, surface, square, number) else {
            return Vec3::ZERO;
        };
        let (index, lane) = (light as usize / LANES, light as usize % LANES);
        let origin = surface.ray_origin();
        let way = Vec3::from_array(lights.chunks()[index].way(lane, origin.to_array(), origin, 0));
        let lifted = square.factor(&lights.chunks()[index], lane, surface);
        let factor = lights.factor(index, lane, surface) * weight * lifted;
        let offered = Vec3::from_array(lights.intensity(index, lane)) * factor;
        let ray = Ray { t_far: 1.0, ..Ray::new(origin, way) };
        // What no number can hold, next to a light of enormous intensity, is left out.
        if factor <= 0.0 || !offered.is_finite() || accel.occluded(&ray) { Vec3::ZERO } else { offered }
    }
}
