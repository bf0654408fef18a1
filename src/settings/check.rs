//! What settings made in memory must fulfil; those of scene files and flags are checked where they are read.

use super::limits::Steps;
use super::mesh::{PointLayout, PointSettings, Spacing};
use super::settings::Settings;
use super::shading::Radius;
use super::view::MAX_FILTER_WIDTH;
use crate::image::MAX_PIXELS;

/// A setting out of its range.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{name} must {range}, found {found}")]
pub struct SettingsError {
    /// Path of the field in [`Settings`].
    pub name: &'static str,
    /// The range, in words.
    pub range: &'static str,
    /// The value.
    pub found: String,
}

fn check<T: std::fmt::Debug>(
    name: &'static str,
    range: &'static str,
    found: T,
    holds: bool,
) -> Result<(), SettingsError> {
    if holds { Ok(()) } else { Err(SettingsError { name, range, found: format!("{found:?}") }) }
}

fn is_length(length: f32) -> bool {
    length > 0.0 && length.is_finite()
}

impl Settings {
    /// Checks all ranges.
    ///
    /// # Errors
    /// The first setting that is out of its range.
    pub fn check(&self) -> Result<(), SettingsError> {
        let Self { view, mesh, shading, limits, .. } = self;
        let (width, height) = view.resolution;
        let pixels = u64::from(width) * u64::from(height);
        check(
            "view.resolution",
            "have 1 to 2^28 pixels",
            view.resolution,
            (1..=MAX_PIXELS).contains(&pixels),
        )?;
        if let Some(crop) = view.crop {
            check("view.crop", "lie within the resolution", crop, crop.is_within(view.resolution))?;
        }
        let one_or_more = |name, count: u32| check(name, "be at least 1", count, count >= 1);
        one_or_more("view.samples_per_pixel", view.samples_per_pixel)?;
        if let Some(width) = view.filter_width {
            check("view.filter_width", "lie in (0, 16]", width, width > 0.0 && width <= MAX_FILTER_WIDTH)?;
        }
        one_or_more("view.max_depth", view.max_depth)?;
        one_or_more("shading.reference_samples", shading.reference_samples)?;
        let threshold = view.weight_threshold;
        check("view.weight_threshold", "be a number from 0 up", threshold, threshold >= 0.0)?;
        let tolerance = shading.tolerance;
        check("shading.tolerance", "be a number from 0 up", tolerance, tolerance >= 0.0)?;
        let tolerance = shading.pixel_tolerance;
        check("shading.pixel_tolerance", "be a number from 0 up", tolerance, tolerance >= 0.0)?;
        let radius = |name, radius: Radius| {
            let (Radius::Units(length) | Radius::Spacings(length)) = radius;
            check(name, "be finite and above 0", length, is_length(length))
        };
        radius("shading.kernel.radius", shading.kernel.radius)?;
        if let Some(error) = limits.max_error {
            check("limits.max_error", "be a number from 0 up", error, error >= 0.0 && error.is_finite())?;
        }
        let steps = &limits.steps;
        let holds = (1..=Steps::MOST).contains(&steps.pictures());
        check("limits.steps", "make 1 to 8 pictures", steps, holds)?;
        if let Steps::List(list) = steps {
            for step in list {
                let spacing =
                    step.spacing.is_none_or(|spacing| spacing.to_array().into_iter().all(is_length));
                let holds = spacing && step.radius.is_none_or(is_length);
                check("limits.steps", "have lengths that are finite and above 0", step, holds)?;
            }
        }
        mesh.direct.check()?;
        if let Some(indirect) = &mesh.indirect {
            radius("shading.indirect.kernel.radius", shading.indirect.kernel.radius)?;
            indirect.points.check()?;
            one_or_more("mesh.indirect.directions", indirect.directions)?;
            one_or_more("mesh.indirect.bounces", indirect.bounces)?;
            let tolerance = indirect.tolerance;
            check("mesh.indirect.tolerance", "be a number from 0 up", tolerance, tolerance >= 0.0)?;
        }
        Ok(())
    }
}

impl PointSettings {
    /// Checks all ranges.
    ///
    /// # Errors
    /// The first setting that is out of its range.
    pub(crate) fn check(&self) -> Result<(), SettingsError> {
        if let Spacing::Units(spacing) = self.spacing {
            let holds = spacing.to_array().into_iter().all(is_length);
            check("points.spacing", "be finite and above 0", spacing, holds)?;
        }
        if let PointLayout::List(positions) = &self.layout {
            let holds = !positions.is_empty() && positions.iter().all(|position| position.is_finite());
            check("points.layout", "list at least one position, all finite", positions.len(), holds)?;
        }
        let levels = self.levels;
        check("points.levels", "lie in 0 to 4", levels, levels <= Self::MOST_LEVELS)?;
        for region in &self.regions {
            let spacing = region.spacing.is_none_or(|spacing| spacing.to_array().into_iter().all(is_length));
            let holds = spacing && region.radius.is_none_or(is_length) && !region.bounds.is_empty();
            check("points.regions", "have a box and lengths above 0", region, holds)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Window;
    use crate::settings::{IndirectSettings, Step};
    use glam::Vec3;

    /// Every kind of value that would make a render impossible is an error that names it.
    #[test]
    fn values_out_of_range_are_refused_by_name() {
        assert_eq!(Settings::default().check(), Ok(()));
        let refused = |change: &dyn Fn(&mut Settings)| {
            let mut settings = Settings::default();
            settings.mesh.indirect = Some(IndirectSettings::default());
            change(&mut settings);
            settings.check().expect_err("out of range").name
        };
        assert_eq!(refused(&|s| s.view.resolution = (0, 5)), "view.resolution");
        let beyond = Window { x: 700, y: 0, width: 101, height: 1 };
        assert_eq!(refused(&|s| s.view.crop = Some(beyond)), "view.crop");
        assert_eq!(refused(&|s| s.view.samples_per_pixel = 0), "view.samples_per_pixel");
        assert_eq!(refused(&|s| s.view.filter_width = Some(f32::NAN)), "view.filter_width");
        assert_eq!(refused(&|s| s.shading.reference_samples = 0), "shading.reference_samples");
        assert_eq!(refused(&|s| s.shading.tolerance = -0.01), "shading.tolerance");
        assert_eq!(refused(&|s| s.shading.kernel.radius = Radius::Units(f32::NAN)), "shading.kernel.radius");
        assert_eq!(refused(&|s| s.limits.max_error = Some(f32::NAN)), "limits.max_error");
        assert_eq!(refused(&|s| s.limits.steps = Steps::Count(0)), "limits.steps");
        assert_eq!(refused(&|s| s.limits.steps = Steps::List(vec![Step::default(); 8])), "limits.steps");
        let flat = Step { spacing: Some(Vec3::X), ..Step::default() };
        assert_eq!(refused(&|s| s.limits.steps = Steps::List(vec![flat])), "limits.steps");
        assert_eq!(refused(&|s| s.mesh.direct.spacing = Spacing::Units(Vec3::ZERO)), "points.spacing");
        assert_eq!(
            refused(&|s| s.mesh.direct.layout = PointLayout::List(Vec::new().into())),
            "points.layout"
        );
        assert_eq!(refused(&|s| s.mesh.direct.levels = 5), "points.levels");
        let indirect =
            |change: fn(&mut IndirectSettings)| refused(&|s| s.mesh.indirect.iter_mut().for_each(change));
        assert_eq!(indirect(|i| i.directions = 0), "mesh.indirect.directions");
        assert_eq!(indirect(|i| i.bounces = 0), "mesh.indirect.bounces");
        assert_eq!(indirect(|i| i.tolerance = f32::NAN), "mesh.indirect.tolerance");
    }
}
