//! How a scene is rendered: every choice that is not part of the scene itself.
//!
//! Settings fall into five parts, by what a change of them costs: what a view is, what identifies the values of mesh points (a
//! change there means other points), how surface points are shaded from them (a change there keeps all known values), how
//! files are written, and when a picture is good enough.

mod check;
mod limits;
mod mesh;
mod names;
mod output;
mod settings;
mod shading;
mod view;

pub use check::SettingsError;
pub use limits::{Limits, Step, Steps};
pub use mesh::{
    IndirectForm, IndirectSettings, LayoutName, MeshSettings, PointLayout, PointSettings, Region, Spacing,
};
pub use names::{Named, UnknownName};
pub use output::{MAX_EXPOSURE, OutputSettings};
pub use settings::Settings;
pub use shading::{
    Estimator, IndirectShading, Integrator, KernelSettings, Leaks, Neighbourhood, Normalization, Radius,
    Resolve, ShadingSettings, Shadows,
};
pub use view::{MAX_FILTER_WIDTH, PixelFilter, ViewSettings};

pub(crate) use names::named_enum;
