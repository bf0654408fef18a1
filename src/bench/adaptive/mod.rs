//! Light meshes whose points trace only what coarser ones around them disagree on, and those that are chosen by their error, against uniform ones.

mod curve;
mod measure;
mod result;
mod run;
mod show;

pub use result::AdaptiveScene;
pub use run::run;
