//! The acceleration structure: trees of triangles, a tree of instances, and how queries are dispatched.

use crate::accel::largest_coordinate;
use crate::scene::Scene;

use super::blas::Blas;
use super::error::BvhError;
use super::level::{Dispatch, SimdLevel};
use super::node::WIDTH;
use super::packet::GROUP_TEST;
use super::scene_tree::{Instances, Placed, build_scene};
use super::traverse::STACK;

/// Ray queries in pure Rust.
pub struct BvhAccel {
    /// All triangles that are in world space already.
    pub(super) fixed: Blas,
    pub(super) instances: Instances,
    pub(super) dispatch: Dispatch,
    level: SimdLevel,
    /// Largest magnitude of the coordinates of rays that can hit anything.
    pub(super) largest: f32,
}

impl BvhAccel {
    /// Builds the acceleration structure on rayon's threads, for the best instruction set there is.
    ///
    /// Triangles with coordinates that are not finite or beyond [`MAX_COORDINATE`](crate::accel::MAX_COORDINATE) are left
    /// out, and so are instances whose [transform can't be undone](crate::accel::largest_coordinate_of).
    ///
    /// # Errors
    /// [`BvhError`], for a scene that can't be numbered or whose trees are too deep.
    pub fn build(scene: &Scene) -> Result<Self, BvhError> {
        Self::with_level(scene, SimdLevel::best())
    }

    /// As [`build`](Self::build), for a given instruction set; for tests, which compare all of them.
    ///
    /// # Errors
    /// As for [`build`](Self::build), and [`BvhError::Unsupported`].
    #[doc(hidden)]
    // For tests and benches only.
    #[doc(hidden)]
    pub fn with_level(scene: &Scene, level: SimdLevel) -> Result<Self, BvhError> {
        let dispatch = Dispatch::new(level).ok_or(BvhError::Unsupported(level))?;
        let (fixed, instances) = build_scene(scene)?;
        let needed = instances.trees.iter().chain([&fixed]).map(|blas| blas.tree.stack_bound).max();
        let needed = needed.unwrap_or(0).max(instances.tree.stack_bound);
        // A small group of rays starts with an entry per ray.
        let needed = needed + GROUP_TEST as usize;
        if needed > STACK {
            return Err(BvhError::TooDeep { needed, limit: STACK });
        }
        Ok(Self { fixed, instances, dispatch, level, largest: largest_coordinate(scene) })
    }

    /// The structure of a scene in which instances have moved, for the same instruction set.
    ///
    /// # Errors
    /// As for [`build`](Self::build).
    pub(in crate::accel) fn rebuild(&self, scene: &Scene) -> Result<Self, BvhError> {
        Self::with_level(scene, self.level)
    }

    /// The instruction set that queries use.
    pub fn level(&self) -> SimdLevel {
        self.level
    }

    /// Bytes of all trees; meshes and alpha masks are the scene's.
    pub(super) fn bytes(&self) -> usize {
        let Instances { tree, leaves, placed, trees } = &self.instances;
        let of_triangles: usize = trees.iter().chain([&self.fixed]).map(Blas::bytes).sum();
        of_triangles
            + tree.bytes()
            + leaves.capacity() * size_of::<[u32; WIDTH]>()
            + placed.capacity() * size_of::<Placed>()
            + trees.capacity() * size_of::<Blas>()
    }
}
