//! Lights as the inner loops take them: packed sixteen to a chunk, their falloff as a type, and the triangles that emit.

mod emissive;
mod falloff;
mod kinds;
mod packed;
mod visibility;

pub use emissive::EmissiveTriangles;
pub use packed::{IncidentLights, LightChunk, PackedLights};
pub use visibility::{VisibilityBits, expand_bits};
