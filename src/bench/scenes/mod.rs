//! Scenes of any kind by both ways, light mesh and conventional tracing, and whether `auto` takes the cheaper one.

mod find;
mod measure;
mod result;
mod run;
mod show;

pub use find::scene_files;
pub use result::{Failure, SceneResults};
pub use run::run;
