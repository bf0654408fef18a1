//! Where mesh points lie: positions and their ids, the kernel around a surface point, and the points within it. No file of this folder
//! knows which values are kept at the points.

mod cells;
mod ids;
mod kernel;
mod lattice;
mod list;
mod neighbourhoods;
mod neighbours;
mod periodic;
mod point_set;
mod rounded_box;

pub(crate) use cells::{CellCache, PointPacket, Surroundings};
pub(crate) use kernel::Kernel;
pub use lattice::LayerGrid;
pub use neighbourhoods::{AutoSpacing, Neighbourhoods};
pub use neighbours::Neighbours;
pub use point_set::{MeshError, PointSet};
