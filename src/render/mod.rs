//! Rendering as a wavefront (method §9): trace → need → evaluate → shade → film, for one block of tiles after the other.
//!
//! [`Session`] does it all for one scene. Whoever wants the stages for themselves calls
//! [`trace_paths`], [`needed_points`], [`DirectMesh::evaluate`](crate::light_mesh::direct::DirectMesh::evaluate),
//! [`shade_tile`] with an [integrator](integrators), and [`resolve`].

mod accuracy;
mod choice;
mod error;
mod film;
mod fixed;
mod frame;
mod held_out;
pub mod integrators;
mod known_view;
mod layers;
mod measured;
mod memory;
mod merge;
mod mesh_file;
mod meshes;
mod moving;
mod need;
mod paths;
mod reason;
mod scene_lights;
mod session;
mod settled;
mod shadow_edges;
mod spared;
mod stats;
mod steps;
mod surface_group;
mod surface_light;
mod tiles;
mod trace;

pub use accuracy::{Accuracy, Ending, ErrorEstimate, Measure};
pub use error::{RenderError, SessionError};
pub use film::{TileSink, resolve};
pub use frame::{BlockIntegrator, StopToken, shade_tile};
pub use layers::{FirstHits, Layer, LayerChannel, LayerChoice, LayerCollector, LayerImage, LightParts};
pub use mesh_file::{
    LightMeshSummary, RestoredMeshes, WriteMeshesError, light_mesh_summary, read_known_points,
};
pub(crate) use meshes::surface_width;
pub use meshes::{LightMeshes, MeshInterpolation};
pub use moving::Moved;
pub use need::needed_points;
pub use paths::{PathVertex, TilePaths};
pub use reason::{Choice, Reason};
pub use session::{Session, render};
pub use settled::Settled;
pub use spared::SparedRays;
pub use stats::{
    HybridError, MeshCounters, PointCounters, RayCounters, RenderStats, ShadeCounters, StageSeconds,
};
pub use tiles::{TILE, Tile};
pub use trace::trace_paths;
