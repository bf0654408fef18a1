//! Alpha masks of materials: where rays pass through.

use glam::Vec2;

use super::texture::TextureMap;

/// Where a material is opaque: where `alpha` times the map's coverage reaches `cutoff`.
///
/// Camera, reflected and shadow rays pass through the rest alike.
#[derive(Clone, Debug, PartialEq)]
pub struct AlphaMask {
    /// Image whose coverage counts; `None` for 1 everywhere.
    pub map: Option<TextureMap>,
    /// Factor of the coverage.
    pub alpha: f32,
    /// Least value that is opaque.
    pub cutoff: f32,
}

impl AlphaMask {
    /// Whether the material is opaque at texture coordinates.
    pub fn is_opaque(&self, uv: Vec2) -> bool {
        let coverage = self.map.as_ref().map_or(1.0, |map| map.sample(uv).1);
        self.alpha * coverage >= self.cutoff
    }

    /// Whether the material is opaque everywhere.
    pub(super) fn is_solid(&self) -> bool {
        let transparent = self.map.as_ref().is_some_and(|map| map.texture.has_transparency());
        self.alpha >= self.cutoff && !transparent
    }
}
