//! What light comes to: formulas, limits, references, and the economy of rays.

#[path = "../common/mod.rs"]
mod common;

mod accuracy;
mod antialiasing;
mod auto;
mod convergence;
mod determinism;
mod estimators;
mod frames;
mod furnace;
mod hybrid;
mod lamps;
mod layers;
mod lazy;
mod leaks;
mod levels;
mod mesh_file;
mod moving;
mod penumbra;
mod physical;
mod probe;
mod real_scenes;
mod reference;
mod rows;
mod session;
mod spared_rays;
