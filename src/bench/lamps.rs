//! A forest under lamps with a size: what soft shadows cost by light mesh and by conventional tracing, and how far they are from the truth.

use super::configuration::{as_it_is, conventional};
use super::report::{Aim, Goal, Report, Table};
use super::setup::{Frame, Setup};
use super::timing::Samples;
use super::{BenchError, BenchOptions};
use crate::accel::Backend;
use crate::image::Image;
use crate::image::metrics::{MetricsOptions, compare};
use crate::scene::Light;
use crate::settings::{Integrator, Resolve, Settings, Spacing};

/// Radius of the lamps.
const RADIUS: f32 = 0.3;
/// The true picture has so many pixels in place of each, along each axis.
const FINER: u32 = 4;
/// Goal: times faster than conventional tracing with no greater FLIP.
const TIMES_FASTER: f64 = 10.0;

/// One way to render.
struct Way {
    name: String,
    settings: Settings,
    is_mesh: bool,
}

/// Ways to render the lamps: conventional tracing and light meshes of several spacings, with one sample and with sixteen.
fn ways(base: &Settings, resolution: (u32, u32)) -> Vec<Way> {
    let mut ways = Vec::new();
    for samples in [1, 4, 16] {
        let mut settings = conventional(base, resolution);
        settings.view.samples_per_pixel = samples;
        ways.push(Way { name: format!("conventional, {samples} samples"), settings, is_mesh: false });
    }
    let mut mesh = as_it_is(base, resolution);
    mesh.view.samples_per_pixel = 16;
    for spacing in [None, Some(0.4), Some(0.2)] {
        let mut settings = mesh.clone();
        let name = match spacing {
            Some(spacing) => {
                settings.mesh.direct.spacing = Spacing::Units(glam::Vec3::splat(spacing));
                format!("light mesh, spacing {spacing}, 16 samples")
            }
            None => "light mesh, nothing set, 16 samples".to_owned(),
        };
        ways.push(Way { name, settings, is_mesh: true });
    }
    let mut settings = mesh;
    settings.shading.integrator = Integrator::LightMesh;
    settings.shading.resolve = Resolve::Trace;
    ways.push(Way { name: "light mesh, traced shadows, 16 samples".to_owned(), settings, is_mesh: true });
    ways
}

/// Measures a setup's lights as lamps of [`RADIUS`], at a side of the image in pixels; a goal is set unless sizes are cut down.
pub fn measure(
    setup: &Setup,
    backend: &Backend,
    side: u32,
    options: &BenchOptions,
    report: &mut Report,
) -> Result<(), BenchError> {
    let mut scene = setup.scene.clone();
    scene.lights = setup.scene.lights.iter().map(|l| Light::ball(l.position, RADIUS, l.intensity)).collect();
    let lamps =
        Setup { scene, camera: setup.camera.clone(), settings: setup.settings.clone(), load_seconds: 0.0 };
    let fine = conventional(&lamps.settings, (FINER * side, FINER * side));
    let truth = smaller(&lamps.frame(backend, &fine)?.image)?;
    let ways = ways(&lamps.settings, (side, side));
    let frames = options.budget().alternate(ways.len(), |way| lamps.frame(backend, &ways[way].settings))?;
    let title = format!(
        "{side}×{side}, {} lamps of radius {RADIUS}, against a converged picture",
        lamps.scene.lights.len()
    );
    let mut table = Table::new(title, &["", "seconds", "FLIP", "shadow rays"]);
    let mut found = Vec::new();
    for (way, frames) in ways.iter().zip(&frames) {
        let Some(Frame { image, stats, .. }) = frames.first() else { continue };
        let flip =
            compare(image, &truth, MetricsOptions::default()).ok().and_then(|m| m.flip).unwrap_or(f64::NAN);
        let times: Vec<f64> = frames.iter().map(|frame| frame.seconds).collect();
        report.record(format!("lamps: {}", way.name), times.clone());
        let seconds = Samples(times).median();
        table.rows.push(vec![
            way.name.clone(),
            format!("{seconds:.3}"),
            format!("{flip:.4}"),
            stats.rays.shadow.to_string(),
        ]);
        found.push((way.is_mesh, seconds, flip));
    }
    report.tables.push(table);
    // Each light mesh against the fastest conventional picture that is as good: the best of them.
    let ratio = |&&(_, seconds, flip): &&(bool, f64, f64)| {
        let as_good = found.iter().filter(|(is_mesh, _, other)| !is_mesh && *other <= flip);
        as_good.map(|(_, conventional, _)| conventional / seconds).fold(f64::INFINITY, f64::min)
    };
    let ratios = found.iter().filter(|(is_mesh, ..)| *is_mesh).map(|way| ratio(&way));
    if let Some(best) = ratios.filter(|ratio| ratio.is_finite()).reduce(f64::max) {
        let name = "times faster under lamps of radius 0.3, than conventional tracing of no greater FLIP";
        report.goals.push(Goal::new(name, best, Aim::AtLeast, TIMES_FASTER));
    }
    Ok(())
}

/// The image with the mean of [`FINER`] × [`FINER`] pixels in place of each.
fn smaller(image: &Image) -> Result<Image, BenchError> {
    let (width, height) = (image.width() / FINER, image.height() / FINER);
    let mut small = Image::new(width, height)?;
    let pixels = image.pixels();
    for (number, pixel) in small.pixels_mut().iter_mut().enumerate() {
        let (x, y) = (number as u32 % width * FINER, number as u32 / width * FINER);
        for at in (0..FINER * FINER).map(|i| (y + i / FINER) * image.width() + x + i % FINER) {
            for (sum, value) in pixel.iter_mut().zip(pixels[at as usize]) {
                *sum += value / (FINER * FINER) as f32;
            }
        }
    }
    Ok(small)
}
