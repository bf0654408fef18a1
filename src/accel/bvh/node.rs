//! Wide nodes and leaves, as they lie in memory.

use super::lanes::Lanes;
use super::ray::SingleRay;

/// Children per node, and triangles per leaf.
pub const WIDTH: usize = 8;

/// Reference to a child: a node, or with this bit set a leaf.
pub const LEAF: u32 = 1 << 31;

/// Reference in slots that hold no child.
pub const NO_CHILD: u32 = u32::MAX;

/// Inner node with up to eight children.
#[repr(C, align(64))]
#[derive(Clone, Debug, PartialEq)]
pub struct Node {
    /// Planes of the children's boxes: lower x, upper x, lower y, upper y, lower z, upper z.
    ///
    /// Boxes are padded against the rounding of the box test; empty slots hold inverted boxes.
    pub planes: [[f32; WIDTH]; 6],
    /// Index of a node, or [`LEAF`] and the index of a leaf, or [`NO_CHILD`].
    pub children: [u32; WIDTH],
    /// Bit mask of slots that hold a child.
    pub used: u32,
}

impl Node {
    /// A node without children.
    pub const EMPTY: Self = Self {
        planes: [
            [f32::INFINITY; WIDTH],
            [f32::NEG_INFINITY; WIDTH],
            [f32::INFINITY; WIDTH],
            [f32::NEG_INFINITY; WIDTH],
            [f32::INFINITY; WIDTH],
            [f32::NEG_INFINITY; WIDTH],
        ],
        children: [NO_CHILD; WIDTH],
        used: 0,
    };

    /// Where the ray meets one plane of each child.
    #[inline(always)]
    fn distances<S: Lanes<WIDTH>>(&self, simd: S, ray: &SingleRay, axis: usize, upper: usize) -> S::F {
        let planes = simd.load(&self.planes[2 * axis + (upper & 1)]);
        let (reciprocal, scaled_origin) = (ray.reciprocal[axis], ray.scaled_origin[axis]);
        simd.mul_sub(planes, simd.splat(reciprocal), simd.splat(scaled_origin))
    }

    /// Tests all children against one ray: a bit mask of those it meets, and where it enters them.
    ///
    /// Robust in the sense of Ize (2013): the far distance is scaled up, which with the padding of
    /// the boxes outweighs every rounding of the test, fused or not.
    #[inline(always)]
    pub fn test<S: Lanes<WIDTH>>(&self, simd: S, ray: &SingleRay, t_far: f32) -> (u32, S::F) {
        let [sx, sy, sz] = ray.signs;
        // NaN, which is an overflow, is the first operand and so drops out: such planes don't cull.
        let near = simd.max(self.distances(simd, ray, 0, sx), simd.splat(ray.t_near));
        let near =
            simd.max(self.distances(simd, ray, 2, sz), simd.max(self.distances(simd, ray, 1, sy), near));
        let far = simd.min(self.distances(simd, ray, 0, sx ^ 1), simd.splat(t_far));
        let far = simd
            .min(self.distances(simd, ray, 2, sz ^ 1), simd.min(self.distances(simd, ray, 1, sy ^ 1), far));
        let far = simd.mul(far, simd.splat(FAR_SCALE));
        (simd.le(near, far) & self.used, near)
    }
}

/// What far distances are multiplied with: 1 + 2⁻²¹, that is 8 units of rounding, where the box test
/// with its two products, subtraction and reciprocal makes at most 4.
pub const FAR_SCALE: f32 = 1.0 + 1.0 / (1 << 21) as f32;

/// What boxes are padded by, relative to their largest coordinate: the part of the rounding error of
/// `plane · reciprocal − origin · reciprocal` that isn't proportional to the distance.
pub const BOX_PADDING: f32 = 1.0 / (1 << 21) as f32;

/// Up to eight triangles as a structure of arrays; empty lanes hold NaN, which nothing hits.
#[repr(C, align(64))]
#[derive(Clone, Debug)]
pub struct TriangleBlock {
    /// Corners: `corners[c][axis][lane]`.
    pub corners: [[[f32; WIDTH]; 3]; 3],
    /// Number of the triangle within the tree; triangles of lower number win ties.
    pub ids: [u32; WIDTH],
}

impl TriangleBlock {
    /// A block without triangles.
    pub const EMPTY: Self = Self { corners: [[[f32::NAN; WIDTH]; 3]; 3], ids: [u32::MAX; WIDTH] };

    /// Bit mask of lanes that hold a triangle.
    #[inline(always)]
    pub fn used(&self) -> u32 {
        let mut mask = 0;
        for (lane, &id) in self.ids.iter().enumerate() {
            mask |= u32::from(id != u32::MAX) << lane;
        }
        mask
    }
}

/// A hierarchy of wide nodes over leaves that the owner keeps.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WideTree {
    /// Nodes, the root first; empty for a tree over nothing.
    pub nodes: Vec<Node>,
    /// Bound of all that the tree holds, unpadded.
    pub bounds: [[f32; 3]; 2],
    /// Most entries that a traversal stack needs at any time.
    pub stack_bound: usize,
}

impl WideTree {
    /// Bytes of the nodes.
    pub fn bytes(&self) -> usize {
        self.nodes.capacity() * size_of::<Node>()
    }
}
