//! What a render finds for what its settings leave open.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::settings::{Estimator, Integrator, Radius, Settings, Spacing, Steps};

/// The settings that a render may choose by itself, as one of its pictures has them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settled {
    integrator: Integrator,
    estimator: Estimator,
    tolerance: f32,
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
        Self { integrator, estimator: shading.estimator, tolerance: shading.tolerance, spacing, radius }
    }

    /// The settings of that picture, given those that left it open: nothing is measured any more.
    pub(super) fn settings(&self, asked: &Settings) -> Settings {
        let mut settings = asked.clone();
        settings.limits.max_error = None;
        (settings.limits.steps, settings.limits.time) = (Steps::Count(1), None);
        settings.shading.integrator = self.integrator;
        settings.shading.tolerance = self.tolerance;
        self.choose_mesh(&mut settings);
        settings
    }

    /// Puts mesh points, R and estimator into settings.
    pub(super) fn choose_mesh(&self, settings: &mut Settings) {
        settings.shading.estimator = self.estimator;
        if let Some(spacing) = self.spacing {
            settings.mesh.direct.spacing = Spacing::Units(spacing);
        }
        if let Some(radius) = self.radius {
            settings.shading.kernel.radius = Radius::Units(radius);
        }
    }

    /// The spacing, if it does not follow from the view.
    pub(super) fn spacing(&self) -> Option<Vec3> {
        self.spacing
    }

    /// How direct light follows from the points.
    pub(super) fn estimator(&self) -> Estimator {
        self.estimator
    }
}
