//! One scene by meshes of many kinds.

use super::result::{AdaptiveScene, ChosenMesh, Cost, GivenMesh};
use crate::bench::configuration::{Configuration, conventional};
use crate::bench::curve::every;
use crate::bench::opened::Opened;
use crate::bench::report::Report;
use crate::bench::setup::relative_rmse;
use crate::bench::{BenchError, BenchOptions};
use crate::image::Image;
use crate::light_mesh::points::{AutoSpacing, Neighbourhoods, PointSet};
use crate::render::{Accuracy, RenderError};
use crate::settings::{Estimator, PointLayout, Settings, Spacing};

/// Levels of the meshes of given spacings; 0 stands for uniform ones.
const LEVELS: [u32; 3] = [0, 1, 2];

/// Levels of the meshes that are chosen by their error.
const CHOSEN_LEVELS: [u32; 2] = [0, 2];

/// What is measured.
struct Sizes {
    /// About the longer side of the images whose pixels' errors are known.
    error_side: u32,
    /// A mesh of a quarter of R has 134 points in D_y: a reference of as few would be as wrong as the mesh.
    reference_samples: u32,
    /// Spacings in units of R.
    spacings: &'static [f32],
    /// Errors that are asked for.
    errors: &'static [f32],
}

impl Sizes {
    fn of(options: &BenchOptions) -> Self {
        if options.quick {
            Self { error_side: 8, reference_samples: 16, spacings: &[1.0, 0.5], errors: &[0.1] }
        } else {
            let (spacings, errors) = (&[1.0, 0.75, 0.5, 0.375, 0.25], &[0.1, 0.05, 0.02]);
            Self { error_side: 40, reference_samples: 512, spacings, errors }
        }
    }
}

/// A way to render.
enum Way {
    Given { levels: u32, spacing: f32 },
    Chosen { levels: u32, asked: f32 },
    Conventional,
}

/// What is kept of a frame.
struct Run {
    own_error: f64,
    shadow_rays: u64,
    seconds: f64,
    accuracy: Option<Accuracy>,
}

/// Measures a scene; raw times go to the report.
pub fn measure(
    name: &str,
    opened: &Opened,
    options: &BenchOptions,
    report: &mut Report,
    log: &dyn Fn(&str),
) -> Result<AdaptiveScene, BenchError> {
    let setup = &opened.setup;
    if setup.scene.lights.is_empty() {
        return Err(BenchError::NoLights);
    }
    let sizes = Sizes::of(options);
    let (step, error_resolution) = thinned(setup.settings.view.resolution, sizes.error_side);
    let resolution = (step * error_resolution.0, step * error_resolution.1);
    let radius = radius_of(opened)?;
    let configuration = |spacing: f32, levels: u32| Configuration {
        estimator: Estimator::PerLight,
        layout: PointLayout::Regular,
        spacing: spacing * radius,
        radius,
        levels,
    };
    log(&format!("{name}: reference at R {radius}"));
    let reference =
        configuration(1.0, 0).reference(&setup.settings, error_resolution, sizes.reference_samples);
    let reference = setup.frame(&opened.backend, &reference)?.image;

    let ways: Vec<(Way, Settings)> = ways(&sizes)
        .map(|way| {
            let settings = match way {
                Way::Given { levels, spacing } => {
                    configuration(spacing, levels).settings(&setup.settings, resolution)
                }
                Way::Chosen { levels, asked } => {
                    let mut settings = configuration(1.0, levels).settings(&setup.settings, resolution);
                    settings.mesh.direct.spacing = Spacing::Auto;
                    settings.limits.max_error = Some(asked);
                    settings
                }
                Way::Conventional => conventional(&setup.settings, resolution),
            };
            (way, settings)
        })
        .collect();
    log(&format!("{name}: {} ways to render", ways.len()));
    // Pages and caches are warm for all.
    if let Some((_, settings)) = ways.first() {
        setup.frame(&opened.backend, settings)?;
    }
    let runs = options.budget().alternate(ways.len(), |way| run(opened, &ways[way].1, step, &reference))?;

    let mut scene = AdaptiveScene {
        name: name.to_owned(),
        lights: setup.scene.lights.len(),
        triangles: setup.scene.triangle_count(),
        resolution: resolution.into(),
        error_resolution: error_resolution.into(),
        radius,
        meshes: Vec::new(),
        chosen: Vec::new(),
        conventional: Cost { shadow_rays: 0, seconds: f64::NAN },
        gains: Vec::new(),
    };
    for ((way, _), runs) in ways.iter().zip(&runs) {
        // The same is rendered in every round: only seconds differ.
        let Some(&Run { own_error, shadow_rays, accuracy, .. }) = runs.first() else { continue };
        let seconds = runs.iter().map(|run| run.seconds).collect();
        let cost =
            |what: String| Cost { shadow_rays, seconds: report.record(format!("{name}: {what}"), seconds) };
        match *way {
            Way::Given { levels, spacing } => {
                let cost = cost(format!("spacing {spacing} R, levels {levels}"));
                scene.meshes.push(GivenMesh { levels, spacing, own_error, cost });
            }
            Way::Chosen { levels, asked } => {
                let cost = cost(format!("error {asked}, levels {levels}"));
                let found = accuracy.and_then(|accuracy| accuracy.found);
                let ending = accuracy.map(|accuracy| accuracy.ending);
                scene.chosen.push(ChosenMesh { levels, asked, found, ending, own_error, cost });
            }
            Way::Conventional => scene.conventional = cost("conventional".to_owned()),
        }
    }
    let adaptive = LEVELS.iter().filter(|&&levels| levels > 0);
    scene.gains = adaptive.map(|&levels| scene.gain(levels, sizes.errors)).collect();
    report.backend = opened.backend.to_string();
    Ok(scene)
}

fn ways(sizes: &Sizes) -> impl Iterator<Item = Way> {
    let (spacings, errors) = (sizes.spacings, sizes.errors);
    let given = LEVELS
        .into_iter()
        .flat_map(|levels| spacings.iter().map(move |&spacing| Way::Given { levels, spacing }));
    let chosen = CHOSEN_LEVELS
        .into_iter()
        .flat_map(|levels| errors.iter().map(move |&asked| Way::Chosen { levels, asked }));
    given.chain(chosen).chain([Way::Conventional])
}

/// A frame; light meshes start empty.
fn run(opened: &Opened, settings: &Settings, step: u32, reference: &Image) -> Result<Run, BenchError> {
    let frame = opened.setup.frame(&opened.backend, settings)?;
    let accuracy = frame.stats.accuracy;
    let measuring = accuracy.and_then(|accuracy| accuracy.found).map_or(0, |found| found.rays);
    Ok(Run {
        own_error: relative_rmse(&every(&frame.image, step)?, reference),
        shadow_rays: frame.stats.rays.shadow + measuring,
        seconds: frame.seconds,
        accuracy,
    })
}

/// R of a scene: what its settings come to where values are averaged.
fn radius_of(opened: &Opened) -> Result<f32, BenchError> {
    let (scene, settings) = (&opened.setup.scene, &opened.setup.settings);
    let mut points = PointSet::new(scene.bounds());
    let (direct, kernel) = (&settings.mesh.direct, &settings.shading.kernel);
    let neighbourhoods = Neighbourhoods::new(&mut points, direct, kernel, AutoSpacing::AVERAGED);
    Ok(neighbourhoods.map_err(RenderError::from)?.radius())
}

/// How many pixels of each row and column one is taken from, and how many are taken. The number is odd, so that the taken pixels' centres are
/// those of an image of so many pixels: errors need no frame of their own.
fn thinned((width, height): (u32, u32), side: u32) -> (u32, (u32, u32)) {
    let step = (width.max(height) / side.max(1)) | 1;
    (step, ((width / step).max(1), (height / step).max(1)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Steps are odd, images nearly as large as asked for, and never empty.
    #[test]
    fn pixels_are_thinned_by_odd_steps() {
        assert_eq!(thinned((600, 600), 40), (15, (40, 40)));
        assert_eq!(thinned((800, 600), 40), (21, (38, 28)));
        assert_eq!(thinned((32, 8), 40), (1, (32, 8)));
        assert_eq!(thinned((4000, 1), 40), (101, (39, 1)));
    }
}
