//! How light meshes are interpolated where indirect light is gathered and shaded.

use crate::light_mesh::direct::DirectInterpolation;
use crate::light_mesh::points::Neighbourhoods;
use crate::settings::IndirectShading;

/// How surface points interpolate an indirect mesh.
pub struct IndirectInterpolation {
    /// The kernel.
    pub(crate) neighbourhoods: Neighbourhoods,
    /// The settings that it follows from.
    pub(crate) shading: IndirectShading,
}

/// How surfaces send on the direct light that indirect mesh points receive.
#[derive(Clone, Copy)]
pub struct DirectTransport<'a> {
    /// How hits interpolate the direct mesh.
    pub interpolation: &'a DirectInterpolation,
    /// What I(y) is multiplied by before k_d.
    pub scale: f32,
}
