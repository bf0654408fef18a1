//! `[render]`, and `preset`.

use std::time::Duration;

use serde::Deserialize;
use toml::Spanned;

use super::place::Places;
use super::steps::StepsKey;
use super::values::{Count, FilterWidth, Fraction, NonNegative, Stops};
use crate::image::MAX_PIXELS;
use crate::scene::Falloff;
use crate::scene::load::LoadError;
use crate::settings::{
    Estimator, IndirectSettings, Integrator, PixelFilter, Radius, Resolve, Settings, Steps, named_enum,
};

/// `[render]`
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RenderTable {
    integrator: Option<Integrator>,
    reference_samples: Option<Count<65_536>>,
    resolution: Option<Spanned<[Count<65_536>; 2]>>,
    spp: Option<Count<65_536>>,
    filter: Option<PixelFilter>,
    filter_width: Option<FilterWidth>,
    max_depth: Option<Count<1_000>>,
    weight_threshold: Option<Fraction>,
    exposure: Option<Stops>,
    lambertian: Option<bool>,
    max_error: Option<Fraction>,
    time_limit: Option<NonNegative>,
    steps: Option<Spanned<StepsKey>>,
}

named_enum! {
    /// `preset`
    pub enum PresetName {
        /// Inverse-square falloff, Lambertian surfaces, sharp shadows, several bounces (method §12)
        Physical = "physical",
    }
}

impl PresetName {
    /// Changes the defaults; keys that are given still count.
    pub fn apply(self, settings: &mut Settings, falloff: &mut Falloff) {
        match self {
            Self::Physical => {
                *falloff = Falloff::InverseSquare;
                let Settings { mesh, shading, .. } = settings;
                shading.lambertian = true;
                shading.estimator = Estimator::PerLight;
                // Point lights cast sharp shadows.
                shading.resolve = Resolve::Trace;
                shading.kernel.radius = Radius::Spacings(1.5);
                shading.indirect.at_surface = true;
                let bounces = IndirectSettings::ALL_BOUNCES;
                mesh.indirect = Some(IndirectSettings { bounces, ..IndirectSettings::default() });
            }
        }
    }
}

impl RenderTable {
    /// Puts what is given in place of the defaults.
    pub fn apply(&self, settings: &mut Settings, places: &Places) -> Result<(), LoadError> {
        if let Some(resolution) = &self.resolution {
            let [width, height] = resolution.get_ref().map(|count| count.0);
            if u64::from(width) * u64::from(height) > MAX_PIXELS {
                let problem = format!("{width} × {height} is more than {MAX_PIXELS} pixels");
                return Err(places.error(&resolution.span(), "render.resolution", problem));
            }
            settings.view.resolution = (width, height);
        }
        let Settings { view, shading, output, limits, .. } = settings;
        limits.max_error = self.max_error.map_or(limits.max_error, |share| Some(share.0));
        // What is longer than a render may ever take is no limit, nor is 0.
        let time =
            |seconds: NonNegative| Duration::try_from_secs_f32(seconds.0).ok().filter(|time| !time.is_zero());
        limits.time = self.time_limit.map_or(limits.time, time);
        if let Some(key) = &self.steps {
            let StepsKey(steps) = key.get_ref();
            let (most, pictures) = (Steps::MOST, steps.pictures());
            if pictures > most {
                let problem = format!("must make at most {most} pictures with the last, found {pictures}");
                return Err(places.error(&key.span(), "render.steps", problem));
            }
            limits.steps.clone_from(steps);
        }
        shading.integrator = self.integrator.unwrap_or(shading.integrator);
        shading.reference_samples = self.reference_samples.map_or(shading.reference_samples, |count| count.0);
        shading.lambertian = self.lambertian.unwrap_or(shading.lambertian);
        view.samples_per_pixel = self.spp.map_or(view.samples_per_pixel, |count| count.0);
        view.filter = self.filter.unwrap_or(view.filter);
        view.filter_width = self.filter_width.map_or(view.filter_width, |width| Some(width.0));
        view.max_depth = self.max_depth.map_or(view.max_depth, |count| count.0);
        view.weight_threshold = self.weight_threshold.map_or(view.weight_threshold, |weight| weight.0);
        output.exposure = self.exposure.map_or(output.exposure, |stops| stops.0);
        Ok(())
    }
}
