//! A walk over the finished trees that checks what traversal relies on.

use super::blas::Blas;
use super::collapse::padded;
use super::node::{LEAF, NO_CHILD, WIDTH, WideTree};
use super::structure::BvhAccel;

type Box3 = [[f32; 3]; 2];

impl BvhAccel {
    /// Checks the trees: every leaf and every node is referenced exactly once, every finite triangle is in
    /// exactly one leaf, children's boxes lie inside their parents', and hold what is below
    /// them. The error names the place; for tests.
    #[doc(hidden)]
    // For tests and benches only.
    #[doc(hidden)]
    pub fn validate(&self) -> Result<(), String> {
        for blas in self.instances.trees.iter().chain([&self.fixed]) {
            validate_blas(blas)?;
        }
        let instances = &self.instances;
        let mut seen = vec![false; instances.placed.len()];
        walk(&instances.tree, instances.leaves.len(), |leaf, _| {
            for &number in instances.leaves[leaf].iter().filter(|&&number| number != u32::MAX) {
                match seen.get_mut(number as usize) {
                    Some(seen) if !*seen => *seen = true,
                    _ => {
                        return Err(format!(
                            "placed instance {number} is referenced twice or does not exist"
                        ));
                    }
                }
            }
            Ok(())
        })?;
        match seen.iter().position(|seen| !seen) {
            Some(missing) => Err(format!("placed instance {missing} is in no leaf")),
            None => Ok(()),
        }
    }

    /// A digest of all trees, equal for equal trees; for tests of the build's determinism.
    #[doc(hidden)]
    // For tests and benches only.
    #[doc(hidden)]
    pub fn digest(&self) -> u64 {
        use std::hash::{DefaultHasher, Hash, Hasher};
        let mut hasher = DefaultHasher::new();
        let trees = self.instances.trees.iter().chain([&self.fixed]);
        for tree in trees.clone().map(|blas| &blas.tree).chain([&self.instances.tree]) {
            for node in &tree.nodes {
                node.planes.as_flattened().iter().for_each(|plane| plane.to_bits().hash(&mut hasher));
                (node.children, node.used).hash(&mut hasher);
            }
        }
        for block in trees.flat_map(|blas| &blas.blocks) {
            block.ids.hash(&mut hasher);
            let corners = block.corners.as_flattened().as_flattened();
            corners.iter().for_each(|coordinate| coordinate.to_bits().hash(&mut hasher));
        }
        self.instances.leaves.hash(&mut hasher);
        hasher.finish()
    }

    /// Number of triangles in the trees; those of an instanced mesh count once; for tests.
    #[doc(hidden)]
    // For tests and benches only.
    #[doc(hidden)]
    pub fn triangle_count(&self) -> usize {
        let blocks = self.instances.trees.iter().chain([&self.fixed]).flat_map(|blas| &blas.blocks);
        blocks.map(|block| block.used().count_ones() as usize).sum()
    }
}

fn validate_blas(blas: &Blas) -> Result<(), String> {
    let mut ids = Vec::new();
    walk(&blas.tree, blas.blocks.len(), |leaf, bounds| {
        let block = &blas.blocks[leaf];
        if block.used() == 0 {
            return Err(format!("leaf {leaf} is empty"));
        }
        for lane in (0..WIDTH).filter(|lane| block.used() >> lane & 1 != 0) {
            ids.push(block.ids[lane]);
            for corner in &block.corners {
                let point = [0, 1, 2].map(|axis| corner[axis][lane]);
                if !inside(&[point, point], bounds) {
                    return Err(format!("triangle {} sticks out of leaf {leaf}", block.ids[lane]));
                }
            }
        }
        Ok(())
    })?;
    ids.sort_unstable();
    match ids.windows(2).find(|pair| pair[0] == pair[1]) {
        Some(pair) => Err(format!("triangle {} is in two leaves", pair[0])),
        None => Ok(()),
    }
}

fn walk(
    tree: &WideTree,
    leaf_count: usize,
    mut leaf: impl FnMut(usize, &Box3) -> Result<(), String>,
) -> Result<(), String> {
    let mut nodes_seen = vec![false; tree.nodes.len()];
    let mut leaves_seen = vec![false; leaf_count];
    let root = padded(tree.bounds[0], tree.bounds[1]);
    let root = [root.map(|(lower, _)| lower), root.map(|(_, upper)| upper)];
    let mut stack = if tree.nodes.is_empty() { vec![] } else { vec![(0u32, root)] };
    while let Some((reference, bounds)) = stack.pop() {
        let is_leaf = reference & LEAF != 0;
        let seen = if is_leaf { &mut leaves_seen } else { &mut nodes_seen };
        match seen.get_mut((reference & !LEAF) as usize) {
            Some(seen) if !*seen => *seen = true,
            _ => return Err(format!("reference {reference:#x} occurs twice or leads nowhere")),
        }
        if is_leaf {
            leaf((reference & !LEAF) as usize, &bounds)?;
            continue;
        }
        let node = &tree.nodes[reference as usize];
        for slot in 0..WIDTH {
            let used = node.used >> slot & 1 != 0;
            if used != (node.children[slot] != NO_CHILD) {
                return Err(format!("node {reference} is wrong about its slot {slot}"));
            }
            let plane = |index: usize| node.planes[index][slot];
            let child = [[plane(0), plane(2), plane(4)], [plane(1), plane(3), plane(5)]];
            if used && !inside(&child, &bounds) {
                return Err(format!("child {slot} sticks out of node {reference}"));
            }
            if used {
                stack.push((node.children[slot], child));
            }
        }
    }
    match nodes_seen.iter().chain(&leaves_seen).all(|&seen| seen) {
        true => Ok(()),
        false => Err("a node or leaf is not referenced".to_owned()),
    }
}

fn inside(inner: &Box3, outer: &Box3) -> bool {
    (0..3).all(|axis| outer[0][axis] <= inner[0][axis] && inner[1][axis] <= outer[1][axis])
}
