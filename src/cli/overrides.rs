//! Flags of `lightmesh render` that replace settings of the scene file.

use clap::Args;

use super::choice::named;
use super::parse::{self, Bounces, TimeLimit};
use crate::settings::{
    Estimator, Integrator, Neighbourhood, PixelFilter, PointSettings, Radius, Resolve, Settings, Shadows,
    Spacing, Steps,
};

/// Settings of the scene file that flags can override.
#[derive(Debug, Default, Args)]
#[command(next_help_heading = "Instead of the scene file's settings")]
pub struct Overrides {
    /// What computes the light at surfaces
    #[arg(long, value_parser = named::<Integrator>())]
    integrator: Option<Integrator>,
    /// With the integrator `reference`: positions around each surface point at which the light is evaluated
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65536))]
    reference_samples: Option<u32>,
    /// How direct light follows from the light mesh
    #[arg(long, value_parser = named::<Estimator>())]
    estimator: Option<Estimator>,
    /// Which mesh points a surface point takes
    #[arg(long, value_parser = named::<Neighbourhood>())]
    neighbourhood: Option<Neighbourhood>,
    /// Shadows that blur over the neighbourhood of a surface point, or such as the lamps cast
    #[arg(long, value_parser = named::<Shadows>(), conflicts_with = "resolve")]
    shadows: Option<Shadows>,
    /// What per-light does where mesh points disagree: the same as --shadows, in the method's words
    #[arg(long, value_parser = named::<Resolve>())]
    resolve: Option<Resolve>,
    /// With traced shadow edges: what all rays that are spared may cost, as a share of a pixel's light
    #[arg(long, value_name = "SHARE", value_parser = parse::share)]
    tolerance: Option<f32>,
    /// Radius of the neighbourhood in scene units, or in spacings: 2.5s
    #[arg(long, value_name = "R", value_parser = parse::radius)]
    radius: Option<Radius>,
    /// Distance between mesh points: one number, X,Y,Z, or auto
    #[arg(long, value_name = "S", value_parser = parse::spacing)]
    spacing: Option<Spacing>,
    /// Coarser mesh points, of twice the spacing each, whose agreement spares finer ones their rays
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=i64::from(PointSettings::MOST_LEVELS)))]
    levels: Option<u32>,
    /// Times that light passes between surfaces, or off
    #[arg(long, value_name = "BOUNCES", value_parser = parse::bounces)]
    indirect: Option<Bounces>,
    /// Size of the image
    #[arg(long, value_name = "WxH", value_parser = parse::resolution)]
    resolution: Option<(u32, u32)>,
    /// Camera rays per pixel
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65536))]
    spp: Option<u32>,
    /// How they are spread
    #[arg(long, value_parser = named::<PixelFilter>())]
    filter: Option<PixelFilter>,
    /// Width of the filter in pixels
    #[arg(long, value_name = "W", value_parser = parse::filter_width)]
    filter_width: Option<f32>,
    /// Error that the picture may have: 5% or 0.05; 0 measures none [default: 5%]
    #[arg(long, value_name = "SHARE", value_parser = parse::error_share)]
    max_error: Option<f32>,
    /// Stop after this time with the best whole picture so far: 30, 90s, 5m; 0 for no limit
    #[arg(long, value_name = "TIME", value_parser = parse::time_limit)]
    time_limit: Option<TimeLimit>,
    /// Whole pictures to make one after the other, each better than the one before
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(Steps::MOST)))]
    steps: Option<u32>,
    /// Brightness of PNG images in stops
    #[arg(long, value_name = "STOPS", allow_negative_numbers = true, value_parser = parse::exposure)]
    pub exposure: Option<f32>,
}

impl Overrides {
    /// The conventional tracer, whatever the scene file says.
    pub fn conventional() -> Self {
        Self { integrator: Some(Integrator::Conventional), ..Self::default() }
    }

    /// Light from surfaces with so many bounces, or none of it.
    pub fn of_indirect(bounces: Option<Bounces>) -> Self {
        Self { indirect: bounces, ..Self::default() }
    }

    /// Replaces the settings that flags were given for.
    pub fn apply(&self, settings: &mut Settings) {
        self.apply_to_direct_light(settings);
        self.apply_to_indirect_light(settings);
    }

    fn apply_to_indirect_light(&self, settings: &mut Settings) {
        match self.indirect {
            Some(Bounces(0)) => settings.mesh.indirect = None,
            Some(Bounces(bounces)) => {
                if settings.mesh.indirect.is_none() {
                    settings.derive_indirect();
                }
                settings.mesh.indirect.iter_mut().for_each(|indirect| indirect.bounces = bounces);
            }
            None => {}
        }
    }

    fn apply_to_direct_light(&self, settings: &mut Settings) {
        let Settings { view, mesh, shading, output, limits } = settings;
        set(&mut shading.integrator, self.integrator);
        set(&mut shading.reference_samples, self.reference_samples);
        set(&mut shading.estimator, self.estimator);
        set(&mut shading.resolve, self.shadows.map(Resolve::from).or(self.resolve));
        set(&mut shading.tolerance, self.tolerance);
        set(&mut shading.kernel.neighbourhood, self.neighbourhood);
        set(&mut shading.kernel.radius, self.radius);
        set(&mut mesh.direct.spacing, self.spacing);
        set(&mut mesh.direct.levels, self.levels);
        set(&mut view.resolution, self.resolution);
        set(&mut view.samples_per_pixel, self.spp);
        set(&mut view.filter, self.filter);
        view.filter_width = self.filter_width.or(view.filter_width);
        set(&mut output.exposure, self.exposure);
        limits.max_error = self.max_error.or(limits.max_error);
        limits.estimator_open &= self.estimator.is_none();
        set(&mut limits.time, self.time_limit.map(|limit| limit.0));
        set(&mut limits.steps, self.steps.map(Steps::Count));
    }
}

fn set<T>(setting: &mut T, value: Option<T>) {
    if let Some(value) = value {
        *setting = value;
    }
}
