//! Lights as the inner loops take them: packed sixteen to a chunk, their falloff as a type, and the triangles that emit.

mod chunk;
mod emissive;
mod emitters;
mod falloff;
mod groups;
mod kinds;
mod packed;
mod shape;
mod visibility;

pub(crate) use chunk::LightChunk;
pub use emissive::EmissiveTriangles;
pub(crate) use emitters::emitters;
pub(crate) use groups::PackedGroups;
pub use packed::PackedLights;
pub(crate) use packed::{IncidentLights, SurfaceLanes};
pub(crate) use shape::lamp_numbers;
pub(crate) use visibility::{HalfSeenLights, SeenLights, VisibilityBits, expand_bits};
// For tests and benches only.
#[doc(hidden)]
pub use visibility::{Unoccluded, Visibility};
