//! Evaluation of mesh points against a loop that only traces the same rays.

use glam::Vec3;
use rayon::prelude::*;

use super::report::{Aim, Goal, Report, Table};
use super::setup::{PAPER_LIGHTS, PAPER_TRIANGLES, forest, new_report};
use super::timing::timed;
use super::{BenchError, BenchOptions};
use crate::accel::{Accel, Backend, Coherence, PacketLanes, RayPacket, with_accel};
use crate::light_mesh::direct::{Basis, DirectField, DirectMesh};
use crate::light_mesh::points::AutoSpacing;
use crate::lights::{EmissiveTriangles, PackedLights};
use crate::render::RenderError;
use crate::scene::{Light, Ray, Scene, SurfacePoint};
use crate::settings::{Estimator, KernelSettings, Neighbourhood, PointSettings, Radius, Spacing};
use crate::simd::LANES;
use crate::world::World;

/// Spacing of the mesh points, scene units.
const SPACING: f32 = 0.5;

/// Share of the bare loop's speed that evaluation is to reach.
const GOAL: f64 = 0.9;

/// Runs the comparison.
pub fn run(options: &BenchOptions, log: &dyn Fn(&str)) -> Result<Report, BenchError> {
    let (triangles, lights, count) =
        if options.quick { (2_000, 20, 512) } else { (PAPER_TRIANGLES, PAPER_LIGHTS, 25_600) };
    let setup = forest(triangles, lights)?;
    let backend = Backend::build(options.backend, &setup.scene)?.backend;
    let mut report = new_report("rays", backend.to_string(), options);
    let table = PackedLights::of_scene(&setup.scene);
    let points = mesh_points(&setup.scene, &backend, &table, count)?;
    let rays = points.len() * table.len();
    log(&format!("{} mesh points, {} lights, {rays} rays", points.len(), table.len()));

    let variants = [Basis::Bits, Basis::Light, Basis::Irradiance];
    let times = with_accel!(&backend, accel => {
        options.budget().alternate(variants.len() + 3, |variant| {
            let (seconds, _) = match variants.get(variant) {
                Some(&basis) => {
                    let mut field = DirectField::default();
                    timed(|| {
                        let rays = field.trace(accel, &table, &points);
                        field.derive(&table, basis, &points);
                        rays
                    })
                }
                None if variant == variants.len() => {
                    timed(|| points_to_one_light(accel, &points, &setup.scene.lights, Coherence::Incoherent))
                }
                None if variant == variants.len() + 1 => {
                    timed(|| points_to_one_light(accel, &points, &setup.scene.lights, Coherence::Coherent))
                }
                None => timed(|| one_point_to_lights(accel, &points, &setup.scene.lights)),
            };
            Ok::<_, BenchError>(seconds)
        })
    })?;

    let names = [
        "evaluate, visibility bits",
        "evaluate, DirectLight (scalar)",
        "evaluate, DirectLight (directional)",
        "bare: 16 points towards one light",
        "bare: 16 points towards one light, as one",
        "bare: one point towards 16 lights",
    ];
    let medians: Vec<f64> =
        names.iter().zip(times).map(|(name, seconds)| report.record(*name, seconds)).collect();
    let bare = medians[variants.len()..].iter().copied().fold(f64::INFINITY, f64::min);
    let mut summary = Table::new(
        format!("{rays} occlusion rays from {} mesh points", points.len()),
        &["", "seconds", "Mray/s", "of the faster bare loop"],
    );
    for (name, median) in names.iter().zip(&medians) {
        summary.rows.push(vec![
            (*name).to_owned(),
            format!("{median:.4}"),
            format!("{:.2}", rays as f64 / median / 1e6),
            format!("{:.1} %", 100.0 * bare / median),
        ]);
    }
    report.tables.push(summary);
    for (name, median) in names.iter().zip(&medians).take(variants.len()) {
        report.goals.push(Goal::new(
            format!("{name}: share of the bare loop"),
            bare / median,
            Aim::AtLeast,
            GOAL,
        ));
    }
    Ok(report)
}

/// About `count` mesh points around the middle of the scene, in the order in which rendering evaluates them.
fn mesh_points(
    scene: &Scene,
    backend: &Backend,
    lights: &PackedLights,
    count: u32,
) -> Result<Vec<Vec3>, BenchError> {
    let points = PointSettings { spacing: Spacing::Units(Vec3::splat(SPACING)), ..PointSettings::default() };
    let kernel = KernelSettings {
        // The ball that holds as many cubes of one spacing.
        radius: Radius::Spacings((0.75 * count as f32 / std::f32::consts::PI).cbrt()),
        neighbourhood: Neighbourhood::Sphere,
        hemisphere: false,
        ..KernelSettings::default()
    };
    let mut mesh = DirectMesh::new(scene.bounds());
    let shading = mesh
        .interpolation(&points, &kernel, Estimator::PerLight, AutoSpacing::AVERAGED)
        .map_err(RenderError::from)?;
    let middle = SurfacePoint::flat(scene.bounds().center(), Vec3::Y);
    let needed = mesh.view(lights, &shading).lookup.needed_anywhere([middle].iter());
    let emissive = EmissiveTriangles::default();
    mesh.evaluate(World { accel: backend, scene, lights, emissive: &emissive }, &shading, &needed);
    Ok(mesh.store().positions().to_vec())
}

/// Traces from packets of neighbouring points towards one light after the other; returns the blocked rays.
fn points_to_one_light<A: Accel>(accel: &A, points: &[Vec3], lights: &[Light], coherence: Coherence) -> u64 {
    let group = |points: &[Vec3]| {
        let mut blocked = 0;
        let active = ((1u64 << points.len()) - 1) as u32;
        let mut packet = RayPacket::<LANES>::empty();
        for light in lights {
            for (lane, &point) in points.iter().enumerate() {
                packet.set_lane(lane, &Ray::between(point, light.position));
            }
            let lanes = accel.occluded_packet(active, &mut packet, coherence) & active;
            blocked += u64::from(lanes.count_ones());
        }
        blocked
    };
    points.par_chunks(LANES).map(group).sum()
}

/// Traces from each point in packets towards neighbouring lights; returns the blocked rays.
fn one_point_to_lights<A: Accel>(accel: &A, points: &[Vec3], lights: &[Light]) -> u64 {
    let group = |points: &[Vec3]| {
        let mut blocked = 0;
        let mut packet = RayPacket::<LANES>::empty();
        for &point in points {
            for lights in lights.chunks(LANES) {
                let active = ((1u64 << lights.len()) - 1) as u32;
                for (lane, light) in lights.iter().enumerate() {
                    packet.set_lane(lane, &Ray::between(point, light.position));
                }
                let lanes = accel.occluded_packet(active, &mut packet, Coherence::Incoherent) & active;
                blocked += u64::from(lanes.count_ones());
            }
        }
        blocked
    };
    points.par_chunks(LANES).map(group).sum()
}
