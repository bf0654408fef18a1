//! `[render]`, and `preset`.

use serde::Deserialize;
use toml::Spanned;

use super::place::Places;
use super::values::{Count, Fraction, Stops};
use crate::image::MAX_PIXELS;
use crate::scene::Falloff;
use crate::scene::load::LoadError;
use crate::settings::{Estimator, IndirectForm, IndirectSettings, Integrator, Radius, Resolve, Settings};

/// `[render]`
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RenderTable {
    integrator: Option<IntegratorName>,
    reference_samples: Option<Count<65_536>>,
    resolution: Option<Spanned<[Count<65_536>; 2]>>,
    spp: Option<Count<65_536>>,
    max_depth: Option<Count<1_000>>,
    weight_threshold: Option<Fraction>,
    exposure: Option<Stops>,
    lambertian: Option<bool>,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum IntegratorName {
    LightMesh,
    Conventional,
    Reference,
}

/// `preset`
#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PresetName {
    Physical,
}

impl PresetName {
    /// Changes the defaults; keys that are given still count.
    pub fn apply(self, settings: &mut Settings, falloff: &mut Falloff) {
        match self {
            // Spec §12.
            Self::Physical => {
                *falloff = Falloff::InverseSquare;
                settings.lambertian = true;
                settings.light_mesh.estimator = Estimator::PerLight;
                // Point lights cast sharp shadows.
                settings.light_mesh.resolve = Resolve::Trace;
                settings.light_mesh.points.radius = Radius::Spacings(1.5);
                settings.light_mesh.indirect = Some(IndirectSettings {
                    form: IndirectForm::Directional,
                    bounces: 16,
                    at_surface: true,
                    ..IndirectSettings::default()
                });
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
            settings.resolution = (width, height);
        }
        if let Some(integrator) = self.integrator {
            settings.integrator = match integrator {
                IntegratorName::LightMesh => Integrator::LightMesh,
                IntegratorName::Conventional => Integrator::Conventional,
                IntegratorName::Reference => Integrator::Reference,
            };
        }
        settings.reference_samples =
            self.reference_samples.map_or(settings.reference_samples, |count| count.0);
        settings.samples_per_pixel = self.spp.map_or(settings.samples_per_pixel, |count| count.0);
        settings.max_depth = self.max_depth.map_or(settings.max_depth, |count| count.0);
        settings.weight_threshold =
            self.weight_threshold.map_or(settings.weight_threshold, |weight| weight.0);
        settings.lambertian = self.lambertian.unwrap_or(settings.lambertian);
        settings.exposure = self.exposure.map_or(settings.exposure, |stops| stops.0);
        Ok(())
    }
}
