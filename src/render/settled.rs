//! What a render finds for what its settings leave open.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::settings::{Estimator, Integrator, LayoutName, PointLayout, Radius, Settings, Spacing, Steps};

/// The settings that a render may choose by itself, as one of its pictures has them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settled {
    integrator: Integrator,
    estimator: Estimator,
    tolerance: f32,
    /// `None` for one that is not chosen among others.
    layout: Option<LayoutName>,
    /// `None` where it follows from the view.
    spacing: Option<Vec3>,
    radius: Option<f32>,
}

impl Settled {
    /// As a picture has them that is made by an integrator and these settings.
    pub(super) fn of(integrator: Integrator, settings: &Settings) -> Self {
        let shading = &settings.shading;
        let spacing = match settings.mesh.direct.spacing {
            Spacing::Auto => None,
            Spacing::Units(spacing) => Some(spacing),
        };
        let radius = match shading.kernel.radius {
            Radius::Units(radius) => Some(radius),
            Radius::Spacings(_) => None,
        };
        let layout = match settings.mesh.direct.layout {
            PointLayout::Regular => Some(LayoutName::Regular),
            PointLayout::BodyCentred => Some(LayoutName::BodyCentred),
            _ => None,
        };
        let (estimator, tolerance) = (shading.estimator, shading.tolerance);
        Self { integrator, estimator, tolerance, layout, spacing, radius }
    }

    /// The settings of that picture, given those that left it open: nothing is measured any more.
    pub(super) fn settings(&self, asked: &Settings) -> Settings {
        let mut settings = asked.clone();
        settings.shading.tolerate_pixels(settings.limits.max_error.take());
        (settings.limits.steps, settings.limits.time) = (Steps::Count(1), None);
        settings.shading.integrator = self.integrator;
        settings.shading.tolerance = self.tolerance;
        self.choose_mesh(&mut settings);
        settings
    }

    /// Puts mesh points, R and estimator into settings.
    pub(super) fn choose_mesh(&self, settings: &mut Settings) {
        settings.shading.estimator = self.estimator;
        if let Some(layout) = self.layout {
            settings.mesh.direct.layout = PointLayout::of_name(layout, 0);
        }
        if let Some(spacing) = self.spacing {
            settings.mesh.direct.spacing = Spacing::Units(spacing);
        }
        if let Some(radius) = self.radius {
            settings.shading.kernel.radius = Radius::Units(radius);
        }
    }

    /// How direct light follows from the points.
    pub(super) fn estimator(&self) -> Estimator {
        self.estimator
    }
}
