//! What identifies the values of mesh points: where the points lie, and how indirect light is gathered at them.

use std::sync::Arc;

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::names::named_enum;
use super::shading::{KernelSettings, Radius};
use crate::Bounds;

/// The light meshes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshSettings {
    /// Points of the direct light mesh.
    pub direct: PointSettings,
    /// The indirect light mesh; `None` for direct light alone.
    pub indirect: Option<IndirectSettings>,
}

/// Where mesh points lie (method §8).
#[derive(Clone, Debug, PartialEq)]
pub struct PointSettings {
    /// How the points are laid out.
    pub layout: PointLayout,
    /// Distance between neighbouring mesh points.
    pub spacing: Spacing,
    /// Boxes with a spacing and radius of their own; where they overlap, the last one holds.
    pub regions: Vec<Region>,
    /// How often the spacing is doubled to get to the points from which all lights are traced; points between them trace those alone on which the
    /// coarser ones around them disagree (method §8). 0 to [`PointSettings::MOST_LEVELS`].
    pub levels: u32,
}

impl PointSettings {
    /// More levels would begin with points that know nothing of each other's surroundings.
    pub const MOST_LEVELS: u32 = 4;
}

impl Default for PointSettings {
    fn default() -> Self {
        Self { layout: PointLayout::Regular, spacing: Spacing::Auto, regions: Vec::new(), levels: 0 }
    }
}

/// How the values of the indirect light mesh come about (method §5).
#[derive(Clone, Debug, PartialEq)]
pub struct IndirectSettings {
    /// Points of the indirect light mesh, which may differ from those of the direct one.
    pub points: PointSettings,
    /// N, the number of directions traced from each mesh point, at least 1.
    pub directions: u32,
    /// Occlusion rays from each mesh point to points on emissive triangles, so that small lamps don't come out as noise; 0
    /// leaves them to the directions alone, as in the paper.
    pub emitter_samples: u32,
    /// Times that light is passed on between surfaces, at least 1; 1 is the paper's.
    pub bounces: u32,
    /// Further bounces end when no value changes by more than this share of the mesh's largest value.
    pub tolerance: f32,
    /// What is kept per mesh point.
    pub form: IndirectForm,
}

impl IndirectSettings {
    /// Indirect light varies slowly: unless settings say otherwise, spacing and radius are this many times the direct mesh's.
    pub const COARSENESS: f32 = 2.0;

    /// Bounces after which hardly any light is left.
    pub const ALL_BOUNCES: u32 = 64;

    /// Points for indirect light, given those for direct light.
    pub fn coarser_points(points: &PointSettings) -> PointSettings {
        // What a point gathers has no bits on which neighbours could agree.
        let mut points = PointSettings { levels: 0, ..points.clone() };
        let spacing = |spacing: Vec3| spacing * Self::COARSENESS;
        if let Spacing::Units(units) = points.spacing {
            points.spacing = Spacing::Units(spacing(units));
        }
        for region in &mut points.regions {
            region.spacing = region.spacing.map(spacing);
            region.radius = region.radius.map(|radius| radius * Self::COARSENESS);
        }
        points
    }

    /// The kernel for indirect light, given that for direct light.
    pub fn wider_kernel(kernel: &KernelSettings) -> KernelSettings {
        let radius = match kernel.radius {
            Radius::Units(radius) => Radius::Units(radius * Self::COARSENESS),
            spacings @ Radius::Spacings(_) => spacings,
        };
        KernelSettings { radius, ..kernel.clone() }
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
            form: IndirectForm::Directional,
        }
    }
}

named_enum! {
    /// What the indirect light mesh keeps per point.
    pub enum IndirectForm {
        /// One RGB value, whatever the surface's normal: the paper's
        Scalar = "scalar",
        /// Irradiance by normal
        Directional = "directional",
        /// Points on surfaces
        Surface = "surface",
    }
}

/// Layout of mesh points (method §8).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum PointLayout {
    /// Regular grid: the paper's.
    Regular,
    /// Corners and centres of cells whose edge is the spacing.
    BodyCentred,
    /// One point anywhere in each cell of a regular grid.
    Jittered {
        /// Seed of the jitter.
        seed: u64,
    },
    /// As dense as the regular grid, without its rows.
    BlueNoise {
        /// Seed of the layout.
        seed: u64,
    },
    /// Given positions, at least one, finite; there is no spacing.
    List(Arc<Vec<Vec3>>),
}

named_enum! {
    /// The layouts that are made by rule, by name.
    pub enum LayoutName {
        /// Regular grid: the paper's
        Regular = "regular",
        /// Corners and centres of cells whose edge is the spacing
        BodyCentred = "body-centred",
        /// One point anywhere in each cell of a regular grid
        Jittered = "jittered",
        /// As dense as the regular grid, without its rows
        BlueNoise = "blue-noise",
    }
}

impl PointLayout {
    /// The layout of a name; `seed` is that of random ones.
    pub fn of_name(name: LayoutName, seed: u64) -> Self {
        match name {
            LayoutName::Regular => Self::Regular,
            LayoutName::BodyCentred => Self::BodyCentred,
            LayoutName::Jittered => Self::Jittered { seed },
            LayoutName::BlueNoise => Self::BlueNoise { seed },
        }
    }

    /// Its name; `None` for a list.
    pub fn name(&self) -> Option<LayoutName> {
        match self {
            Self::Regular => Some(LayoutName::Regular),
            Self::BodyCentred => Some(LayoutName::BodyCentred),
            Self::Jittered { .. } => Some(LayoutName::Jittered),
            Self::BlueNoise { .. } => Some(LayoutName::BlueNoise),
            Self::List(_) => None,
        }
    }
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

/// Distance between neighbouring mesh points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Spacing {
    /// From the scene's size.
    Auto,
    /// Per axis, scene units, > 0.
    Units(Vec3),
}

impl Spacing {
    /// Name of [`Spacing::Auto`] where a number may stand.
    pub(crate) const AUTO: &str = "auto";
}
