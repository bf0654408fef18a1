//! Rays per second of the backends.

use glam::Vec3;
use rayon::prelude::*;

use super::report::{Aim, Goal, Plot, Report, Series, Table};
use super::setup::{PAPER_TRIANGLES, Setup, forest, new_report};
use super::timing::{Samples, timed};
use super::{BenchError, BenchOptions};
use crate::accel::{
    Accel, Backend, BackendChoice, Coherence, PacketLanes, RayHitPacket, RayPacket, hit_of_lane, with_accel,
};
use crate::sampling::SphereStrata;
use crate::sampling::SplitMix64;
use crate::scene::{CameraRays, Ray};

/// Rays of one kind, in an order in which neighbours make good packets.
struct Bundle {
    name: &'static str,
    rays: Vec<Ray>,
    nearest: bool,
    coherence: Coherence,
}

/// Packet widths; 1 stands for queries of single rays.
const WIDTHS: [usize; 4] = [1, 4, 8, 16];

/// What the BVH is to reach of Embree's rate, with single rays and with the best packets.
const GOALS: [(&str, f64); 2] = [("single rays", 0.8), ("best packet", 0.6)];

/// Runs the measurement.
pub fn run(options: &BenchOptions, log: &dyn Fn(&str)) -> Result<Report, BenchError> {
    let sizes: &[u32] = if options.quick { &[2_000] } else { &[PAPER_TRIANGLES, 2_000_000] };
    let mut report = new_report("backends", "embree and bvh".to_owned(), options);
    for &triangles in sizes {
        let setup = forest(triangles, if options.quick { 16 } else { 100 })?;
        let bundles = bundles(&setup, if options.quick { 1 << 10 } else { 1 << 20 });
        let mut contestants = Vec::new();
        for choice in [BackendChoice::Embree, BackendChoice::Bvh] {
            log(&format!("{choice}, {triangles} triangles"));
            contestants.extend(Contestant::build(&setup, choice, options, &mut report, log)?);
        }
        measure(contestants, &bundles, options, &mut report)?;
    }
    Ok(report)
}

/// A backend with the scene built.
struct Contestant {
    /// Backend, version, triangles.
    name: String,
    backend: Backend,
    table: Table,
    plot: Plot,
}

impl Contestant {
    /// Times the build; `None` where Embree is not there.
    fn build(
        setup: &Setup,
        choice: BackendChoice,
        options: &BenchOptions,
        report: &mut Report,
        log: &dyn Fn(&str),
    ) -> Result<Option<Self>, BenchError> {
        let triangles = setup.scene.triangle_count();
        let mut builds = Vec::new();
        let mut built = None;
        for _ in 0..options.repetitions.min(3) {
            drop(built.take());
            let (seconds, chosen) = timed(|| Backend::build(choice, &setup.scene));
            match chosen {
                Ok(chosen) => built = Some(chosen.backend),
                Err(error) if choice == BackendChoice::Embree => {
                    log(&format!("left out: {error}"));
                    return Ok(None);
                }
                Err(error) => return Err(error.into()),
            }
            builds.push(seconds);
        }
        let Some(backend) = built else { return Ok(None) };
        let name = format!("{backend}, {triangles} triangles");
        let build = report.record(format!("{name}: build"), builds);
        let bytes = backend.memory_bytes();
        let title = format!(
            "{name}: Mray/s by packet width; built in {build:.3} s, {:.0} bytes per triangle",
            bytes as f64 / triangles as f64
        );
        let plot = Plot {
            title: format!("Rays per second: {name}"),
            x: "packet width".to_owned(),
            y: "Mray/s".to_owned(),
            series: Vec::new(),
        };
        Ok(Some(Self { name, backend, table: Table::new(title, &["rays", "1", "4", "8", "16"]), plot }))
    }
}

/// Rates of all backends, packet widths and kinds of rays. Those of one kind are measured in turn.
fn measure(
    mut contestants: Vec<Contestant>,
    bundles: &[Bundle],
    options: &BenchOptions,
    report: &mut Report,
) -> Result<(), BenchError> {
    for bundle in bundles {
        let times = options.budget().alternate(contestants.len() * WIDTHS.len(), |variant| {
            let Contestant { backend, .. } = &contestants[variant / WIDTHS.len()];
            let (seconds, _) = with_accel!(backend, accel => timed(|| match WIDTHS[variant % WIDTHS.len()] {
                4 => packets::<_, 4>(accel, bundle),
                8 => packets::<_, 8>(accel, bundle),
                16 => packets::<_, 16>(accel, bundle),
                _ => singles(accel, bundle),
            }));
            Ok::<_, BenchError>(seconds)
        })?;
        let mut rates = Vec::new();
        for (Contestant { name, table, plot, .. }, times) in
            contestants.iter_mut().zip(times.chunks(WIDTHS.len()))
        {
            let rate = |(width, seconds): (&usize, &Vec<f64>)| {
                report.record(format!("{name}: {}: width {width}", bundle.name), seconds.clone());
                bundle.rays.len() as f64 / 1e6 / Samples(seconds.clone()).median()
            };
            let rate: Vec<f64> = WIDTHS.iter().zip(times).map(rate).collect();
            let cells = rate.iter().map(|rate| format!("{rate:.2}"));
            table.rows.push(std::iter::once(bundle.name.to_owned()).chain(cells).collect());
            let points = WIDTHS.iter().zip(&rate).map(|(&width, &rate)| (width as f64, rate)).collect();
            plot.series.push(Series { label: bundle.name.to_owned(), points });
            let best_packet = rate[1..].iter().copied().fold(0.0, f64::max);
            rates.push([rate[0], best_packet]);
        }
        if let [embree, bvh] = rates.as_slice() {
            for ((form, goal), (embree, bvh)) in GOALS.iter().zip(embree.iter().zip(bvh)) {
                let name = format!("BVH over {}, {}, {form}", contestants[0].name, bundle.name);
                report.goals.push(Goal::new(name, bvh / embree, Aim::AtLeast, *goal));
            }
        }
    }
    for Contestant { table, plot, .. } in contestants {
        report.tables.push(table);
        report.plots.push(plot);
    }
    Ok(())
}

/// About `count` rays of every kind.
fn bundles(setup: &Setup, count: usize) -> Vec<Bundle> {
    let Setup { scene, camera, .. } = setup;
    let bounds = scene.bounds();
    let mut random = SplitMix64::new(1);
    let mut lights = scene.lights.clone();
    // Neighbours along x are neighbours in a packet.
    lights.sort_by(|a, b| a.position.x.total_cmp(&b.position.x));

    let side = (count as f64).sqrt() as u32 / 4 * 4;
    let view = CameraRays::new(camera, (side, side), 1);
    let squares = (0..side / 4).flat_map(|row| (0..side / 4).map(move |column| (column * 4, row * 4)));
    let camera_rays = squares
        .flat_map(|(x, y)| (0..16).map(move |i| (x + i % 4, y + i / 4)))
        .map(|(x, y)| view.ray(x, y, 0));

    // Blocks of 4×2×2 points of a grid, as in a brick of a light mesh.
    const SPACING: f32 = 0.5;
    let per_light = 16 * lights.len();
    let blocks: Vec<Vec3> =
        (0..count.div_ceil(per_light)).map(|_| random.in_box(bounds.min, bounds.max)).collect();
    let corner = |i: usize| Vec3::new((i % 4) as f32, (i / 4 % 2) as f32, (i / 8) as f32) * SPACING;
    let mut to_one_light = Vec::with_capacity(blocks.len() * per_light);
    let mut to_many_lights = to_one_light.clone();
    for &block in &blocks {
        for light in &lights {
            to_one_light.extend((0..16).map(|i| Ray::between(block + corner(i), light.position)));
        }
        for point in (0..16).map(|i| block + corner(i)) {
            to_many_lights.extend(lights.iter().map(|light| Ray::between(point, light.position)));
        }
    }

    let strata = SphereStrata::new(256);
    let sphere = (0..count.div_ceil(256)).flat_map(|_| {
        let point = random.in_box(bounds.min, bounds.max);
        let strata = &strata;
        (0..strata.len()).map(move |cell| Ray::new(point, strata.jittered(cell, point)))
    });
    let bundle = |name, rays, nearest, coherence| Bundle { name, rays, nearest, coherence };
    vec![
        bundle("camera", camera_rays.collect(), true, Coherence::Coherent),
        bundle("neighbouring points to one light", to_one_light, false, Coherence::Coherent),
        bundle("one point to many lights", to_many_lights, false, Coherence::Incoherent),
        bundle("full sphere", sphere.collect(), true, Coherence::Incoherent),
    ]
}

/// Rays per task.
const TASK: usize = 4096;

/// Traces rays one by one; returns how many hit.
fn singles<A: Accel>(accel: &A, bundle: &Bundle) -> usize {
    let hits = |ray: &&Ray| if bundle.nearest { accel.intersect(ray).is_some() } else { accel.occluded(ray) };
    bundle.rays.par_chunks(TASK).map(|rays| rays.iter().filter(hits).count()).sum()
}

/// Traces rays in packets; returns how many hit.
fn packets<A: Accel, const N: usize>(accel: &A, bundle: &Bundle) -> usize {
    let trace = |rays: &[Ray]| {
        let active = ((1u64 << rays.len()) - 1) as u32;
        if bundle.nearest {
            let mut packet = RayHitPacket::<N>::empty();
            rays.iter().enumerate().for_each(|(lane, ray)| packet.set_lane(lane, ray));
            accel.intersect_packet(active, &mut packet, bundle.coherence);
            (0..rays.len()).filter(|&lane| hit_of_lane(&packet, lane).is_some()).count()
        } else {
            let mut packet = RayPacket::<N>::empty();
            rays.iter().enumerate().for_each(|(lane, ray)| packet.set_lane(lane, ray));
            (accel.occluded_packet(active, &mut packet, bundle.coherence) & active).count_ones() as usize
        }
    };
    bundle.rays.par_chunks(TASK).map(|rays| rays.chunks(N).map(trace).sum::<usize>()).sum()
}
