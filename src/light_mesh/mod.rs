//! Light meshes: lazily evaluated values at mesh points in free space, interpolated at surfaces (docs/method.md).
//!
//! The words, with what others call them:
//!
//! - *mesh point*: a position in free space at which light is known; elsewhere an irradiance probe.
//! - *light mesh*: a set of mesh points with values; elsewhere a probe volume. *Direct*: what reaches a point from lights.
//!   *Indirect*: what reaches it from surfaces.
//! - *D_y*: the mesh points from which a surface point y takes its light; their weights are an interpolation *kernel* of
//!   radius R.
//! - *layer*: the mesh points of one layout and spacing. *Brick*: 64 points with consecutive ids.
//! - *slot*: where the values of a known point lie in its mesh's arrays.
//! - *estimator*: how direct illumination follows from the points of D_y.
//!
//! The rooms, each of which uses those above it only:
//!
//! | room | what |
//! |---|---|
//! | [`mod@file`] | files of sections that are mapped |
//! | `points` | positions and ids, kernels, finding the points of D_y |
//! | `leaks` | which points of D_y count for a surface point |
//! | `store` | which points are known, and in which slot |
//! | [`lookup`] | the known points of D_y that count |
//! | [`direct`] | visibility of lights at mesh points, and the estimators |
//! | [`indirect`] | gathering at mesh points, bounces, irradiance by normal |
//! | [`surface`] | gathering at points on surfaces, bounces |
//!
//! `direct_light`, `series` and `packed_colour` are what the last two have in common.

pub mod direct;
pub(crate) mod direct_light;
pub mod file;
pub mod indirect;
pub(crate) mod leaks;
pub mod lookup;
mod packed_colour;
// For tests and benches only.
#[doc(hidden)]
pub mod points;
mod series;
mod slot;
pub mod surface;
// For tests and benches only.
#[doc(hidden)]
pub mod store;

pub use points::MeshError;
pub use store::PointMask;
