//! Layers of an image: the parts that its light is the sum of, and what its pixels show.
//!
//! While paths are traced, [`FirstHits`] keeps what camera rays meet first. Shading fills [`LightParts`], and a `LayerRecord` makes of both
//! the pixels of a tile in every layer. A [`LayerCollector`] keeps the finished layers of the last pictures. Without one nothing of this
//! is computed.

mod collect;
mod cryptomatte;
mod first_hits;
mod layer_image;
mod parts;
mod record;

pub use collect::LayerCollector;
pub use first_hits::FirstHits;
pub use layer_image::{LayerChannel, LayerImage};
pub use parts::LightParts;

pub(in crate::render) use parts::GroupLight;
pub(in crate::render) use record::LayerRecord;

use crate::settings::named_enum;

named_enum! {
    /// A layer of an image.
    pub enum Layer {
        /// light of lamps, once reflected by the surface that is seen
        Direct = "direct",
        /// light that came to that surface by way of others
        Indirect = "indirect",
        /// what the surface emits, and the background
        Emission = "emission",
        /// everything that is seen by way of a mirror
        Reflection = "reflection",
        /// k_d + k_s of the surface, 0 for the background
        Albedo = "albedo",
        /// shading normal in world space, towards the viewer
        Normal = "normal",
        /// distance along the view direction, infinite for the background
        Depth = "depth",
        /// position in world space
        Position = "position",
        /// which object is seen, as Cryptomatte
        Object = "object",
        /// which material is seen, as Cryptomatte
        Material = "material",
        /// mesh points that light is interpolated from
        MeshPoints = "mesh-points",
        /// estimated error of direct light
        Error = "error",
    }
}

/// The layers that are asked for.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LayerChoice {
    /// Layers, each once.
    pub layers: Vec<Layer>,
    /// Whether there is a layer of direct light for each group of lights.
    pub light_groups: bool,
}

impl LayerChoice {
    /// Whether none is.
    pub fn is_empty(&self) -> bool {
        self.layers.is_empty() && !self.light_groups
    }

    fn has(&self, layer: Layer) -> bool {
        self.layers.contains(&layer)
    }
}
