//! Groups of rays through a wide tree.
//!
//! A node is tested in the way that is cheaper for the number of rays that reach it: while many do, all
//! rays against one child after the other; when few are left, one ray after the other against
//! all children; the last few go on alone.

use crate::accel::LaneMask;

use super::lanes::Lanes;
use super::node::{FAR_SCALE, LEAF, WIDTH, WideTree};
use super::packet::{GROUP_TEST, Group, PacketRays, least};

/// Up to this many rays walk on one by one.
const ALONE: u32 = 3;

/// What a walk with several rays leaves to its caller.
pub enum Visit {
    /// A leaf that these lanes reach.
    Leaf(usize, LaneMask),
    /// A subtree that one lane alone reaches.
    Alone(u32, usize),
}

/// Walks the tree with all rays of a group; `visit` returns the lanes that are blocked.
#[inline(always)]
pub fn any_hit_packet<K: Lanes<W>, S: Lanes<WIDTH>, const W: usize, const STACK: usize>(
    tree: &WideTree,
    (wide, narrow): (K, S),
    rays: &PacketRays<W>,
    group: &Group<W>,
    stack: &mut [u64; STACK],
    mut visit: impl FnMut(Visit) -> LaneMask,
) -> LaneMask {
    let mut alive = group.lanes;
    if tree.nodes.is_empty() {
        return 0;
    }
    let mut size = 0;
    for_each_start(group, |lanes| {
        stack[size] = u64::from(lanes) << 32;
        size += 1;
    });
    while size > 0 {
        size -= 1;
        let entry = stack[size];
        let lanes = (entry >> 32) as u32 & alive;
        let current = entry as u32;
        if lanes == 0 {
            continue;
        }
        if lanes.count_ones() <= ALONE {
            let mut left = lanes;
            while left != 0 {
                alive &= !visit(Visit::Alone(current, left.trailing_zeros() as usize));
                left &= left - 1;
            }
        } else if current & LEAF != 0 {
            alive &= !visit(Visit::Leaf((current & !LEAF) as usize, lanes));
        } else {
            let node = &tree.nodes[current as usize];
            if lanes.count_ones() >= GROUP_TEST {
                let mut used = rays.may_meet(narrow, group, node);
                while used != 0 {
                    let slot = used.trailing_zeros() as usize % WIDTH;
                    used &= used - 1;
                    let met = rays.test_child(wide, group, node, slot).0 & lanes;
                    if met != 0 {
                        stack[size] = u64::from(met) << 32 | u64::from(node.children[slot]);
                        size += 1;
                    }
                }
            } else {
                let mut met = [0u32; WIDTH];
                let mut any = 0;
                let mut left = lanes;
                while left != 0 {
                    let lane = left.trailing_zeros() as usize;
                    left &= left - 1;
                    let ray = rays.single(group, lane);
                    let (mut hits, _) = node.test(narrow, &ray, ray.t_far);
                    any |= hits;
                    while hits != 0 {
                        met[hits.trailing_zeros() as usize % WIDTH] |= 1 << lane;
                        hits &= hits - 1;
                    }
                }
                while any != 0 {
                    let slot = any.trailing_zeros() as usize % WIDTH;
                    any &= any - 1;
                    stack[size] = u64::from(met[slot]) << 32 | u64::from(node.children[slot]);
                    size += 1;
                }
            }
        }
        if alive == 0 {
            break;
        }
    }
    group.lanes & !alive
}

/// Walks the tree from near to far with all rays of a group; `visit` lowers the lanes' `t_far`.
#[inline(always)]
pub fn closest_hit_packet<K: Lanes<W>, S: Lanes<WIDTH>, const W: usize, const STACK: usize>(
    tree: &WideTree,
    (wide, narrow): (K, S),
    rays: &mut PacketRays<W>,
    group: &Group<W>,
    stack: &mut [(u32, LaneMask, f32); STACK],
    mut visit: impl FnMut(Visit, &mut PacketRays<W>),
) {
    if tree.nodes.is_empty() || group.lanes == 0 {
        return;
    }
    let mut size = 0;
    for_each_start(group, |lanes| {
        stack[size] = (0, lanes, 0.0);
        size += 1;
    });
    while size > 0 {
        size -= 1;
        let (current, lanes, near) = stack[size];
        // Lanes that found something before this subtree begins are done with it.
        let lanes =
            lanes & wide.le(wide.splat(near), wide.mul(wide.load(&rays.t_far), wide.splat(FAR_SCALE)));
        if lanes == 0 {
            continue;
        }
        if lanes.count_ones() <= ALONE {
            let mut left = lanes;
            while left != 0 {
                visit(Visit::Alone(current, left.trailing_zeros() as usize), rays);
                left &= left - 1;
            }
            continue;
        }
        if current & LEAF != 0 {
            visit(Visit::Leaf((current & !LEAF) as usize, lanes), rays);
            continue;
        }
        let node = &tree.nodes[current as usize];
        let mut met = [0u32; WIDTH];
        let mut any = 0;
        // Where the first of the rays enters each child: orders and later culls.
        let mut nearest = [0.0f32; WIDTH];
        if lanes.count_ones() >= GROUP_TEST {
            let mut used = rays.may_meet(narrow, group, node);
            while used != 0 {
                let slot = used.trailing_zeros() as usize % WIDTH;
                used &= used - 1;
                let (hits, near) = rays.test_child(wide, group, node, slot);
                met[slot] = hits & lanes;
                if met[slot] != 0 {
                    any |= 1 << slot;
                    nearest[slot] = least(wide.store(near));
                }
            }
        } else {
            let mut least = narrow.splat(f32::INFINITY);
            let mut left = lanes;
            while left != 0 {
                let lane = left.trailing_zeros() as usize;
                left &= left - 1;
                let ray = rays.single(group, lane);
                let (mut hits, near) = node.test(narrow, &ray, ray.t_far);
                least = narrow.min(near, least);
                any |= hits;
                while hits != 0 {
                    met[hits.trailing_zeros() as usize % WIDTH] |= 1 << lane;
                    hits &= hits - 1;
                }
            }
            nearest = narrow.store(least);
        }
        let base = size;
        while any != 0 {
            let slot = any.trailing_zeros() as usize % WIDTH;
            any &= any - 1;
            let key = nearest[slot];
            let mut at = size;
            while at > base && stack[at - 1].2 < key {
                stack[at] = stack[at - 1];
                at -= 1;
            }
            stack[at] = (node.children[slot], met[slot], key);
            size += 1;
        }
    }
}

/// Calls `start` with the lanes that begin at the root together: all of a large group, each of a small one.
#[inline(always)]
fn for_each_start<const W: usize>(group: &Group<W>, mut start: impl FnMut(LaneMask)) {
    if group.lanes.count_ones() >= GROUP_TEST {
        return start(group.lanes);
    }
    let mut left = group.lanes;
    while left != 0 {
        start(left & left.wrapping_neg());
        left &= left - 1;
    }
}
