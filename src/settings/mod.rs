//! How a scene is rendered: every choice that is not part of the scene itself.
//!
//! Settings fall into four parts, by what a change of them costs: what a view is, what identifies the values of mesh points (a
//! change there means other points), how surface points are shaded from them (a change there keeps all known values), and how
//! files are written.

mod check;
mod mesh;
mod names;
mod shading;
mod view;

pub use check::SettingsError;
pub use mesh::{
    IndirectForm, IndirectSettings, LayoutName, MeshSettings, PointLayout, PointSettings, Region, Spacing,
};
pub use names::{Named, UnknownName};
pub use shading::{
    Estimator, IndirectShading, Integrator, KernelSettings, Leaks, Neighbourhood, Normalization, Radius,
    Resolve, ShadingSettings,
};
pub use view::ViewSettings;

pub(crate) use names::named_enum;

/// The range of exposures in stops: from −`MAX_EXPOSURE` to `MAX_EXPOSURE`.
pub const MAX_EXPOSURE: f32 = 100.0;

/// Settings of one render.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Settings {
    /// What a view is, beside its camera.
    pub view: ViewSettings,
    /// What identifies the values of mesh points.
    pub mesh: MeshSettings,
    /// How surface points are shaded.
    pub shading: ShadingSettings,
    /// How files are written.
    pub output: OutputSettings,
}

/// How images are written.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OutputSettings {
    /// Exposure of tone-mapped images in stops, at most [`MAX_EXPOSURE`] either way.
    pub exposure: f32,
}
