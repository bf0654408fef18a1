//! What can go wrong in a build.

use super::level::SimdLevel;

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
    /// The processor lacks an instruction set that was requested.
    #[error("this processor does not support {0:?}")]
    Unsupported(SimdLevel),
}
