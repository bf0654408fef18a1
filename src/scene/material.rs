//! Surface materials.

use glam::Vec3;

use super::alpha_mask::AlphaMask;
use super::texture::TextureMap;

/// Material of a surface: the paper's k_d, k_s and Emiss, and its sides (docs/method.md §7).
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Name from the file, for messages and overrides.
    pub name: String,
    /// k_d, linear RGB.
    pub diffuse: Vec3,
    /// k_s of the mirror reflection, linear RGB.
    pub specular: Vec3,
    /// Emiss, linear RGB; leaves the front side only unless `two_sided`.
    pub emission: Vec3,
    /// Whether a [`Light`](super::Light) stands for what it emits, which then is seen, but lights nothing itself.
    pub lamp: bool,
    /// Whether front and back are alike.
    pub two_sided: bool,
    /// Whether camera and reflected rays pass through the back of a one-sided surface.
    pub cull: bool,
    /// Image that multiplies k_d.
    pub diffuse_map: Option<TextureMap>,
    /// Image that multiplies Emiss.
    pub emission_map: Option<TextureMap>,
    /// Where the surface is opaque; `None` for everywhere.
    pub alpha_mask: Option<AlphaMask>,
}

impl Material {
    /// A material that reflects light diffusely.
    pub fn diffuse(color: Vec3) -> Self {
        Self { diffuse: color, ..Self::default() }
    }
}

impl Default for Material {
    fn default() -> Self {
        Self {
            name: String::new(),
            diffuse: Vec3::splat(0.8),
            specular: Vec3::ZERO,
            emission: Vec3::ZERO,
            lamp: false,
            two_sided: false,
            cull: false,
            diffuse_map: None,
            emission_map: None,
            alpha_mask: None,
        }
    }
}
