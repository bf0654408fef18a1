//! Single rays through a wide tree.

use super::lanes::Lanes;
use super::node::{FAR_SCALE, LEAF, Node, WIDTH, WideTree};
use super::ray::SingleRay;

/// Entries of a traversal stack; no tree that is built needs more.
pub const STACK: usize = 160;

/// Walks the subtree `start` until `leaf` returns true; whether it did.
#[inline(always)]
pub fn any_hit<S: Lanes<WIDTH>, const STACK: usize>(
    tree: &WideTree,
    simd: S,
    ray: &SingleRay,
    start: u32,
    stack: &mut [u32; STACK],
    mut leaf: impl FnMut(usize) -> bool,
) -> bool {
    if tree.nodes.is_empty() {
        return false;
    }
    let mut size = 0;
    let mut current = start;
    loop {
        if current & LEAF == 0 {
            let node = &tree.nodes[current as usize];
            let (mut hits, _) = node.test(simd, ray, ray.t_far);
            if hits != 0 {
                current = node.children[hits.trailing_zeros() as usize % WIDTH];
                hits &= hits - 1;
                while hits != 0 {
                    stack[size] = current;
                    size += 1;
                    current = node.children[hits.trailing_zeros() as usize % WIDTH];
                    hits &= hits - 1;
                }
                continue;
            }
        } else if leaf((current & !LEAF) as usize) {
            return true;
        }
        if size == 0 {
            return false;
        }
        size -= 1;
        current = stack[size];
    }
}

/// Walks the subtree `start` from near to far; `leaf` returns the new end of the ray's interval.
#[inline(always)]
pub fn closest_hit<S: Lanes<WIDTH>, const STACK: usize>(
    tree: &WideTree,
    simd: S,
    ray: &SingleRay,
    start: u32,
    stack: &mut [u64; STACK],
    mut t_far: f32,
    mut leaf: impl FnMut(usize) -> f32,
) {
    if tree.nodes.is_empty() {
        return;
    }
    let mut size = 0;
    let mut current = start;
    loop {
        if current & LEAF == 0 {
            let node = &tree.nodes[current as usize];
            let (mut hits, near) = node.test(simd, ray, t_far);
            if hits != 0 {
                let first = hits.trailing_zeros() as usize % WIDTH;
                hits &= hits - 1;
                if hits == 0 {
                    current = node.children[first];
                    continue;
                }
                let near = simd.store(near);
                let base = size;
                let mut closest = entry(&near, node, first);
                while hits != 0 {
                    let next = entry(&near, node, hits.trailing_zeros() as usize % WIDTH);
                    hits &= hits - 1;
                    let farther = closest.max(next);
                    closest = closest.min(next);
                    // The stack's end stays the nearest of this node's children.
                    let mut at = size;
                    while at > base && stack[at - 1] < farther {
                        stack[at] = stack[at - 1];
                        at -= 1;
                    }
                    stack[at] = farther;
                    size += 1;
                }
                current = closest as u32;
                continue;
            }
        } else {
            t_far = leaf((current & !LEAF) as usize);
        }
        loop {
            if size == 0 {
                return;
            }
            size -= 1;
            let entry = stack[size];
            if f32::from_bits((entry >> 32) as u32) <= t_far * FAR_SCALE {
                current = entry as u32;
                break;
            }
        }
    }
}

/// Distance in the upper half, which orders entries: floats that aren't negative order like their bits.
#[inline(always)]
fn entry(near: &[f32; WIDTH], node: &Node, slot: usize) -> u64 {
    u64::from(near[slot].to_bits()) << 32 | u64::from(node.children[slot])
}
