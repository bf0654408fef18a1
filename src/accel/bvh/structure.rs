//! The acceleration structure: trees of triangles, a tree of instances, and how queries are dispatched.

use crate::accel::largest_coordinate;
use crate::scene::{AlphaMasks, Scene};

use super::blas::Blas;
use super::error::BvhError;
use super::level::{Dispatch, SimdLevel};
use super::node::WIDTH;
use super::packet::GROUP_TEST;
use super::scene_tree::{Instances, Placed, build_fixed};
use super::traverse::STACK;

/// Ray queries in pure Rust.
pub struct BvhAccel {
    /// All triangles that are in world space already.
    pub(super) fixed: Blas,
    /// Their instances.
    in_world: Vec<u32>,
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
        let masks = AlphaMasks::of_scene(scene);
        let mut instances = Instances::default();
        let placements = instances.place(scene, &masks)?;
        let fixed = build_fixed(scene, &placements.fixed, &masks)?;
        check_depth(instances.stack_bound(&placements, &fixed))?;
        let in_world = placements.fixed.clone();
        instances.set(placements);
        Ok(Self { fixed, in_world, instances, dispatch, level, largest: largest_coordinate(scene) })
    }

    /// Makes it the structure of a scene that differs only in where instances stand: trees of meshes are kept.
    ///
    /// # Errors
    /// As for [`build`](Self::build); then it is what it was.
    pub(in crate::accel) fn rebuild(&mut self, scene: &Scene) -> Result<(), BvhError> {
        let masks = AlphaMasks::of_scene(scene);
        let placements = self.instances.place(scene, &masks)?;
        let fixed = if placements.fixed == self.in_world {
            None
        } else {
            Some(build_fixed(scene, &placements.fixed, &masks)?)
        };
        check_depth(self.instances.stack_bound(&placements, fixed.as_ref().unwrap_or(&self.fixed)))?;
        if let Some(fixed) = fixed {
            (self.fixed, self.in_world) = (fixed, placements.fixed.clone());
        }
        self.instances.set(placements);
        self.largest = largest_coordinate(scene);
        Ok(())
    }

    /// The instruction set that queries use.
    pub fn level(&self) -> SimdLevel {
        self.level
    }

    /// Bytes of all trees; meshes and alpha masks are the scene's.
    pub(super) fn bytes(&self) -> usize {
        let Instances { tree, leaves, placed, trees, .. } = &self.instances;
        let of_triangles: usize = trees.iter().chain([&self.fixed]).map(Blas::bytes).sum();
        of_triangles
            + tree.bytes()
            + leaves.capacity() * size_of::<[u32; WIDTH]>()
            + placed.capacity() * size_of::<Placed>()
            + trees.capacity() * size_of::<Blas>()
    }
}

/// Refuses trees that are too deep for the stack of a traversal.
fn check_depth(stack_bound: usize) -> Result<(), BvhError> {
    // A small group of rays starts with an entry per ray.
    let needed = stack_bound + GROUP_TEST as usize;
    if needed > STACK { Err(BvhError::TooDeep { needed, limit: STACK }) } else { Ok(()) }
}
