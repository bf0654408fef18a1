//! Renders large triangle scenes with many lights by *light meshes* (Debelov and Sevastyanov, 2002): light is evaluated lazily at mesh
//! points in free space and interpolated at surfaces.
//!
//! A conventional ray tracer sends a shadow ray to every light from every surface point that the camera sees. Here the rays start at *mesh
//! points* (irradiance probes, in other words), of which many surface points share the same few. Each mesh point that an image needs is
//! evaluated once and remembers which lights it sees, one bit per light; surface points take the mean over the mesh points around them.
//! Shadows become soft, images have no noise, and the cost of light stops growing with the number of pixels.
//!
//! # A first image
//!
//! ```
//! use glam::Vec3;
//! use lightmesh::accel::BackendChoice;
//! use lightmesh::render::Session;
//! use lightmesh::scene::{Camera, Light, Scene, TriangleMesh};
//! use lightmesh::settings::Settings;
//!
//! let mut scene = Scene::new();
//! let corners = vec![[-1.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 0.0, -1.0], [-1.0, 0.0, -1.0]];
//! scene.add(TriangleMesh::new(corners, vec![[0, 1, 2], [0, 2, 3]]));
//! scene.lights.push(Light::point(Vec3::new(0.0, 1.0, 0.0), Vec3::ONE));
//! let camera = Camera::look_at(Vec3::new(0.0, 2.0, 3.0), Vec3::ZERO);
//!
//! let mut settings = Settings::default();
//! settings.view.resolution = (64, 48);
//! let mut session = Session::new(scene, BackendChoice::Auto)?;
//! let (image, stats) = session.render(&camera, &settings)?;
//! assert!(image.get(32, 24).is_some_and(|[red, ..]| red > 0.0));
//!
//! // The same points serve another view: nothing of what they know is traced again.
//! let (_, again) = session.render(&camera, &settings)?;
//! assert!(stats.mesh_points.direct.evaluated > 0 && again.mesh_points.direct.evaluated == 0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # How an image comes about
//!
//! 1. **trace**: camera paths of a block of tiles, down to their surface points.
//! 2. **need**: the mesh points in the neighbourhoods of these surface points.
//! 3. **evaluate**: the visibility bits of those that are unknown, in packets of rays, on all threads.
//! 4. **shade**: the light of each surface point, from the bits around it and the lights as they are now.
//! 5. **film**: the pixels, which a sink receives tile by tile.
//!
//! Each stage is a public function that takes references and returns a value. A [`Session`](render::Session) runs them in turn and
//! keeps the mesh points from one image to the next. What is known of a mesh point depends on the triangles and on where the lights
//! stand, on nothing else: a second camera, another radius, estimator or leak rule, brighter or dimmer lights cost rays only for points
//! that were never needed before.
//!
//! The same scene and settings give the same image, to the last bit, whatever the number of threads and the size of blocks.
//!
//! # Where to look
//!
//! - [`scene`]: triangles, materials, lights and cameras, built in memory or loaded from OBJ, PLY, glTF and scene files.
//! - [`accel`]: ray queries behind one trait: Embree, found at run time, or the crate's own BVH.
//! - [`light_mesh`]: mesh points, their values, and the estimators that interpolate them.
//! - [`render`]: the stages, and the tracers that light meshes are measured against: `conventional`, with all shadow rays, and `reference`, a
//!   light mesh of infinite density.
//! - [`probe`] and [`export`]: light as numbers, at points of a caller's choice and at the mesh points that are known.
//! - [`image`]: OpenEXR, PNG, and metrics for comparing images.
//!
//! The equations, the words and the limits of the method are in `docs/method.md`, which comments cite as "method §4". Bias is the price: the
//! error is smooth and falls with the spacing of the mesh points and the radius of interpolation, not with the number of camera rays.
//!
//! Units: lengths in any one unit, colours in linear RGB (BT.709), intensities W/sr under the physical preset. Functions that take a scene or
//! settings from a caller check them and return errors; they do not panic.

#![warn(clippy::unwrap_used, clippy::expect_used)]

pub mod accel;
#[cfg(feature = "cli")]
mod bench;
mod bounds;
#[cfg(feature = "cli")]
pub mod cli;
mod color;
#[cfg(feature = "cli")]
pub mod crosscheck;
pub mod export;
pub mod framing;
pub mod image;
pub mod light_mesh;
pub mod lights;
pub mod probe;
pub mod render;
// For tests and benches only.
#[doc(hidden)]
pub mod sampling;
pub mod scene;
pub mod settings;
// For tests and benches only.
#[doc(hidden)]
pub mod simd;
mod suggestion;
mod world;

pub use bounds::Bounds;
pub use world::World;
