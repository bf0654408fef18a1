//! How a scene is rendered: every choice that is not part of the scene itself.
//!
//! Plain values, checked where they are read (scene file or command line); the rest of the library
//! relies on the ranges stated here.

use std::sync::Arc;

use glam::Vec3;

use crate::scene::Bounds;

/// The range of exposures in stops: from −`MAX_EXPOSURE` to `MAX_EXPOSURE`.
pub const MAX_EXPOSURE: f32 = 100.0;

/// Settings of one render.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Width and height in pixels, each at least 1.
    pub resolution: (u32, u32),
    /// Camera rays per pixel, at least 1.
    pub samples_per_pixel: u32,
    /// What computes the illumination of a surface point.
    pub integrator: Integrator,
    /// With [`Integrator::Reference`]: positions in D_y at which the field is evaluated, at least 1.
    pub reference_samples: u32,
    /// Longest path, counted in surface points: 1 is the camera ray's alone.
    pub max_depth: u32,
    /// A path ends where its weight (the product of the k_s so far) falls below this in all channels.
    pub weight_threshold: f32,
    /// Exposure of tone-mapped pictures in stops, at most [`MAX_EXPOSURE`] either way.
    pub exposure: f32,
    /// Samples per image block, which bounds the memory for camera paths and never changes the picture;
    /// `None` for a good default.
    pub block_pixels: Option<u64>,
    /// Surfaces are Lambertian reflectors of albedo k_d, so that direct light counts k_d/π (spec §12); otherwise k_d
    /// alone, as in the paper.
    pub lambertian: bool,
    /// The light meshes.
    pub light_mesh: LightMeshSettings,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            resolution: (800, 600),
            samples_per_pixel: 1,
            integrator: Integrator::LightMesh,
            reference_samples: 256,
            max_depth: 5,
            weight_threshold: 1e-3,
            exposure: 0.0,
            block_pixels: None,
            lambertian: false,
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
    /// What a light mesh of infinite density would give, by dense sampling of D_y around every surface point. Slow;
    /// pictures of light meshes are measured against it.
    Reference,
}

/// Settings of the light meshes.
#[derive(Clone, Debug, PartialEq)]
pub struct LightMeshSettings {
    /// Points of the direct light mesh.
    pub points: PointSettings,
    /// How direct illumination follows from the mesh.
    pub estimator: Estimator,
    /// With [`Estimator::PerLight`]: what happens to lights on which the points of D_y disagree.
    pub resolve: Resolve,
    /// The indirect light mesh; `None` for direct light alone.
    pub indirect: Option<IndirectSettings>,
}

impl Default for LightMeshSettings {
    fn default() -> Self {
        Self {
            points: PointSettings::default(),
            estimator: Estimator::PerLight,
            resolve: Resolve::Average,
            indirect: None,
        }
    }
}

/// Where mesh points lie, and which of them a surface point takes (spec §3, §8).
#[derive(Clone, Debug, PartialEq)]
pub struct PointSettings {
    /// How the points are laid out.
    pub layout: PointLayout,
    /// Distance between neighbouring mesh points.
    pub spacing: Spacing,
    /// Radius R of D_y.
    pub radius: Radius,
    /// Shape and weights of D_y.
    pub neighbourhood: Neighbourhood,
    /// Drop points of D_y behind the tangent plane at y.
    pub hemisphere: bool,
    /// What keeps light from leaking through walls.
    pub leaks: Leaks,
    /// Boxes with a spacing and radius of their own; where they overlap, the last one holds.
    pub regions: Vec<Region>,
}

impl Default for PointSettings {
    fn default() -> Self {
        Self {
            layout: PointLayout::Regular,
            spacing: Spacing::Auto,
            radius: Radius::Spacings(2.0),
            neighbourhood: Neighbourhood::SmoothSphere,
            hemisphere: true,
            leaks: Leaks::Visibility,
            regions: Vec::new(),
        }
    }
}

/// Settings of the indirect light mesh (spec §5).
#[derive(Clone, Debug, PartialEq)]
pub struct IndirectSettings {
    /// Points of the indirect light mesh, which may differ from those of the direct one.
    pub points: PointSettings,
    /// N, the number of directions traced from each mesh point, at least 1.
    pub directions: u32,
    /// Occlusion rays from each mesh point to points on surfaces that shine, so that small lamps don't come out as noise; 0
    /// leaves them to the directions alone, as in the paper.
    pub emitter_samples: u32,
    /// Times that light is passed on between surfaces, at least 1; 1 is the paper's.
    pub bounces: u32,
    /// Further bounces end when no value changes by more than this share of the mesh's largest value.
    pub tolerance: f32,
    /// Extrapolate the field to the surface, along its normal, instead of taking the mean over D_y, which is the field a few
    /// tenths of R in front of it.
    pub at_surface: bool,
    /// What is kept per mesh point.
    pub form: IndirectForm,
    /// Scale of the stored values.
    pub normalization: Normalization,
}

impl IndirectSettings {
    /// Indirect light varies slowly: unless told otherwise, spacing and radius are this many times the direct mesh's.
    pub const COARSENESS: f32 = 2.0;

    /// Points for indirect light, given those for direct light.
    pub fn coarser(points: &PointSettings) -> PointSettings {
        let mut points = points.clone();
        let spacing = |spacing: Vec3| spacing * Self::COARSENESS;
        if let Spacing::Units(units) = points.spacing {
            points.spacing = Spacing::Units(spacing(units));
        }
        if let Radius::Units(radius) = points.radius {
            points.radius = Radius::Units(radius * Self::COARSENESS);
        }
        for region in &mut points.regions {
            region.spacing = region.spacing.map(spacing);
            region.radius = region.radius.map(|radius| radius * Self::COARSENESS);
        }
        points
    }
}

impl Default for IndirectSettings {
    fn default() -> Self {
        Self {
            points: PointSettings::default(),
            directions: 256,
            emitter_samples: 32,
            bounces: 1,
            tolerance: 1e-3,
            at_surface: false,
            form: IndirectForm::Directional,
            normalization: Normalization::Mean,
        }
    }
}

/// What the indirect light mesh keeps per point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IndirectForm {
    /// One RGB value, whatever the surface's normal: the paper's.
    Scalar,
    /// Irradiance by normal.
    Directional,
}

/// Scale of IndirectLight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Normalization {
    /// Mean over directions: the integral of eq. (4) over 4π.
    Mean,
    /// The integral as printed.
    Integral,
}

/// Layout of mesh points (spec §8).
#[derive(Clone, Debug, PartialEq)]
pub enum PointLayout {
    /// Regular grid: the paper's.
    Regular,
    /// Corners and centres of cubes whose edge is the spacing.
    BodyCentred,
    /// One point anywhere in each cube of a regular grid.
    Jittered {
        /// Seed of the jitter.
        seed: u64,
    },
    /// As dense as the regular grid, without its rows.
    BlueNoise {
        /// Seed of the layout.
        seed: u64,
    },
    /// Given positions, at least one; there is no spacing.
    List(Arc<Vec<Vec3>>),
}

/// Box within which spacing and radius differ.
#[derive(Clone, Debug, PartialEq)]
pub struct Region {
    /// The box, world space.
    pub bounds: Bounds,
    /// Spacing there; `None` for that of the whole.
    pub spacing: Option<Vec3>,
    /// R there, scene units; `None` for what the radius setting gives with the region's spacing.
    pub radius: Option<f32>,
}

/// What keeps light from leaking through walls, and darkness out of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Leaks {
    /// Nothing: all points of D_y count.
    Allow,
    /// Points that see mostly back faces of one-sided surfaces lie inside of something and don't count.
    Invalidate,
    /// Where the points of D_y disagree, only those count that the surface point sees.
    Visibility,
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
