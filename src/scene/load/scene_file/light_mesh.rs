//! `[light_mesh]` and `[light_mesh.indirect]`.

use std::path::Path;

use serde::Deserialize;
use toml::Spanned;

use super::place::Places;
use super::points::{self, PointKeys};
use super::values::{Count, NonNegative};
use crate::scene::load::LoadError;
use crate::settings::{
    Estimator, IndirectForm, IndirectSettings, IndirectShading, Normalization, PointSettings, Resolve,
    Settings, Shadows,
};

points::point_table! {
    /// `[light_mesh]`
    #[derive(Default)]
    pub struct LightMeshTable {
        estimator: Option<Estimator>,
        shadows: Option<Spanned<Shadows>>,
        resolve: Option<Resolve>,
        tolerance: Option<NonNegative>,
        levels: Option<Count<{ PointSettings::MOST_LEVELS }, 0>>,
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
        form: Option<IndirectForm>,
        normalization: Option<Normalization>,
    }
}

impl LightMeshTable {
    /// Puts what is given in place of the defaults; files lie in `folder`.
    pub fn apply(&self, settings: &mut Settings, folder: &Path, places: &Places) -> Result<(), LoadError> {
        let Settings { mesh, shading, limits, .. } = settings;
        self.point_keys("light_mesh").apply(&mut mesh.direct, &mut shading.kernel, folder, places)?;
        mesh.direct.levels = self.levels.map_or(mesh.direct.levels, |count| count.0);
        limits.estimator_open = self.estimator.is_none();
        limits.layout_open = self.layout.is_none();
        shading.estimator = self.estimator.unwrap_or(shading.estimator);
        let shadows = self.shadows.as_ref();
        if let Some(shadows) = shadows.filter(|_| self.resolve.is_some()) {
            let problem = "shadows and resolve exclude each other";
            return Err(places.error(&shadows.span(), "light_mesh.shadows", problem));
        }
        let resolve = shadows.map(|shadows| (*shadows.get_ref()).into()).or(self.resolve);
        shading.resolve = resolve.unwrap_or(shading.resolve);
        shading.tolerance = self.tolerance.map_or(shading.tolerance, |share| share.0);
        // Indirect light follows from direct light unless its table says otherwise.
        if mesh.indirect.is_some() || self.indirect.is_some() {
            settings.derive_indirect();
        }
        if let (Some(table), Some(indirect)) = (&self.indirect, &mut settings.mesh.indirect) {
            table.apply(indirect, &mut settings.shading.indirect, folder, places)?;
        }
        Ok(())
    }
}

impl IndirectTable {
    fn apply(
        &self,
        settings: &mut IndirectSettings,
        shading: &mut IndirectShading,
        folder: &Path,
        places: &Places,
    ) -> Result<(), LoadError> {
        let keys = self.point_keys("light_mesh.indirect");
        keys.apply(&mut settings.points, &mut shading.kernel, folder, places)?;
        settings.directions = self.directions.map_or(settings.directions, |count| count.0);
        settings.emitter_samples = self.emitter_samples.map_or(settings.emitter_samples, |count| count.0);
        settings.bounces = self.bounces.map_or(settings.bounces, |count| count.0);
        settings.tolerance = self.tolerance.map_or(settings.tolerance, |share| share.0);
        settings.form = self.form.unwrap_or(settings.form);
        shading.at_surface = self.at_surface.unwrap_or(shading.at_surface);
        shading.normalization = self.normalization.unwrap_or(shading.normalization);
        Ok(())
    }
}
