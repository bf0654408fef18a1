//! All settings of a render, in one value.

use super::limits::Limits;
use super::mesh::{IndirectForm, IndirectSettings, MeshSettings, Spacing};
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
    /// When the picture is good enough.
    pub limits: Limits,
}

impl Settings {
    /// Adds indirect light if there is none, and lets its form, points and kernel follow from the settings of direct light (method §5).
    pub fn derive_indirect(&mut self) -> &mut IndirectSettings {
        let Self { mesh, shading, .. } = self;
        let indirect = mesh.indirect.get_or_insert_default();
        indirect.form = if shading.lambertian { IndirectForm::Surface } else { IndirectForm::Directional };
        indirect.points = IndirectSettings::coarser_points(&mesh.direct);
        if indirect.form == IndirectForm::Surface {
            // Points on surfaces have nothing to do with a lattice for direct light.
            indirect.points.spacing = Spacing::Auto;
        }
        shading.indirect.kernel = IndirectSettings::wider_kernel(&shading.kernel);
        indirect
    }
}
