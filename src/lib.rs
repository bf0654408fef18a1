//! Renderer for large triangle scenes with many lights, by Debelov and Sevastyanov's light meshes.

#![warn(clippy::unwrap_used, clippy::expect_used)]

pub mod accel;
pub mod bench;
pub mod cli;
mod color;
pub mod crosscheck;
pub mod framing;
pub mod image;
pub mod light_mesh;
pub mod render;
pub mod scene;
pub mod settings;
pub mod simd;
