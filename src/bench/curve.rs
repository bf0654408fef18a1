//! Error over time of light meshes, and the choice of the fastest ones that are good enough.

use super::configuration::{Configuration, ESTIMATORS, LAYOUTS, conventional, layout_name};
use super::report::{Plot, Report, Series, Table};
use super::setup::{Setup, relative_rmse};
use super::{BenchError, BenchOptions};
use crate::accel::Backend;
use crate::image::Image;
use crate::settings::Estimator;

/// A configuration with what it costs and how far it is off.
#[derive(Clone, Debug)]
pub struct Tried {
    /// The settings.
    pub configuration: Configuration,
    /// RMSE over the mean against the reference of the same estimator and R.
    pub own_error: f64,
    /// The same against the reference of `per-light`, which is eq. (3) of every light's visibility without
    /// approximation.
    pub exact_error: f64,
    /// Seconds of a frame.
    pub seconds: f64,
}

/// What the curve is measured on.
struct Sizes {
    /// Side of the images that are timed, pixels.
    time_side: u32,
    /// Side of the references. The timed side is an odd multiple of it, so that their pixels' centres are pixels' centres
    /// of the timed image: errors need no frame of their own.
    error_side: u32,
    reference_samples: u32,
    /// R, and spacings in the same proportions to it: the error hangs on their ratio.
    meshes: &'static [(f32, &'static [f32])],
}

impl Sizes {
    fn of(options: &BenchOptions) -> Self {
        if options.quick {
            Self { time_side: 48, error_side: 16, reference_samples: 16, meshes: &[(1.5, &[1.0])] }
        } else {
            let meshes: &[(f32, &[f32])] =
                &[(0.75, &[0.75, 0.6, 0.55, 0.45, 0.3]), (1.5, &[1.5, 1.2, 1.1, 0.9, 0.6])];
            Self { time_side: 600, error_side: 40, reference_samples: 128, meshes }
        }
    }
}

/// Tries estimators × layouts × spacings for each radius; tables and plots go to the report.
pub fn measure(
    setup: &Setup,
    backend: &Backend,
    options: &BenchOptions,
    report: &mut Report,
    log: &dyn Fn(&str),
) -> Result<Vec<Tried>, BenchError> {
    let sizes = Sizes::of(options);
    let mut all = Vec::new();
    for &(radius, spacings) in sizes.meshes {
        let configuration = |estimator| Configuration {
            estimator,
            layout: LAYOUTS[0].clone(),
            spacing: radius,
            radius,
            levels: 0,
        };
        let reference = |estimator| {
            log(&format!("reference for {} at R {radius}", estimator));
            reference_image(
                setup,
                backend,
                &configuration(estimator),
                sizes.error_side,
                sizes.reference_samples,
            )
        };
        let exact = reference(Estimator::PerLight)?;
        let hard = conventional(&setup.settings, (sizes.error_side, sizes.error_side));
        let softness = relative_rmse(&exact, &setup.frame(backend, &hard)?.image);
        let mut table = Table::new(
            format!(
                "Error over time at R = {radius}, {0}×{0} pixels; the image it approximates differs from hard \
                 shadows by {1:.1} %",
                sizes.time_side,
                100.0 * softness
            ),
            &["estimator", "layout", "spacing", "own error %", "against per-light %", "seconds"],
        );
        let mut plot = Plot {
            title: format!("Error over time, R = {radius}"),
            x: "seconds per frame".to_owned(),
            y: "own error (RMSE / mean)".to_owned(),
            series: Vec::new(),
        };
        for estimator in ESTIMATORS {
            let own = if estimator == Estimator::PerLight { exact.clone() } else { reference(estimator)? };
            for layout in &LAYOUTS {
                let mut series =
                    Series { label: format!("{} {}", estimator, layout_name(layout)), points: Vec::new() };
                for &spacing in spacings {
                    let layout = layout.clone();
                    let configuration = Configuration { estimator, layout, spacing, radius, levels: 0 };
                    let tried = attempt(setup, backend, configuration, &sizes, [&own, &exact], report)?;
                    series.points.push((tried.seconds, tried.own_error));
                    table.rows.push(vec![
                        estimator.to_string(),
                        layout_name(&tried.configuration.layout).to_owned(),
                        spacing.to_string(),
                        format!("{:.2}", 100.0 * tried.own_error),
                        format!("{:.2}", 100.0 * tried.exact_error),
                        format!("{:.4}", tried.seconds),
                    ]);
                    all.push(tried);
                }
                plot.series.push(series);
            }
        }
        report.tables.push(table);
        report.plots.push(plot);
    }
    Ok(all)
}

/// The image that light meshes of a configuration approximate, `side` pixels wide and high.
fn reference_image(
    setup: &Setup,
    backend: &Backend,
    configuration: &Configuration,
    side: u32,
    samples: u32,
) -> Result<Image, BenchError> {
    let settings = configuration.reference(&setup.settings, (side, side), samples);
    Ok(setup.frame(backend, &settings)?.image)
}

fn attempt(
    setup: &Setup,
    backend: &Backend,
    configuration: Configuration,
    sizes: &Sizes,
    [own, exact]: [&Image; 2],
    report: &mut Report,
) -> Result<Tried, BenchError> {
    let settings = configuration.settings(&setup.settings, (sizes.time_side, sizes.time_side));
    let frame = setup.frame(backend, &settings)?;
    let image = every(&frame.image, sizes.time_side / sizes.error_side)?;
    let seconds = report.record(format!("curve: {configuration}"), vec![frame.seconds]);
    Ok(Tried {
        own_error: relative_rmse(&image, own),
        exact_error: relative_rmse(&image, exact),
        configuration,
        seconds,
    })
}

/// The middle pixels of squares of `step` by `step` pixels.
pub fn every(image: &Image, step: u32) -> Result<Image, BenchError> {
    let (width, height) = (image.width(), image.height());
    let middles = |side: u32| (step / 2..side).step_by(step as usize);
    let pixels = middles(height).flat_map(|y| middles(width).filter_map(move |x| image.get(x, y))).collect();
    Ok(Image::from_pixels(width / step, height / step, pixels)?)
}

/// The fastest configuration whose errors, own and exact, are both within `limit`; if there is none, the one with the
/// smallest errors. Estimators that don't converge to the conventional image are left out.
pub fn fastest_within(tried: &[Tried], limit: f64) -> Option<&Tried> {
    let worst = |tried: &Tried| tried.own_error.max(tried.exact_error);
    let converging = |tried: &&Tried| {
        matches!(tried.configuration.estimator, Estimator::PerLight | Estimator::Directional)
    };
    let candidates = || tried.iter().filter(converging);
    candidates()
        .filter(|tried| worst(tried) <= limit)
        .min_by(|a, b| a.seconds.total_cmp(&b.seconds))
        .or_else(|| candidates().min_by(|a, b| worst(a).total_cmp(&worst(b))))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tried(estimator: Estimator, own_error: f64, exact_error: f64, seconds: f64) -> Tried {
        let configuration =
            Configuration { estimator, layout: LAYOUTS[0].clone(), spacing: 1.0, radius: 1.0, levels: 0 };
        Tried { configuration, own_error, exact_error, seconds }
    }

    /// The kept pixels are the middles of squares, row by row.
    #[test]
    fn middles_of_squares_are_kept() {
        let pixels = (0..54).map(|i| [i as f32; 3]).collect();
        let kept = every(&Image::from_pixels(9, 6, pixels).unwrap(), 3).unwrap();
        assert_eq!((kept.width(), kept.height()), (3, 2));
        let values: Vec<f32> = kept.pixels().iter().map(|pixel| pixel[0]).collect();
        assert_eq!(values, [10.0, 13.0, 16.0, 37.0, 40.0, 43.0]);
    }

    /// The fastest is taken only among those that are good enough by both measures and converge to the right image.
    #[test]
    fn speed_never_buys_error() {
        let all = [
            tried(Estimator::Paper, 0.01, 0.01, 0.1),
            tried(Estimator::Directional, 0.04, 0.11, 0.2),
            tried(Estimator::PerLight, 0.09, 0.09, 0.4),
            tried(Estimator::PerLight, 0.08, 0.08, 0.3),
        ];
        assert_eq!(fastest_within(&all, 0.1).unwrap().seconds, 0.3);
        assert_eq!(
            fastest_within(&all, 0.01).unwrap().seconds,
            0.3,
            "the smallest error where none is within"
        );
    }
}
