//! From the binary tree to wide nodes and groups of up to eight primitives.

use super::build::{BinaryNode, Primitive, build};
use super::node::{BOX_PADDING, LEAF, Node, WIDTH, WideTree};

/// Primitives of one leaf: a range of the built order.
#[derive(Clone, Copy, Debug)]
pub struct Group {
    pub first: u32,
    pub count: u32,
}

/// A wide tree, its leaves, and the primitives' numbers in the order that leaves refer to.
pub struct Collapsed {
    pub tree: WideTree,
    pub groups: Vec<Group>,
    pub order: Vec<u32>,
}

/// Builds the wide tree over some primitives.
pub fn build_wide(mut primitives: Vec<Primitive>) -> Collapsed {
    let binary = build(&mut primitives);
    let order: Vec<u32> = primitives.iter().map(Primitive::id).collect();
    drop(primitives);
    let mut collapse = Collapse { binary: &binary, nodes: Vec::new(), groups: Vec::new() };
    let mut tree = WideTree::default();
    if let Some(root) = binary.last() {
        tree.bounds = [root.lower, root.upper];
        // The root is pushed first, its children replace one entry each.
        tree.stack_bound = 1 + collapse.emit(binary.len() - 1).1;
    }
    tree.nodes = collapse.nodes;
    Collapsed { tree, groups: collapse.groups, order }
}

struct Collapse<'a> {
    binary: &'a [BinaryNode],
    nodes: Vec<Node>,
    groups: Vec<Group>,
}

impl Collapse<'_> {
    /// Emits the wide node that stands for a binary one; returns its index and the stack entries
    /// that its traversal needs.
    fn emit(&mut self, root: usize) -> (u32, usize) {
        let mut children = [0; WIDTH];
        let mut count = 0;
        if self.binary[root].split[0] == 1 {
            (children[0], count) = (root, 1);
        } else {
            self.gather(root, WIDTH, &mut children, &mut count);
        }
        let index = self.nodes.len();
        self.nodes.push(Node::EMPTY);
        let mut node = Node::EMPTY;
        let children = &children[..count];
        // Leaves first, so that the blocks of one node lie side by side.
        for (slot, &child) in children.iter().enumerate() {
            let binary = &self.binary[child];
            for (axis, (lower, upper)) in padded(binary.lower, binary.upper).into_iter().enumerate() {
                node.planes[2 * axis][slot] = lower;
                node.planes[2 * axis + 1][slot] = upper;
            }
            node.used |= 1 << slot;
            if binary.split[0] == 1 {
                node.children[slot] = LEAF | self.groups.len() as u32;
                self.groups.push(Group { first: binary.first, count: binary.count });
            }
        }
        let mut deepest = 0;
        for (slot, &child) in children.iter().enumerate() {
            if self.binary[child].split[0] != 1 {
                let (child_index, needed) = self.emit(child);
                node.children[slot] = child_index;
                deepest = deepest.max(needed);
            }
        }
        self.nodes[index] = node;
        (index as u32, count + deepest)
    }

    /// Lists the children that the dynamic programme chose for at most `limit` slots.
    fn gather(&self, root: usize, mut limit: usize, children: &mut [usize; WIDTH], count: &mut usize) {
        let node = &self.binary[root];
        while limit > 1 && node.split[limit - 1] == 0 {
            limit -= 1;
        }
        if limit == 1 {
            children[*count] = root;
            *count += 1;
            return;
        }
        let to_left = usize::from(node.split[limit - 1]);
        let right = root - 1;
        let left = right - node.right_size as usize;
        self.gather(left, to_left, children, count);
        self.gather(right, limit - to_left, children, count);
    }
}

/// Box planes per axis, moved outwards by [`BOX_PADDING`].
pub fn padded(lower: [f32; 3], upper: [f32; 3]) -> [(f32, f32); 3] {
    let largest = lower.iter().chain(&upper).fold(0.0f32, |largest, c| largest.max(c.abs()));
    let padding = largest * BOX_PADDING;
    std::array::from_fn(|axis| (lower[axis] - padding, upper[axis] + padding))
}
