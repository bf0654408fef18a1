//! Pure-Rust ray queries: a wide BVH with SIMD nodes and leaves.
//!
//! Hits are the same to the last bit on every instruction set level, for single rays and packets, and
//! for any number of threads that built the tree: the triangle test has one order of operations, boxes are
//! padded so that they never cull a hit, and equal distances go to the lowest (instance, triangle).

mod blas;
mod blas_packet;
mod build;
mod collapse;
mod instance;
mod lanes;
mod node;
mod packet;
mod query;
mod ray;
mod scene_tree;
mod top_level;
mod traverse;
mod traverse_packet;
mod triangle;
mod validate;

use super::largest_coordinate;
use crate::scene::Scene;

use blas::Blas;
use node::{Node, TriangleBlock};
use scene_tree::{Instances, build_scene};

pub(super) use instance::WorldToObject;

/// What can go wrong in a build.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BvhError {
    /// More triangles than a tree can number.
    #[error("the scene has more than 2,147,483,647 triangles or instances")]
    TooManyTriangles,
    /// An instance names a mesh that the scene doesn't have.
    #[error("instance {instance} refers to mesh {mesh}, which does not exist")]
    NoSuchMesh {
        /// Index of the instance.
        instance: usize,
        /// Index of the mesh.
        mesh: u32,
    },
    /// The tree is deeper than traversal can follow.
    #[error("the acceleration structure needs a stack of {needed} entries, more than {limit}")]
    TooDeep {
        /// Entries that are needed.
        needed: usize,
        /// Entries that there are.
        limit: usize,
    },
    /// The processor lacks an instruction set that was asked for.
    #[error("this processor does not support {0:?}")]
    Unsupported(SimdLevel),
}

/// Instruction sets that traversal is compiled for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SimdLevel {
    /// What the build's target has.
    Portable,
    /// AVX2 and FMA.
    Avx2,
    /// AVX-512 F, BW, CD, DQ and VL.
    Avx512,
}

impl SimdLevel {
    /// All levels, the best last.
    pub const ALL: [Self; 3] = [Self::Portable, Self::Avx2, Self::Avx512];

    /// The best level of this processor.
    pub fn best() -> Self {
        Self::ALL.into_iter().rev().find(|level| level.is_available()).unwrap_or(Self::Portable)
    }

    /// Whether this processor has the level.
    pub fn is_available(self) -> bool {
        query::Dispatch::new(self).is_some()
    }
}

/// Ray queries in pure Rust.
pub struct BvhAccel {
    /// All triangles that are in world space already.
    fixed: Blas,
    instances: Instances,
    dispatch: query::Dispatch,
    level: SimdLevel,
    /// Of the coordinates of rays.
    largest: f32,
}

impl BvhAccel {
    /// Builds the acceleration structure on rayon's threads, for the best instruction set there is.
    ///
    /// Triangles with coordinates that are not finite or beyond [`MAX_COORDINATE`](super::MAX_COORDINATE) are left
    /// out, and so are instances whose [transform can't be undone](super::largest_coordinate_of).
    pub fn build(scene: &Scene) -> Result<Self, BvhError> {
        Self::with_level(scene, SimdLevel::best())
    }

    /// As [`build`](Self::build), for a given instruction set.
    pub fn with_level(scene: &Scene, level: SimdLevel) -> Result<Self, BvhError> {
        let dispatch = query::Dispatch::new(level).ok_or(BvhError::Unsupported(level))?;
        let (fixed, instances) = build_scene(scene)?;
        let needed = instances.trees.iter().chain([&fixed]).map(|blas| blas.tree.stack_bound).max();
        let needed = needed.unwrap_or(0).max(instances.tree.stack_bound);
        // A small group of rays starts with an entry per ray.
        let needed = needed + packet::GROUP_TEST as usize;
        if needed > top_level::STACK {
            return Err(BvhError::TooDeep { needed, limit: top_level::STACK });
        }
        Ok(Self { fixed, instances, dispatch, level, largest: largest_coordinate(scene) })
    }

    /// The instruction set that queries use.
    pub fn level(&self) -> SimdLevel {
        self.level
    }

    fn blas_bytes(blas: &Blas) -> usize {
        blas.tree.nodes.capacity() * size_of::<Node>()
            + blas.blocks.capacity() * size_of::<TriangleBlock>()
            + blas.parts.capacity() * size_of::<blas::Part>()
    }

    fn bytes(&self) -> usize {
        let instances = &self.instances;
        let trees: usize = instances.trees.iter().chain([&self.fixed]).map(Self::blas_bytes).sum();
        trees
            + instances.tree.nodes.capacity() * size_of::<Node>()
            + instances.leaves.capacity() * size_of::<[u32; 8]>()
            + instances.placed.capacity() * size_of::<scene_tree::Placed>()
    }
}
