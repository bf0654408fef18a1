//! The light-mesh settings that are tried.

use std::fmt;

use glam::Vec3;

use crate::settings::{
    Estimator, Integrator, Leaks, LightMeshSettings, PointLayout, PointSettings, Radius, Settings, Spacing,
};

/// A choice of light-mesh settings. R is fixed in scene units, so that all spacings approximate the same image.
#[derive(Clone, Debug, PartialEq)]
pub struct Configuration {
    /// Estimator.
    pub estimator: Estimator,
    /// Layout of the mesh points.
    pub layout: PointLayout,
    /// Their spacing, scene units.
    pub spacing: f32,
    /// R, scene units.
    pub radius: f32,
}

/// Estimators, in the order of the report.
pub const ESTIMATORS: [Estimator; 4] =
    [Estimator::PerLight, Estimator::Directional, Estimator::Ratio, Estimator::Paper];

/// Layouts, in the order of the report.
pub const LAYOUTS: [PointLayout; 4] = [
    PointLayout::Regular,
    PointLayout::BodyCentred,
    PointLayout::Jittered { seed: 1 },
    PointLayout::BlueNoise { seed: 1 },
];

/// Name of an estimator as on the command line.
pub fn estimator_name(estimator: Estimator) -> &'static str {
    match estimator {
        Estimator::PerLight => "per-light",
        Estimator::Directional => "directional",
        Estimator::Ratio => "ratio",
        Estimator::Paper => "paper",
    }
}

/// Name of a layout as in the scene file.
pub fn layout_name(layout: &PointLayout) -> &'static str {
    match layout {
        PointLayout::Regular => "regular",
        PointLayout::BodyCentred => "body-centred",
        PointLayout::Jittered { .. } => "jittered",
        PointLayout::BlueNoise { .. } => "blue-noise",
        PointLayout::List(_) => "list",
    }
}

impl Configuration {
    /// The settings of a frame.
    ///
    /// Nothing is done against leaks: leaves are no walls, and the reference averages over the same points.
    pub fn settings(&self, base: &Settings, resolution: (u32, u32)) -> Settings {
        Settings {
            resolution,
            integrator: Integrator::LightMesh,
            light_mesh: LightMeshSettings {
                estimator: self.estimator,
                points: PointSettings {
                    layout: self.layout.clone(),
                    spacing: Spacing::Units(Vec3::splat(self.spacing)),
                    radius: Radius::Units(self.radius),
                    leaks: Leaks::Allow,
                    ..PointSettings::default()
                },
                ..LightMeshSettings::default()
            },
            ..base.clone()
        }
    }

    /// The settings of what it approximates.
    pub fn reference(&self, base: &Settings, resolution: (u32, u32), samples: u32) -> Settings {
        Settings {
            integrator: Integrator::Reference,
            reference_samples: samples,
            ..self.settings(base, resolution)
        }
    }
}

/// The settings of conventional tracing.
pub fn conventional(base: &Settings, resolution: (u32, u32)) -> Settings {
    Settings { resolution, integrator: Integrator::Conventional, ..base.clone() }
}

impl fmt::Display for Configuration {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (estimator, layout) = (estimator_name(self.estimator), layout_name(&self.layout));
        write!(f, "{estimator}, {layout}, spacing {}, R {}", self.spacing, self.radius)
    }
}
