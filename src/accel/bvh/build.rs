//! Binary trees by binned surface-area heuristic, built in parallel; the same for any number of threads.

use glam::{Vec3A, Vec4};
use rayon::prelude::*;

use super::node::WIDTH;

/// Bins per axis.
const BINS: usize = 16;

/// Ranges of at least this many primitives are binned in parallel and split into parallel tasks.
const PARALLEL_BINNING: usize = 1 << 16;
const PARALLEL_TASK: usize = 1 << 12;
const BINNING_CHUNK: usize = 1 << 14;

/// Ranges up to this size are not split further.
const SMALLEST: usize = 2;

/// From this depth on ranges are halved, which bounds the depth whatever the input.
const HALVING_DEPTH: u32 = 48;

/// Cost of testing a node's eight boxes and of testing a block of eight triangles.
const NODE_COST: f64 = 1.0;
const LEAF_COST: f64 = 1.0;

/// What the tree is built over: a box and a number.
#[derive(Clone, Copy, Debug)]
pub struct Primitive {
    /// Lower corner; the fourth component holds the number's bits.
    lower: Vec4,
    /// Upper corner; the fourth component is unused.
    upper: Vec4,
}

impl Primitive {
    /// A primitive of finite bounds.
    pub fn new(lower: Vec3A, upper: Vec3A, id: u32) -> Self {
        Self { lower: lower.extend(f32::from_bits(id)), upper: upper.extend(0.0) }
    }

    /// The number.
    pub fn id(&self) -> u32 {
        self.lower.w.to_bits()
    }

    fn centroid(&self) -> Vec4 {
        self.lower * 0.5 + self.upper * 0.5
    }
}

#[derive(Clone, Copy, Debug)]
struct Bounds {
    lower: Vec4,
    upper: Vec4,
}

impl Bounds {
    const EMPTY: Self = Self { lower: Vec4::INFINITY, upper: Vec4::NEG_INFINITY };

    #[inline(always)]
    fn grow(&mut self, lower: Vec4, upper: Vec4) {
        // The old value is the second operand, which a NaN in the unused component can't harm.
        self.lower = lower.min(self.lower);
        self.upper = upper.max(self.upper);
    }

    #[inline(always)]
    fn union(mut self, other: Self) -> Self {
        self.grow(other.lower, other.upper);
        self
    }

    /// Half the surface, in double precision so that no finite box overflows.
    #[inline(always)]
    fn half_area(&self) -> f64 {
        let [x, y, z, _] = self.upper.to_array();
        let [lx, ly, lz, _] = self.lower.to_array();
        let (x, y, z) =
            (f64::from(x) - f64::from(lx), f64::from(y) - f64::from(ly), f64::from(z) - f64::from(lz));
        x * y + y * z + z * x
    }
}

/// Node of the binary tree. Nodes stand in postorder: the right child directly before its parent, the
/// left child before all of the right subtree.
#[derive(Clone, Copy, Debug)]
pub struct BinaryNode {
    pub lower: [f32; 3],
    pub upper: [f32; 3],
    /// The primitives below: `first..first + count` in the built order.
    pub first: u32,
    pub count: u32,
    /// Number of nodes of the right subtree, 0 for a leaf.
    pub right_size: u32,
    /// The cheapest way to stand for this subtree by at most i + 1 children of a wide node. Entry 0
    /// is 1 for a leaf block and 0 for a node of its own; the others are how many of the children go
    /// to the left subtree, 0 for one child less.
    pub split: [u8; WIDTH],
}

/// Costs of [`BinaryNode::split`] for 1 to 8 children.
type Costs = [f64; WIDTH];

/// Builds the binary tree; reorders the primitives. The root is the last node.
pub fn build(primitives: &mut [Primitive]) -> Vec<BinaryNode> {
    if primitives.is_empty() {
        return Vec::new();
    }
    let mut nodes = Vec::new();
    build_range(primitives, 0, 0, &mut nodes);
    nodes
}

fn build_range(
    primitives: &mut [Primitive],
    first: usize,
    depth: u32,
    nodes: &mut Vec<BinaryNode>,
) -> (Bounds, Costs) {
    let count = primitives.len();
    if count <= SMALLEST {
        let bounds = primitives.iter().fold(Bounds::EMPTY, |mut bounds, p| {
            bounds.grow(p.lower, p.upper);
            bounds
        });
        let costs = [bounds.half_area() * LEAF_COST; WIDTH];
        let mut split = [0; WIDTH];
        split[0] = 1;
        nodes.push(node(&bounds, first, count, 0, split));
        return (bounds, costs);
    }
    let middle = partition(primitives, depth);
    let (left, right) = primitives.split_at_mut(middle);
    let (left_result, right_result, right_size);
    if count > PARALLEL_TASK {
        let (l, (r, right_nodes)) = rayon::join(
            || build_range(left, first, depth + 1, nodes),
            || {
                let mut right_nodes = Vec::new();
                (build_range(right, first + middle, depth + 1, &mut right_nodes), right_nodes)
            },
        );
        right_size = right_nodes.len();
        nodes.extend_from_slice(&right_nodes);
        (left_result, right_result) = (l, r);
    } else {
        left_result = build_range(left, first, depth + 1, nodes);
        let before = nodes.len();
        right_result = build_range(right, first + middle, depth + 1, nodes);
        right_size = nodes.len() - before;
    }
    let bounds = left_result.0.union(right_result.0);
    let (costs, split) = distribute(bounds.half_area(), count, &left_result.1, &right_result.1);
    nodes.push(node(&bounds, first, count, right_size, split));
    (bounds, costs)
}

fn node(bounds: &Bounds, first: usize, count: usize, right_size: usize, split: [u8; WIDTH]) -> BinaryNode {
    let [lx, ly, lz, _] = bounds.lower.to_array();
    let [ux, uy, uz, _] = bounds.upper.to_array();
    BinaryNode {
        lower: [lx, ly, lz],
        upper: [ux, uy, uz],
        first: first as u32,
        count: count as u32,
        right_size: right_size as u32,
        split,
    }
}

/// Dynamic programme for the cheapest wide tree (Ylitie et al. 2017, after Aila et al.).
fn distribute(area: f64, count: usize, left: &Costs, right: &Costs) -> (Costs, [u8; WIDTH]) {
    let mut costs = [f64::INFINITY; WIDTH];
    let mut split = [0u8; WIDTH];
    for children in 2..=WIDTH {
        let (mut best, mut best_left) = (f64::INFINITY, 1);
        for to_left in 1..children {
            let cost = left[to_left - 1] + right[children - to_left - 1];
            if cost < best {
                (best, best_left) = (cost, to_left);
            }
        }
        costs[children - 1] = best;
        split[children - 1] = best_left as u8;
    }
    let as_node = area * NODE_COST + costs[WIDTH - 1];
    let as_leaf = area * LEAF_COST;
    let is_leaf = count <= WIDTH && (as_leaf <= as_node);
    costs[0] = if is_leaf { as_leaf } else { as_node };
    split[0] = u8::from(is_leaf);
    for children in 2..=WIDTH {
        // Strictly cheaper, so that eight children of a node of its own always mean its own children.
        if costs[children - 2] < costs[children - 1] {
            costs[children - 1] = costs[children - 2];
            split[children - 1] = 0;
        }
    }
    (costs, split)
}

/// Splits a range; returns the size of the left part, which like the right one is never empty.
fn partition(primitives: &mut [Primitive], depth: u32) -> usize {
    let count = primitives.len();
    let half = count / 2;
    if depth >= HALVING_DEPTH {
        return half;
    }
    let centroids = reduce(
        primitives,
        Bounds::EMPTY,
        |bounds, p| {
            let centroid = p.centroid();
            bounds.grow(centroid, centroid);
        },
        Bounds::union,
    );
    let binning = Binning::new(&centroids, count);
    let bins = reduce(primitives, Bins::EMPTY, |bins, p| bins.add(&binning, p), Bins::union);
    let Some((axis, boundary)) = bins.best_split(&binning) else {
        return half;
    };
    let middle = partition_by(primitives, |p| binning.bins_of(p)[axis] < boundary);
    if middle == 0 || middle == count { half } else { middle }
}

/// Folds over a range, in parallel where it is long; exact operations only, so that chunks don't matter.
fn reduce<T: Copy + Send + Sync>(
    primitives: &[Primitive],
    empty: T,
    fold: impl Fn(&mut T, &Primitive) + Sync,
    union: impl Fn(T, T) -> T + Sync + Send,
) -> T {
    let of_chunk = |chunk: &[Primitive]| {
        let mut result = empty;
        for primitive in chunk {
            fold(&mut result, primitive);
        }
        result
    };
    if primitives.len() < PARALLEL_BINNING {
        return of_chunk(primitives);
    }
    primitives.par_chunks(BINNING_CHUNK).map(of_chunk).reduce(|| empty, union)
}

/// Moves the primitives that satisfy `left` to the front.
fn partition_by(primitives: &mut [Primitive], left: impl Fn(&Primitive) -> bool) -> usize {
    let (mut begin, mut end) = (0, primitives.len());
    loop {
        while begin < end && left(&primitives[begin]) {
            begin += 1;
        }
        while begin < end && !left(&primitives[end - 1]) {
            end -= 1;
        }
        if begin >= end {
            return begin;
        }
        primitives.swap(begin, end - 1);
        begin += 1;
        end -= 1;
    }
}

/// How centroids map to bins.
struct Binning {
    origin: Vec4,
    scale: Vec4,
    bins: usize,
    usable: [bool; 3],
}

impl Binning {
    fn new(centroids: &Bounds, count: usize) -> Self {
        let bins = BINS.min(4 + count / 2);
        let extent = centroids.upper - centroids.lower;
        let scale = (Vec4::splat(bins as f32) / extent).to_array();
        let usable = [0, 1, 2].map(|axis| extent[axis] > 0.0 && scale[axis].is_finite() && scale[axis] > 0.0);
        let scale = Vec4::from_array(
            [0, 1, 2, 3].map(|axis| if axis < 3 && usable[axis] { scale[axis] } else { 0.0 }),
        );
        Self { origin: centroids.lower, scale, bins, usable }
    }

    #[inline(always)]
    fn bins_of(&self, primitive: &Primitive) -> [usize; 3] {
        let [x, y, z, _] = ((primitive.centroid() - self.origin) * self.scale).to_array();
        // Float to integer saturates, NaN becomes 0.
        [x, y, z].map(|bin| (bin as i32 as usize).min(self.bins - 1))
    }
}

#[derive(Clone, Copy)]
struct Bins {
    bounds: [[Bounds; BINS]; 3],
    counts: [[u32; BINS]; 3],
}

impl Bins {
    const EMPTY: Self = Self { bounds: [[Bounds::EMPTY; BINS]; 3], counts: [[0; BINS]; 3] };

    #[inline(always)]
    fn add(&mut self, binning: &Binning, primitive: &Primitive) {
        for (axis, bin) in binning.bins_of(primitive).into_iter().enumerate() {
            let bin = bin.min(BINS - 1);
            self.bounds[axis][bin].grow(primitive.lower, primitive.upper);
            self.counts[axis][bin] += 1;
        }
    }

    fn union(mut self, other: Self) -> Self {
        for axis in 0..3 {
            for bin in 0..BINS {
                self.bounds[axis][bin] = self.bounds[axis][bin].union(other.bounds[axis][bin]);
                self.counts[axis][bin] += other.counts[axis][bin];
            }
        }
        self
    }

    /// Axis and first bin of the right part, by the least sum of area times count.
    fn best_split(&self, binning: &Binning) -> Option<(usize, usize)> {
        let mut best = None;
        let mut best_cost = f64::INFINITY;
        for axis in (0..3).filter(|&axis| binning.usable[axis]) {
            let mut right_costs = [0.0; BINS];
            let (mut bounds, mut count) = (Bounds::EMPTY, 0);
            for bin in (1..binning.bins).rev() {
                bounds = bounds.union(self.bounds[axis][bin]);
                count += self.counts[axis][bin];
                right_costs[bin] =
                    if count == 0 { f64::INFINITY } else { bounds.half_area() * f64::from(count) };
            }
            let (mut bounds, mut count) = (Bounds::EMPTY, 0);
            for (bin, &right_cost) in right_costs.iter().enumerate().take(binning.bins).skip(1) {
                bounds = bounds.union(self.bounds[axis][bin - 1]);
                count += self.counts[axis][bin - 1];
                if count == 0 {
                    continue;
                }
                let cost = bounds.half_area() * f64::from(count) + right_cost;
                if cost < best_cost {
                    (best, best_cost) = (Some((axis, bin)), cost);
                }
            }
        }
        best
    }
}
