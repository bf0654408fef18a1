//! Scenes made by rule, for benchmarks and images.

mod error;
mod files;
pub mod forest;
pub mod interior;
mod shapes;
pub mod still_life;

pub use error::GenerateError;
