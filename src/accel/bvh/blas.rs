//! A tree of triangles, and single rays against its leaves.

use crate::scene::MaskedMesh;

use super::lanes::{Lanes, map3};
use super::node::{TriangleBlock, WIDTH, WideTree};
use super::ray::SingleRay;
use super::traverse::{any_hit, closest_hit};
use super::triangle::{EdgeTest, LaneHit, test_edges};

/// Triangles of one or several meshes under one tree, numbered in the order of the meshes.
#[derive(Default)]
pub struct Blas {
    pub tree: WideTree,
    pub blocks: Vec<TriangleBlock>,
    pub parts: Vec<Part>,
    /// Whether any part has an alpha mask.
    pub has_masks: bool,
}

/// The triangles of a tree that come from one mesh.
pub struct Part {
    /// Number of the part's first triangle within the tree.
    pub first: u32,
    /// Index of the instance, for trees that are not instanced.
    pub instance: u32,
    /// The mesh with its alpha masks, if it has any.
    pub masked: Option<MaskedMesh>,
}

/// Closest hit so far, within one tree.
#[derive(Clone, Copy, Debug)]
pub struct Closest {
    pub hit: LaneHit,
    /// Number of the triangle within the tree, `u32::MAX` for none.
    pub id: u32,
}

impl Closest {
    /// No hit before `t_far`.
    #[inline(always)]
    pub fn none(t_far: f32) -> Self {
        Self { hit: LaneHit { t: t_far, u: 0.0, v: 0.0 }, id: u32::MAX }
    }

    /// Takes a hit that is nearer, or as near with a lower number.
    #[inline(always)]
    pub fn offer(&mut self, hit: LaneHit, id: u32) -> bool {
        let better = hit.t < self.hit.t || (hit.t == self.hit.t && id < self.id);
        if better {
            *self = Self { hit, id };
        }
        better
    }
}

impl Blas {
    /// Bytes of the tree and what it holds, without itself.
    pub fn bytes(&self) -> usize {
        self.tree.bytes()
            + self.blocks.capacity() * size_of::<TriangleBlock>()
            + self.parts.capacity() * size_of::<Part>()
    }

    /// Instance and triangle within its mesh of a triangle of this tree.
    pub fn resolve(&self, id: u32) -> (u32, u32) {
        self.part(id).map_or((0, id), |part| (part.instance, id - part.first))
    }

    fn part(&self, id: u32) -> Option<&Part> {
        let after = self.parts.partition_point(|part| part.first <= id);
        self.parts.get(after.wrapping_sub(1))
    }

    /// Whether a hit lies where its triangle is opaque.
    #[inline(always)]
    pub fn is_opaque(&self, id: u32, hit: &LaneHit) -> bool {
        !self.has_masks || self.passes_mask(id, hit)
    }

    #[inline(never)]
    fn passes_mask(&self, id: u32, hit: &LaneHit) -> bool {
        match self.part(id) {
            Some(Part { first, masked: Some(masked), .. }) => masked.is_opaque(id - first, hit.u, hit.v),
            _ => true,
        }
    }

    /// Whether anything lies on the ray.
    #[inline(always)]
    pub fn occluded<S: Lanes<WIDTH>, const STACK: usize>(&self, simd: S, ray: &SingleRay) -> bool {
        any_hit(
            &self.tree,
            simd,
            ray,
            0,
            &mut [0; STACK],
            #[inline(always)]
            |leaf| self.occluded_by_block(simd, &self.blocks[leaf], ray),
        )
    }

    /// Closest hit of the ray.
    #[inline(always)]
    pub fn intersect<S: Lanes<WIDTH>, const STACK: usize>(&self, simd: S, ray: &SingleRay) -> Closest {
        let mut closest = Closest::none(ray.t_far);
        closest_hit(
            &self.tree,
            simd,
            ray,
            0,
            &mut [0; STACK],
            ray.t_far,
            #[inline(always)]
            |leaf| {
                self.intersect_block(simd, &self.blocks[leaf], ray, &mut closest);
                closest.hit.t
            },
        );
        closest
    }

    #[inline(always)]
    fn test_block<S: Lanes<WIDTH>>(simd: S, block: &TriangleBlock, ray: &SingleRay) -> EdgeTest<S::F> {
        let corners = map3(
            [&block.corners[0], &block.corners[1], &block.corners[2]],
            #[inline(always)]
            |corner| {
                map3(
                    ray.axes,
                    #[inline(always)]
                    |axis| simd.load(&corner[axis]),
                )
            },
        );
        let origin = map3(
            ray.axes,
            #[inline(always)]
            |axis| simd.splat(ray.origin[axis]),
        );
        let shear = map3(
            ray.shear,
            #[inline(always)]
            |s| simd.splat(s),
        );
        test_edges(simd, corners, origin, shear)
    }

    /// Whether one of a block's triangles lies on the ray.
    #[inline(always)]
    pub fn occluded_by_block<S: Lanes<WIDTH>>(
        &self,
        simd: S,
        block: &TriangleBlock,
        ray: &SingleRay,
    ) -> bool {
        let edges = Self::test_block(simd, block, ray);
        let candidates = edges.candidates & block.used();
        if candidates == 0 {
            return false;
        }
        let [shear_z, t_near, t_far] = [ray.shear[2], ray.t_near, ray.t_far];
        let distances = edges.distances::<S, WIDTH>(
            simd,
            candidates,
            simd.splat(shear_z),
            simd.splat(t_near),
            simd.splat(t_far),
        );
        if distances.hits != 0 && !self.has_masks {
            return true;
        }
        let mut hits = distances.hits | distances.undecided;
        while hits != 0 {
            let lane = hits.trailing_zeros() as usize & 7;
            hits &= hits - 1;
            let hit = edges.decide(simd, &distances, lane, shear_z, [t_near, t_far]);
            if hit.is_some_and(|hit| self.is_opaque(block.ids[lane], &hit)) {
                return true;
            }
        }
        false
    }

    /// Lowers `closest` to the closest hit among a block's triangles.
    #[inline(always)]
    pub fn intersect_block<S: Lanes<WIDTH>>(
        &self,
        simd: S,
        block: &TriangleBlock,
        ray: &SingleRay,
        closest: &mut Closest,
    ) -> bool {
        let edges = Self::test_block(simd, block, ray);
        let candidates = edges.candidates & block.used();
        if candidates == 0 {
            return false;
        }
        let (shear_z, t_near) = (ray.shear[2], ray.t_near);
        let distances = edges.distances::<S, WIDTH>(
            simd,
            candidates,
            simd.splat(shear_z),
            simd.splat(t_near),
            simd.splat(closest.hit.t),
        );
        let mut changed = false;
        let mut hits = distances.hits | distances.undecided;
        while hits != 0 {
            let lane = hits.trailing_zeros() as usize & 7;
            hits &= hits - 1;
            let hit = if distances.undecided >> lane & 1 != 0 {
                edges.exact(simd, lane, shear_z, t_near, closest.hit.t)
            } else if distances.t[lane] <= closest.hit.t {
                Some(distances.hit(lane))
            } else {
                None
            };
            if let Some(hit) = hit
                && self.is_opaque(block.ids[lane], &hit)
            {
                changed |= closest.offer(hit, block.ids[lane]);
            }
        }
        changed
    }
}
