//! Second stage: the mesh points that surface points need, steps 5 and 8 of the paper's algorithm.

use pulp::NullaryFnOnce;
use rayon::prelude::*;

use super::paths::TilePaths;
use super::tiles::TILES_PER_TASK;
use crate::light_mesh::lookup::Lookup;
use crate::light_mesh::store::PointMask;
use crate::simd::vectorize;

/// The mesh points in the neighbourhoods of the surface points of some tiles' paths, known or not.
pub fn needed_points(paths: &[TilePaths], lookup: Lookup) -> PointMask {
    let parts: Vec<Vec<(u64, u64)>> = paths
        .par_iter()
        .with_max_len(TILES_PER_TASK)
        .map(|paths| vectorize(NeededByTile { paths, lookup }))
        .collect();
    PointMask::union(parts.concat())
}

/// Finding the mesh points of a tile, as work for the best instruction set.
struct NeededByTile<'a> {
    paths: &'a TilePaths,
    lookup: Lookup<'a>,
}

impl NullaryFnOnce for NeededByTile<'_> {
    type Output = Vec<(u64, u64)>;

    #[inline(always)]
    fn call(self) -> Self::Output {
        self.lookup.needed(self.paths.surfaces()).into_bricks().collect()
    }
}
