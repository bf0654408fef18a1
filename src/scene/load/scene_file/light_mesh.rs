//! `[light_mesh]`.

use serde::Deserialize;
use toml::Spanned;

use super::place::Places;
use super::values::{LengthsOrAuto, Positive};
use crate::scene::load::LoadError;
use crate::settings::{Estimator, LightMeshSettings, Neighbourhood, Radius, Spacing};

/// `[light_mesh]`
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LightMeshTable {
    spacing: Option<LengthsOrAuto>,
    radius: Option<Spanned<Positive>>,
    radius_in_spacings: Option<Positive>,
    neighbourhood: Option<NeighbourhoodName>,
    hemisphere: Option<bool>,
    estimator: Option<EstimatorName>,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum NeighbourhoodName {
    Nearest,
    Sphere,
    SmoothSphere,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum EstimatorName {
    Paper,
    Ratio,
    PerLight,
    Directional,
}

impl LightMeshTable {
    /// Puts what is given in place of the defaults.
    pub fn apply(&self, settings: &mut LightMeshSettings, places: &Places) -> Result<(), LoadError> {
        match self.spacing {
            None => {}
            Some(LengthsOrAuto::Auto) => settings.points.spacing = Spacing::Auto,
            Some(LengthsOrAuto::Lengths(lengths)) => settings.points.spacing = Spacing::Units(lengths),
        }
        match (&self.radius, self.radius_in_spacings) {
            (None, None) => {}
            (Some(radius), None) => settings.points.radius = Radius::Units(radius.get_ref().0),
            (None, Some(radius)) => settings.points.radius = Radius::Spacings(radius.0),
            (Some(radius), Some(_)) => {
                let problem = "radius and radius_in_spacings exclude each other";
                return Err(places.error(&radius.span(), "light_mesh.radius", problem));
            }
        }
        if let Some(name) = self.neighbourhood {
            settings.points.neighbourhood = match name {
                NeighbourhoodName::Nearest => Neighbourhood::Nearest,
                NeighbourhoodName::Sphere => Neighbourhood::Sphere,
                NeighbourhoodName::SmoothSphere => Neighbourhood::SmoothSphere,
            };
        }
        settings.points.hemisphere = self.hemisphere.unwrap_or(settings.points.hemisphere);
        if let Some(name) = self.estimator {
            settings.estimator = match name {
                EstimatorName::Paper => Estimator::Paper,
                EstimatorName::Ratio => Estimator::Ratio,
                EstimatorName::PerLight => Estimator::PerLight,
                EstimatorName::Directional => Estimator::Directional,
            };
        }
        Ok(())
    }
}
