//! Renderer for large triangle scenes with many lights, by Debelov and Sevastyanov's light meshes.

#![warn(clippy::unwrap_used, clippy::expect_used)]

pub mod accel;
#[cfg(feature = "cli")]
mod bench;
#[cfg(feature = "cli")]
pub mod cli;
mod color;
#[cfg(feature = "cli")]
pub mod crosscheck;
pub mod framing;
pub mod image;
pub mod light_mesh;
pub mod render;
pub mod scene;
pub mod settings;
pub mod simd;
