//! Values at points, for other programs: VTK's XML formats, which ParaView opens, and PLY (docs/probes.md).
//!
//! A [`PointField`] is plain data, whoever filled it; [`PointField::of_known`] does so with the known points of a light mesh.

mod field;
mod ply;
mod vtk;

pub use field::{PointField, Values};
pub use ply::encode_ply;
pub use vtk::{ImageGrid, encode_vti, encode_vtu};
