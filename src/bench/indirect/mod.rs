//! Light from surfaces: time, rays and error over the number of directions.

mod result;
mod run;

pub use result::IndirectCurve;
pub use run::run;
