//! Values at points, for other programs: VTK's XML formats, which ParaView opens, and PLY (docs/probes.md).
//!
//! A [`PointField`] is plain data, whoever filled it; [`PointField::of_known`] does so with the known points of a light mesh, and
//! [`GridField::of_known`] makes a regular grid of those that lie on one.

mod field;
mod grid;
mod ply;
mod vtk;

pub use field::{PointField, Values};
pub use grid::{GridError, GridField};
pub use ply::encode_ply;
pub use vtk::{ImageGrid, encode_vti, encode_vtu};
