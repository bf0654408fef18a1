//! How surface points are shaded. No change of these makes a known mesh point's visibility unknown.

use super::names::named_enum;

/// How surface points are shaded.
#[derive(Clone, Debug, PartialEq)]
pub struct ShadingSettings {
    /// What computes the illumination of a surface point.
    pub integrator: Integrator,
    /// With [`Integrator::Reference`]: positions in D_y at which the field is evaluated, at least 1.
    pub reference_samples: u32,
    /// Surfaces are Lambertian reflectors of albedo k_d, so that direct light counts k_d/π (method §12); otherwise k_d
    /// alone, as in the paper.
    pub lambertian: bool,
    /// How direct illumination follows from the direct mesh.
    pub estimator: Estimator,
    /// With [`Estimator::PerLight`]: what happens to lights on which the points of D_y disagree.
    pub resolve: Resolve,
    /// With [`Resolve::Trace`]: what all decisions not to trace a ray may cost, as a share of a pixel's light, from 0 up.
    pub tolerance: f32,
    /// With [`Resolve::Average`]: what light that is interpolated between pixels may be wrong by where it is looked at, as a share of it, from 0 up (method §9). 0 if the
    /// light of every pixel is looked up. A render that measures its error chooses this by itself.
    pub pixel_tolerance: f32,
    /// D_y in the direct mesh.
    pub kernel: KernelSettings,
    /// How indirect light follows from the indirect mesh, if there is one.
    pub indirect: IndirectShading,
}

impl Default for ShadingSettings {
    fn default() -> Self {
        Self {
            integrator: Integrator::Auto,
            reference_samples: 256,
            lambertian: false,
            estimator: Estimator::PerLight,
            resolve: Resolve::Average,
            tolerance: 0.01,
            pixel_tolerance: 0.0,
            kernel: KernelSettings::default(),
            indirect: IndirectShading::default(),
        }
    }
}

impl ShadingSettings {
    /// What I(y) is multiplied by before k_d: 1, or 1/π for Lambertian reflectors (method §12).
    pub fn direct_scale(&self) -> f32 {
        if self.lambertian { std::f32::consts::FRAC_1_PI } else { 1.0 }
    }

    /// Puts the pixel tolerance into them that goes with a picture of so large an error: what it adds is hardly to be seen beside that.
    pub(crate) fn tolerate_pixels(&mut self, max_error: Option<f32>) {
        /// Of the error that is asked for.
        const SHARE: f32 = 1.0 / 16.0;
        self.pixel_tolerance = SHARE * max_error.unwrap_or(0.0);
    }

    /// Whether a light mesh traces the edges of shadows: hybrid shadows (method §4).
    pub fn is_hybrid(&self) -> bool {
        self.resolve == Resolve::Trace && self.estimator == Estimator::PerLight
    }
}

/// How indirect light at a surface point follows from the indirect mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct IndirectShading {
    /// D_y in the indirect mesh.
    pub kernel: KernelSettings,
    /// Extrapolate the field to the surface, along its normal, instead of taking the mean over D_y, which is the field a few
    /// tenths of R in front of it.
    pub at_surface: bool,
    /// Scale of Ĩ_d.
    pub normalization: Normalization,
}

impl Default for IndirectShading {
    fn default() -> Self {
        Self { kernel: KernelSettings::default(), at_surface: false, normalization: Normalization::Mean }
    }
}

/// The neighbourhood D_y, its weights, and which of its points count (method §3).
#[derive(Clone, Debug, PartialEq)]
pub struct KernelSettings {
    /// Radius R of D_y.
    pub radius: Radius,
    /// Shape and weights of D_y.
    pub neighbourhood: Neighbourhood,
    /// Drop points of D_y behind the tangent plane at y.
    pub hemisphere: bool,
    /// What keeps light from leaking through walls.
    pub leaks: Leaks,
}

impl Default for KernelSettings {
    fn default() -> Self {
        Self {
            radius: Radius::Spacings(1.5),
            neighbourhood: Neighbourhood::SmoothSphere,
            hemisphere: true,
            leaks: Leaks::Visibility,
        }
    }
}

/// Radius of the interpolation neighbourhood, > 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Radius {
    /// In scene units.
    Units(f32),
    /// In multiples of the largest of the three spacings.
    Spacings(f32),
}

named_enum! {
    /// What computes the illumination of a surface point (method §10).
    pub enum Integrator {
        /// Light mesh, or conventional where that gives the same shadows for less
        Auto = "auto",
        /// Interpolation of light meshes
        LightMesh = "light-mesh",
        /// One occlusion ray per light at every surface point
        Conventional = "conventional",
        /// What a light mesh of infinite density would give, by dense sampling around every surface point; slow
        Reference = "reference",
    }
}

named_enum! {
    /// What keeps light from leaking through walls, and darkness out of them.
    pub enum Leaks {
        /// All points of D_y count
        Allow = "allow",
        /// Points that see mostly back faces of one-sided surfaces lie inside of something and don't count
        Invalidate = "invalidate",
        /// Where the points of D_y disagree, only those count that the surface point sees
        Visibility = "visibility",
    }
}

named_enum! {
    /// Shape and weights of D_y (method §3).
    pub enum Neighbourhood {
        /// The one nearest mesh point
        Nearest = "nearest",
        /// All points within R, equal weights: the paper's
        Sphere = "sphere",
        /// All points within R, weight (1 − r²/R²)²
        SmoothSphere = "smooth-sphere",
    }
}

named_enum! {
    /// How direct illumination follows from the mesh (method §4).
    pub enum Estimator {
        /// Eq. (2) as printed; quadratic in the light intensities
        Paper = "paper",
        /// Mean of DirectLight over mean of the unoccluded DirectLight, times the sum without visibility
        Ratio = "ratio",
        /// Mean visibility of every light
        PerLight = "per-light",
        /// Irradiance by normal from second-order harmonics; its cost per pixel doesn't depend on the lights
        Directional = "directional",
    }
}

named_enum! {
    /// What `per-light` does with lights on which the points of D_y disagree (method §4, hybrid shadows).
    pub enum Resolve {
        /// Their mean visibility: soft shadows
        Average = "average",
        /// Occlusion rays from surface points: the sharp shadows of `conventional`
        Trace = "trace",
    }
}

named_enum! {
    /// Shadows as they look: the words for [`Resolve`] that scene files and flags have beside its own, since who renders thinks of pictures.
    pub enum Shadows {
        /// Of softness R: the mean of what mesh points see
        Soft = "soft",
        /// As sharp as the sizes of the lamps make them: occlusion rays from surface points
        Sharp = "sharp",
    }
}

impl From<Shadows> for Resolve {
    fn from(shadows: Shadows) -> Self {
        match shadows {
            Shadows::Soft => Self::Average,
            Shadows::Sharp => Self::Trace,
        }
    }
}

named_enum! {
    /// Scale of IndirectLight.
    pub enum Normalization {
        /// Mean over directions: the integral of eq. (4) over 4π
        Mean = "mean",
        /// The integral as printed
        Integral = "integral",
    }
}
