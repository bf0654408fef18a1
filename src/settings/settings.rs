//! All settings of a render, in one value.

use super::mesh::MeshSettings;
use super::output::OutputSettings;
use super::shading::ShadingSettings;
use super::view::ViewSettings;

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
