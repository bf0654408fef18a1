//! `[light_mesh]` and `[light_mesh.indirect]`.

use std::path::Path;

use serde::Deserialize;
use toml::Spanned;

use super::place::Places;
use super::points::{self, PointKeys};
use super::values::{Count, NonNegative};
use crate::scene::load::LoadError;
use crate::settings::{Estimator, IndirectForm, IndirectSettings, LightMeshSettings, Normalization, Resolve};

points::point_table! {
    /// `[light_mesh]`
    #[derive(Default)]
    pub struct LightMeshTable {
        estimator: Option<EstimatorName>,
        resolve: Option<ResolveName>,
        indirect: Option<IndirectTable>,
    }
}

points::point_table! {
    /// `[light_mesh.indirect]`
    #[derive(Default)]
    pub struct IndirectTable {
        directions: Option<Count<1_000_000>>,
        emitter_samples: Option<Count<1_000_000, 0>>,
        bounces: Option<Count<1_000>>,
        tolerance: Option<NonNegative>,
        at_surface: Option<bool>,
        form: Option<FormName>,
        normalization: Option<NormalizationName>,
    }
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum EstimatorName {
    Paper,
    Ratio,
    PerLight,
    Directional,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum ResolveName {
    Average,
    Trace,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum FormName {
    Scalar,
    Directional,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum NormalizationName {
    Mean,
    Integral,
}

impl LightMeshTable {
    /// Puts what is given in place of the defaults; files lie in `folder`.
    pub fn apply(
        &self,
        settings: &mut LightMeshSettings,
        folder: &Path,
        places: &Places,
    ) -> Result<(), LoadError> {
        self.point_keys("light_mesh").apply(&mut settings.points, folder, places)?;
        if let Some(name) = self.estimator {
            settings.estimator = match name {
                EstimatorName::Paper => Estimator::Paper,
                EstimatorName::Ratio => Estimator::Ratio,
                EstimatorName::PerLight => Estimator::PerLight,
                EstimatorName::Directional => Estimator::Directional,
            };
        }
        if let Some(name) = self.resolve {
            settings.resolve = match name {
                ResolveName::Average => Resolve::Average,
                ResolveName::Trace => Resolve::Trace,
            };
        }
        // The indirect mesh's points follow from the direct one's unless its table says otherwise.
        if let Some(indirect) = &mut settings.indirect {
            indirect.points = IndirectSettings::coarser(&settings.points);
        }
        if let Some(table) = &self.indirect {
            let indirect = settings.indirect.get_or_insert_with(|| IndirectSettings {
                points: IndirectSettings::coarser(&settings.points),
                ..Default::default()
            });
            table.apply(indirect, folder, places)?;
        }
        Ok(())
    }
}

impl IndirectTable {
    fn apply(
        &self,
        settings: &mut IndirectSettings,
        folder: &Path,
        places: &Places,
    ) -> Result<(), LoadError> {
        self.point_keys("light_mesh.indirect").apply(&mut settings.points, folder, places)?;
        settings.directions = self.directions.map_or(settings.directions, |count| count.0);
        settings.emitter_samples = self.emitter_samples.map_or(settings.emitter_samples, |count| count.0);
        settings.bounces = self.bounces.map_or(settings.bounces, |count| count.0);
        settings.tolerance = self.tolerance.map_or(settings.tolerance, |share| share.0);
        settings.at_surface = self.at_surface.unwrap_or(settings.at_surface);
        if let Some(name) = self.form {
            settings.form = match name {
                FormName::Scalar => IndirectForm::Scalar,
                FormName::Directional => IndirectForm::Directional,
            };
        }
        if let Some(name) = self.normalization {
            settings.normalization = match name {
                NormalizationName::Mean => Normalization::Mean,
                NormalizationName::Integral => Normalization::Integral,
            };
        }
        Ok(())
    }
}
