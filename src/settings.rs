//! How a scene is rendered: every choice that is not part of the scene itself.
//!
//! Plain values, checked where they are read (scene file or command line); the rest of the library
//! relies on the ranges stated here.

use glam::Vec3;

/// Settings of one render.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Width and height in pixels, each at least 1.
    pub resolution: (u32, u32),
    /// Camera rays per pixel, at least 1.
    pub samples_per_pixel: u32,
    /// What computes the illumination of a surface point.
    pub integrator: Integrator,
    /// Longest path, counted in surface points: 1 is the camera ray's alone.
    pub max_depth: u32,
    /// A path ends where its weight (the product of the k_s so far) falls below this in all channels.
    pub weight_threshold: f32,
    /// Exposure of tone-mapped pictures, in stops.
    pub exposure: f32,
    /// Samples per image block, which bounds the memory for camera paths and never changes the picture;
    /// `None` for a good default.
    pub block_pixels: Option<u64>,
    /// The light meshes.
    pub light_mesh: LightMeshSettings,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            resolution: (800, 600),
            samples_per_pixel: 1,
            integrator: Integrator::LightMesh,
            max_depth: 5,
            weight_threshold: 1e-3,
            exposure: 0.0,
            block_pixels: None,
            light_mesh: LightMeshSettings::default(),
        }
    }
}

/// What computes the illumination of a surface point (spec §10).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Integrator {
    /// Interpolation of light meshes.
    LightMesh,
    /// One occlusion ray per light at every surface point.
    Conventional,
}

/// Settings of the light meshes.
#[derive(Clone, Debug, PartialEq)]
pub struct LightMeshSettings {
    /// Distance between neighbouring mesh points.
    pub spacing: Spacing,
    /// Radius R of D_y.
    pub radius: Radius,
    /// Shape and weights of D_y.
    pub neighbourhood: Neighbourhood,
    /// Drop points of D_y behind the tangent plane at y.
    pub hemisphere: bool,
    /// How direct illumination follows from the mesh.
    pub estimator: Estimator,
    /// With [`Estimator::PerLight`]: what happens to lights on which the points of D_y disagree.
    pub resolve: Resolve,
}

impl Default for LightMeshSettings {
    fn default() -> Self {
        Self {
            spacing: Spacing::Auto,
            radius: Radius::Spacings(2.0),
            neighbourhood: Neighbourhood::SmoothSphere,
            hemisphere: true,
            estimator: Estimator::PerLight,
            resolve: Resolve::Average,
        }
    }
}

/// Distance between neighbouring mesh points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Spacing {
    /// From the scene's size.
    Auto,
    /// Per axis, scene units, > 0.
    Units(Vec3),
}

/// Radius of the interpolation neighbourhood, > 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Radius {
    /// In scene units.
    Units(f32),
    /// In multiples of the largest of the three spacings.
    Spacings(f32),
}

/// Shape and weights of D_y (spec §3).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Neighbourhood {
    /// The one nearest mesh point.
    Nearest,
    /// All points within R, equal weights: the paper's.
    Sphere,
    /// All points within R, weight (1 − r²/R²)².
    SmoothSphere,
}

/// How direct illumination follows from the mesh (spec §4).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Estimator {
    /// Eq. (2) as printed; quadratic in the light intensities.
    Paper,
    /// Mean of DirectLight over mean of the unoccluded DirectLight, times S(y).
    Ratio,
    /// Mean visibility of every light.
    PerLight,
    /// Irradiance by normal from a second-order basis; its cost per pixel doesn't depend on the lights.
    Directional,
}

/// What `per-light` does with lights on which the points of D_y disagree (spec §4, hybrid shadows).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Resolve {
    /// Their mean visibility: soft shadows.
    Average,
    /// One occlusion ray from the surface point: the sharp shadows of `conventional`.
    Trace,
}
