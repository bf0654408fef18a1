//! Pictures as good as they were asked for: what is wrong is measured at parts that are held out (method §10).

mod averaged;
mod errors;
mod open_points;
mod traced;

use super::accuracy::{Accuracy, Ending, ErrorEstimate};
use super::error::RenderError;
use super::fixed::View;
use super::meshes::LightMeshes;
use super::stats::RenderStats;
use crate::accel::Accel;
use crate::image::Image;
use crate::settings::{Estimator, Integrator, PointLayout, Settings};

impl<A: Accel> View<'_, A> {
    /// Whether the error of a picture by these settings is measured.
    pub(super) fn is_measured(&self, settings: &Settings, asked: f32) -> bool {
        let shading = &settings.shading;
        let is_linear = matches!(shading.estimator, Estimator::PerLight | Estimator::Directional);
        let is_mesh = matches!(shading.integrator, Integrator::Auto | Integrator::LightMesh);
        // There is no other mesh like a list of points.
        let is_list = matches!(settings.mesh.direct.layout, PointLayout::List(_));
        let has_measure = shading.is_hybrid() || !is_list;
        asked > 0.0 && !self.world.lights.is_empty() && is_linear && is_mesh && has_measure
    }

    /// Renders with an error of at most `asked`, if it is above 0 and can be measured.
    pub(super) fn render_measured(
        &self,
        settings: &Settings,
        asked: f32,
        meshes: &mut LightMeshes,
    ) -> Result<(Image, RenderStats), RenderError> {
        let shading = &settings.shading;
        if !self.is_measured(settings, asked) {
            let (image, mut stats) = self.render_fixed(settings, meshes)?;
            if asked > 0.0 {
                let exact = shading.integrator == Integrator::Conventional || self.world.lights.is_empty();
                let ending = if exact { Ending::Exact } else { Ending::Settings };
                stats.accuracy = Some(Accuracy { asked, found: None, ending, rays_for_half: None });
            }
            return Ok((image, stats));
        }
        if shading.is_hybrid() {
            self.render_traced(settings.clone(), asked, meshes)
        } else {
            self.render_averaged(settings.clone(), asked, meshes)
        }
    }

    /// What was found of a picture that is finished, or what ended the render before it was: the picture is kept all the same.
    fn or_unmeasured(
        &self,
        found: Result<Option<ErrorEstimate>, RenderError>,
    ) -> Result<(Option<ErrorEstimate>, Option<Ending>), RenderError> {
        match found {
            Ok(found) => Ok((found, None)),
            Err(error) => Ok((None, Some(self.ending_of(&error).ok_or(error)?))),
        }
    }

    /// What ended a render that has a picture already, if that may be shown in place of the one that this error prevented.
    pub(super) fn ending_of(&self, error: &RenderError) -> Option<Ending> {
        match error {
            RenderError::Stopped if self.stop.is_late() => Some(Ending::Time),
            RenderError::Memory { .. } => Some(Ending::Memory),
            _ => None,
        }
    }

    /// What was rendered, with what a picture before it took; or that picture, with how wrong it is, if there was no time or no memory for another one.
    fn or_before(
        &self,
        rendered: Result<(Image, RenderStats), RenderError>,
        before: Option<(Image, RenderStats)>,
    ) -> Result<(Image, RenderStats), RenderError> {
        match (rendered, before) {
            (Ok((image, mut stats)), Some((_, before))) => {
                stats.add_earlier(&before);
                Ok((image, stats))
            }
            (Err(error), Some((image, mut stats))) => {
                let ending = self.ending_of(&error).ok_or(error)?;
                stats.accuracy.iter_mut().for_each(|accuracy| accuracy.ending = ending);
                Ok((image, stats))
            }
            (rendered, None) => rendered,
        }
    }
}

/// Mean of all channels of a picture.
fn mean(image: &Image) -> f64 {
    let finite = image.pixels().iter().filter(|pixel| pixel.iter().all(|value| value.is_finite()));
    let (sum, count) = finite.fold((0.0, 0.0), |(sum, count), pixel| {
        (sum + pixel.iter().map(|&value| f64::from(value)).sum::<f64>(), count + 3.0)
    });
    if count > 0.0 { sum / count } else { 0.0 }
}
