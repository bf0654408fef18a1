//! Embree 3 and 4 behind one safe interface, loaded at run time.
//!
//! [`Library`] finds whichever version is installed, [`Device`] opens it, [`Geometry`] and
//! [`SceneBuilder`] describe triangles and their instances, and a committed [`Scene`] answers ray
//! queries from any number of threads. Handles free themselves, in whatever order they are dropped;
//! the library itself is never unloaded, since Embree's threads outlive its objects.
//!
//! ```
//! use std::sync::Arc;
//! use embree_sys::{Device, Geometry, Library, Ray, SceneBuilder};
//!
//! # fn main() -> Result<(), embree_sys::Error> {
//! # let Ok(library) = Library::load() else { return Ok(()) };
//! let device = Device::new(&library, "")?;
//! // Three vertices and the padding.
//! let vertices = Arc::new(vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0; 3]]);
//! let triangle = Geometry::triangles(&device, vertices, Arc::new(vec![[0, 1, 2]]), None)?;
//! let mut builder = SceneBuilder::new(&device)?;
//! builder.attach(7, triangle)?;
//! let scene = builder.commit()?;
//! let ray = Ray { origin: [0.2, 0.2, 1.0], direction: [0.0, 0.0, -1.0], tnear: 0.0, tfar: f32::INFINITY };
//! assert_eq!(scene.intersect1(&ray).map(|hit| hit.geom_id), Some(7));
//! # Ok(())
//! # }
//! ```

#[cfg(feature = "runtime")]
mod bindings;
#[cfg(feature = "runtime")]
mod device;
#[cfg(feature = "runtime")]
mod error;
#[cfg(feature = "runtime")]
mod filter;
#[cfg(feature = "runtime")]
mod geometry;
#[cfg(feature = "runtime")]
mod instance;
#[cfg(feature = "runtime")]
mod layout;
#[cfg(feature = "runtime")]
mod library;
mod mapped_file;
pub mod packet;
pub mod placement;
#[cfg(feature = "runtime")]
mod query;
#[cfg(feature = "runtime")]
mod ray;
#[cfg(feature = "runtime")]
mod scene;

pub use self::mapped_file::MappedFile;

#[cfg(feature = "runtime")]
pub use self::{
    device::Device,
    error::{Code, Error, Version},
    filter::Opacity,
    geometry::Geometry,
    library::Library,
    ray::{Hit, Ray},
    scene::{BuildQuality, Scene, SceneBuilder},
};
