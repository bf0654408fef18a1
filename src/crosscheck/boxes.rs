//! A plain binary tree over boxes, walked in double precision. It shares nothing with the trees that it helps
//! to judge.

use glam::{DVec3, Vec3};

use crate::scene::Bounds;

/// Boxes per leaf.
const LEAF: usize = 4;

/// From this many boxes on the two halves are built in parallel.
const PARALLEL: usize = 1 << 14;

/// Tree over numbered boxes, split at the median of the widest axis.
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
    /// Start.
    pub origin: DVec3,
    /// Direction, not 0.
    pub direction: DVec3,
    /// Width per distance of a box's farthest corner from the start.
    pub relative: f64,
    /// Width that is always there.
    pub absolute: f64,
}

impl Walker {
    /// Where the ray enters the widened box, within `0..=limit`.
    fn enters(&self, bounds: &Bounds, limit: f64) -> Option<f64> {
        let (low, high) = (bounds.min.as_dvec3() - self.origin, bounds.max.as_dvec3() - self.origin);
        let pad = self.absolute + self.relative * low.abs().max(high.abs()).length();
        let (mut near, mut far) = (0.0f64, limit);
        for axis in 0..3 {
            let (low, high, d) = (low[axis] - pad, high[axis] + pad, self.direction[axis]);
            if d == 0.0 {
                if low > 0.0 || high < 0.0 {
                    return None;
                }
                continue;
            }
            let (a, b) = (low / d, high / d);
            near = near.max(a.min(b));
            far = far.min(a.max(b));
        }
        (near <= far).then_some(near)
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
    pub fn walk(&self, walker: &Walker, mut limit: f64, mut visit: impl FnMut(u32, f64) -> f64) {
        let mut stack = Vec::with_capacity(64);
        if let Some(near) = self.nodes.first().and_then(|root| walker.enters(&root.bounds, limit)) {
            stack.push((0, near));
        }
        while let Some((index, near)) = stack.pop() {
            let Some(node) = self.nodes.get(index).filter(|_| near <= limit) else { continue };
            if node.right == 0 {
                let range = node.first as usize..(node.first + node.count) as usize;
                for &number in &self.order[range] {
                    limit = visit(number, limit);
                }
                continue;
            }
            let children = [index + 1, index + node.right as usize];
            let met = children.map(|child| walker.enters(&self.nodes[child].bounds, limit));
            let mut met: Vec<_> =
                children.into_iter().zip(met).filter_map(|(child, near)| Some((child, near?))).collect();
            // The nearer child is taken up first.
            met.sort_by(|a, b| b.1.total_cmp(&a.1));
            stack.extend(met);
        }
    }
}

fn build(boxes: &mut [(Bounds, u32)], first: u32, nodes: &mut Vec<Node>) {
    let (mut bounds, mut centers) = (Bounds::EMPTY, Bounds::EMPTY);
    for (bound, _) in boxes.iter() {
        bounds.extend(bound.min);
        bounds.extend(bound.max);
        centers.extend(bound.center());
    }
    let index = nodes.len();
    let count = boxes.len();
    nodes.push(Node { bounds, first, count: count as u32, right: 0 });
    if count <= LEAF {
        return;
    }
    let extent = centers.extent();
    let axis = widest(extent);
    let (left, _, _) =
        boxes.select_nth_unstable_by(count / 2, |a, b| a.0.center()[axis].total_cmp(&b.0.center()[axis]));
    let half = left.len();
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

fn widest(extent: Vec3) -> usize {
    if extent.x >= extent.y && extent.x >= extent.z {
        0
    } else if extent.y >= extent.z {
        1
    } else {
        2
    }
}
