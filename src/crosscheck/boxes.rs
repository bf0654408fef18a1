//! A plain binary tree over boxes, walked in double precision. It shares nothing with the trees that it helps
//! to judge.

use glam::{DVec3, Vec3};

use super::local_ray::{BOUND, LocalRay};
use crate::Bounds;

/// Boxes per leaf.
const LEAF: usize = 4;

/// Places between which a split is chosen.
const BINS: usize = 16;

/// From this many boxes on the two halves are built in parallel.
const PARALLEL: usize = 1 << 14;

/// Tree over numbered boxes, split where the surface area heuristic is least along the widest axis.
#[derive(Debug, Default)]
pub struct BoxTree {
    nodes: Vec<Node>,
    order: Vec<u32>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    bounds: Bounds,
    /// The numbers below, a range of the order.
    first: u32,
    count: u32,
    /// How far behind its parent the right child stands, the left one being next; 0 for a leaf.
    right: u32,
}

/// A ray for walks through boxes, with the distance by which anything near it counts as met.
#[derive(Clone, Copy, Debug)]
pub struct Walker {
    origin: DVec3,
    /// One over the direction; infinite where that is 0.
    inverse: DVec3,
    /// Width per distance of a box's farthest corner from the start.
    relative: f64,
    /// Width that is always there.
    absolute: f64,
}

/// Nodes that a walk still has to see, with where they begin. Kept between walks, so that they need not allocate.
pub type Stack = Vec<(u32, f64)>;

impl Walker {
    /// The ray, with the width of its doubt and of a triangle's.
    pub fn new(ray: &LocalRay) -> Self {
        let inverse = ray.direction.to_array().map(|d| if d == 0.0 { f64::INFINITY } else { 1.0 / d });
        Self {
            origin: ray.origin,
            inverse: inverse.into(),
            relative: BOUND + ray.spread(),
            absolute: ray.origin_error,
        }
    }

    /// Where the ray enters the widened box, within `0..=limit`.
    #[inline]
    fn enters(&self, bounds: &Bounds, limit: f64) -> Option<f64> {
        let (low, high) = (bounds.min.as_dvec3() - self.origin, bounds.max.as_dvec3() - self.origin);
        // The sum is no less than the length.
        let pad = self.absolute + self.relative * low.abs().max(high.abs()).element_sum();
        let (mut near, mut far) = (0.0f64, limit);
        for axis in 0..3 {
            // Beside a slab that the ray runs along both are infinite, of one sign.
            let (a, b) = ((low[axis] - pad) * self.inverse[axis], (high[axis] + pad) * self.inverse[axis]);
            near = near.max(a.min(b));
            far = far.min(a.max(b));
        }
        (near <= far && near < f64::INFINITY).then_some(near)
    }
}

impl BoxTree {
    /// The tree over boxes that are not empty.
    pub fn new(boxes: &[(Bounds, u32)]) -> Self {
        let mut boxes = boxes.to_vec();
        let mut nodes = Vec::new();
        if !boxes.is_empty() {
            build(&mut boxes, 0, &mut nodes);
        }
        Self { nodes, order: boxes.iter().map(|(_, number)| *number).collect() }
    }

    /// Calls `visit` with the number of every box that the ray meets before `limit`, which `visit` may lower.
    pub fn walk(
        &self,
        walker: &Walker,
        stack: &mut Stack,
        mut limit: f64,
        mut visit: impl FnMut(u32, f64) -> f64,
    ) {
        stack.clear();
        if let Some(near) = self.nodes.first().and_then(|root| walker.enters(&root.bounds, limit)) {
            stack.push((0, near));
        }
        while let Some((index, near)) = stack.pop() {
            let Some(node) = self.nodes.get(index as usize).filter(|_| near <= limit) else { continue };
            if node.right == 0 {
                let range = node.first as usize..(node.first + node.count) as usize;
                for &number in &self.order[range] {
                    limit = visit(number, limit);
                }
                continue;
            }
            let children = [index + 1, index + node.right];
            let met = children.map(|child| walker.enters(&self.nodes[child as usize].bounds, limit));
            // The nearer child is taken up first.
            let order = if met[0] <= met[1] { [1, 0] } else { [0, 1] };
            for child in order {
                stack.extend(met[child].map(|near| (children[child], near)));
            }
        }
    }
}

fn build(boxes: &mut [(Bounds, u32)], first: u32, nodes: &mut Vec<Node>) {
    let (mut bounds, mut centers) = (Bounds::EMPTY, Bounds::EMPTY);
    for (bound, _) in boxes.iter() {
        bounds = joined(&bounds, bound);
        centers.extend(bound.center());
    }
    let index = nodes.len();
    let count = boxes.len();
    nodes.push(Node { bounds, first, count: count as u32, right: 0 });
    if count <= LEAF {
        return;
    }
    let half = split(boxes, &centers);
    let (left, right) = boxes.split_at_mut(half);
    let middle = first + half as u32;
    if count < PARALLEL {
        build(left, first, nodes);
        nodes[index].right = (nodes.len() - index) as u32;
        build(right, middle, nodes);
    } else {
        let (mut left_nodes, mut right_nodes) = (Vec::new(), Vec::new());
        rayon::join(|| build(left, first, &mut left_nodes), || build(right, middle, &mut right_nodes));
        nodes.append(&mut left_nodes);
        nodes[index].right = (nodes.len() - index) as u32;
        nodes.append(&mut right_nodes);
    }
}

/// Sorts boxes into two parts, neither of them empty, and returns the size of the first.
fn split(boxes: &mut [(Bounds, u32)], centers: &Bounds) -> usize {
    let axis = widest(centers.extent());
    let (start, scale) = (centers.min[axis], BINS as f32 / centers.extent()[axis]);
    let bin_of = |bounds: &Bounds| (((bounds.center()[axis] - start) * scale) as usize).min(BINS - 1);
    let mut bins = [(Bounds::EMPTY, 0u32); BINS];
    for (bounds, _) in boxes.iter() {
        let (sum, count) = &mut bins[bin_of(bounds)];
        *sum = joined(sum, bounds);
        *count += 1;
    }
    let mut behind = [0.0; BINS];
    let (mut bounds, mut count) = (Bounds::EMPTY, 0);
    for bin in (1..BINS).rev() {
        (bounds, count) = (joined(&bounds, &bins[bin].0), count + bins[bin].1);
        behind[bin] = area(&bounds) * f64::from(count);
    }
    let (mut best, mut least) = (0, f64::INFINITY);
    (bounds, count) = (Bounds::EMPTY, 0);
    for bin in 1..BINS {
        (bounds, count) = (joined(&bounds, &bins[bin - 1].0), count + bins[bin - 1].1);
        let cost = area(&bounds) * f64::from(count) + behind[bin];
        if cost < least && (1..boxes.len()).contains(&(count as usize)) {
            (best, least) = (bin, cost);
        }
    }
    if best == 0 {
        // All centers are in one place, or too close for the bins.
        let half = boxes.len() / 2;
        boxes.select_nth_unstable_by(half, |a, b| a.0.center()[axis].total_cmp(&b.0.center()[axis]));
        return half;
    }
    let mut half = 0;
    for index in 0..boxes.len() {
        if bin_of(&boxes[index].0) < best {
            boxes.swap(index, half);
            half += 1;
        }
    }
    half
}

fn joined(a: &Bounds, b: &Bounds) -> Bounds {
    Bounds { min: a.min.min(b.min), max: a.max.max(b.max) }
}

/// Half the surface of a box; 0 for the empty one.
fn area(bounds: &Bounds) -> f64 {
    let size = bounds.extent().as_dvec3();
    size.x * size.y + size.y * size.z + size.z * size.x
}

fn widest(extent: Vec3) -> usize {
    if extent.x >= extent.y && extent.x >= extent.z {
        0
    } else if extent.y >= extent.z {
        1
    } else {
        2
    }
}
