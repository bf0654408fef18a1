//! The light-mesh settings that are tried.

use std::fmt;

use glam::Vec3;

use crate::settings::{
    Estimator, Integrator, KernelSettings, Leaks, MeshSettings, Named, PointLayout, PointSettings, Radius,
    Settings, ShadingSettings, Spacing,
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
    /// Coarser lattices that the points build on.
    pub levels: u32,
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

/// Name of a layout as in the scene file.
pub fn layout_name(layout: &PointLayout) -> &'static str {
    layout.name().map_or("list", Named::name)
}

impl Configuration {
    /// The settings of a frame.
    ///
    /// Nothing is done against leaks: leaves are no walls, and the reference averages over the same points.
    pub fn settings(&self, base: &Settings, resolution: (u32, u32)) -> Settings {
        let mut settings = of_size(base, resolution);
        settings.mesh = MeshSettings {
            direct: PointSettings {
                layout: self.layout.clone(),
                spacing: Spacing::Units(Vec3::splat(self.spacing)),
                regions: Vec::new(),
                levels: self.levels,
            },
            indirect: None,
        };
        settings.shading = ShadingSettings {
            integrator: Integrator::LightMesh,
            estimator: self.estimator,
            kernel: KernelSettings {
                radius: Radius::Units(self.radius),
                leaks: Leaks::Allow,
                ..KernelSettings::default()
            },
            ..ShadingSettings { lambertian: base.shading.lambertian, ..ShadingSettings::default() }
        };
        settings
    }

    /// The settings of what it approximates.
    pub fn reference(&self, base: &Settings, resolution: (u32, u32), samples: u32) -> Settings {
        reference(&self.settings(base, resolution), samples)
    }
}

/// The settings of what a light mesh approximates.
pub fn reference(settings: &Settings, samples: u32) -> Settings {
    let mut settings = settings.clone();
    settings.shading.integrator = Integrator::Reference;
    settings.shading.reference_samples = samples;
    settings
}

/// The settings for images of another size. Pixels have one sample each: what is compared is light, which more samples share, and not
/// camera rays, which are the same either way.
fn of_size(base: &Settings, resolution: (u32, u32)) -> Settings {
    let mut settings = base.clone();
    settings.view.resolution = resolution;
    settings.view.samples_per_pixel = 1;
    settings
}

/// The settings that the scene has, with its light mesh.
pub fn as_it_is(base: &Settings, resolution: (u32, u32)) -> Settings {
    let mut settings = of_size(base, resolution);
    settings.shading.integrator = Integrator::LightMesh;
    settings
}

/// The settings of conventional tracing.
pub fn conventional(base: &Settings, resolution: (u32, u32)) -> Settings {
    let mut settings = of_size(base, resolution);
    settings.shading.integrator = Integrator::Conventional;
    settings
}

impl fmt::Display for Configuration {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (estimator, layout) = (self.estimator, layout_name(&self.layout));
        write!(f, "{estimator}, {layout}, spacing {}, R {}", self.spacing, self.radius)?;
        if self.levels > 0 { write!(f, ", levels {}", self.levels) } else { Ok(()) }
    }
}
