//! Renderer for large triangle scenes with many lights, by Debelov and Sevastyanov's light meshes.

#![warn(clippy::unwrap_used, clippy::expect_used)]

pub mod accel;
#[cfg(feature = "cli")]
mod bench;
mod bounds;
#[cfg(feature = "cli")]
pub mod cli;
mod color;
#[cfg(feature = "cli")]
pub mod crosscheck;
pub mod framing;
pub mod image;
pub mod light_mesh;
pub mod lights;
pub mod render;
pub mod sampling;
pub mod scene;
pub mod settings;
pub mod simd;
mod world;

pub use bounds::Bounds;
pub use world::World;
