//! Groups of rays against the leaves of a tree of triangles.

use crate::accel::LaneMask;

use super::blas::{Blas, Closest};
use super::lanes::{Lanes, map3};
use super::node::{TriangleBlock, WIDTH};
use super::packet::{Group, PacketRays};
use super::traverse::{any_hit, closest_hit};
use super::traverse_packet::{Visit, any_hit_packet, closest_hit_packet};
use super::triangle::{Distances, EdgeTest, LaneHit, test_edges};

impl Blas {
    /// The lanes of a packet that are blocked.
    #[inline(always)]
    pub fn occluded_packet<K: Lanes<W>, S: Lanes<WIDTH>, const W: usize, const STACK: usize>(
        &self,
        (wide, narrow): (K, S),
        rays: &PacketRays<W>,
        active: LaneMask,
    ) -> LaneMask {
        let mut blocked = 0;
        let mut remaining = active & rays.active;
        let mut stack = [0; STACK];
        let mut group_stack = [0; STACK];
        while remaining != 0 {
            let group = rays.group_of(remaining.trailing_zeros() as usize, remaining);
            remaining &= !group.lanes;
            blocked |= any_hit_packet::<K, S, W, STACK>(
                &self.tree,
                (wide, narrow),
                rays,
                &group,
                &mut group_stack,
                #[inline(always)]
                |visit| match visit {
                    Visit::Leaf(leaf, lanes) => {
                        self.leaf_occluded((wide, narrow), rays, &group, &self.blocks[leaf], lanes)
                    }
                    Visit::Alone(start, lane) => {
                        let ray = rays.single(&group, lane);
                        let hit = any_hit(
                            &self.tree,
                            narrow,
                            &ray,
                            start,
                            &mut stack,
                            #[inline(always)]
                            |leaf| self.occluded_by_block(narrow, &self.blocks[leaf], &ray),
                        );
                        u32::from(hit) << lane
                    }
                },
            );
        }
        blocked
    }

    /// Closest hits of a packet: lowers `t_far` and sets `closest` of lanes that hit.
    #[inline(always)]
    pub fn intersect_packet<K: Lanes<W>, S: Lanes<WIDTH>, const W: usize, const STACK: usize>(
        &self,
        (wide, narrow): (K, S),
        rays: &mut PacketRays<W>,
        active: LaneMask,
        closest: &mut [Closest; W],
    ) {
        let mut found = ClosestLanes { u: [0.0; W], v: [0.0; W], ids: [u32::MAX; W] };
        let mut remaining = active & rays.active;
        let mut stack = [0; STACK];
        let mut group_stack = [(0, 0, 0.0); STACK];
        while remaining != 0 {
            let group = rays.group_of(remaining.trailing_zeros() as usize, remaining);
            remaining &= !group.lanes;
            closest_hit_packet::<K, S, W, STACK>(
                &self.tree,
                (wide, narrow),
                rays,
                &group,
                &mut group_stack,
                #[inline(always)]
                |visit, rays| match visit {
                    Visit::Leaf(leaf, lanes) => {
                        self.leaf_closest(
                            (wide, narrow),
                            rays,
                            &group,
                            &self.blocks[leaf],
                            lanes,
                            &mut found,
                        );
                    }
                    Visit::Alone(start, lane) => {
                        let ray = rays.single(&group, lane);
                        let mut best = found.lane(lane, ray.t_far);
                        closest_hit(
                            &self.tree,
                            narrow,
                            &ray,
                            start,
                            &mut stack,
                            ray.t_far,
                            #[inline(always)]
                            |leaf| {
                                self.intersect_block(narrow, &self.blocks[leaf], &ray, &mut best);
                                best.hit.t
                            },
                        );
                        found.set_lane(lane, &best, rays);
                    }
                },
            );
        }
        for (lane, closest) in closest.iter_mut().enumerate() {
            *closest = found.lane(lane, rays.t_far[lane]);
        }
    }

    #[inline(always)]
    fn leaf_occluded<K: Lanes<W>, S: Lanes<WIDTH>, const W: usize>(
        &self,
        (wide, narrow): (K, S),
        rays: &PacketRays<W>,
        group: &Group<W>,
        block: &TriangleBlock,
        lanes: LaneMask,
    ) -> LaneMask {
        let mut blocked = 0;
        let used = block.used();
        if lanes.count_ones() <= used.count_ones() {
            let mut left = lanes;
            while left != 0 {
                let lane = left.trailing_zeros() as usize;
                left &= left - 1;
                let hit = self.occluded_by_block(narrow, block, &rays.single(group, lane));
                blocked |= u32::from(hit) << lane;
            }
            return blocked;
        }
        let mut triangles = used;
        while triangles != 0 && lanes & !blocked != 0 {
            let triangle = triangles.trailing_zeros() as usize % WIDTH;
            triangles &= triangles - 1;
            let Some((edges, distances)) =
                test_triangle(wide, rays, group, block, triangle, lanes & !blocked)
            else {
                continue;
            };
            if !self.has_masks {
                blocked |= distances.hits;
            }
            let mut hits = (distances.hits | distances.undecided) & !blocked;
            while hits != 0 {
                let lane = hits.trailing_zeros() as usize % W;
                hits &= hits - 1;
                let interval = [rays.t_near[lane], rays.t_far[lane]];
                let hit = edges.decide(wide, &distances, lane, group.shear[2][lane], interval);
                if hit.is_some_and(|hit| self.is_opaque(block.ids[triangle], &hit)) {
                    blocked |= 1 << lane;
                }
            }
        }
        blocked
    }

    #[inline(always)]
    fn leaf_closest<K: Lanes<W>, S: Lanes<WIDTH>, const W: usize>(
        &self,
        (wide, narrow): (K, S),
        rays: &mut PacketRays<W>,
        group: &Group<W>,
        block: &TriangleBlock,
        lanes: LaneMask,
        found: &mut ClosestLanes<W>,
    ) {
        let used = block.used();
        if lanes.count_ones() <= used.count_ones() {
            let mut left = lanes;
            while left != 0 {
                let lane = left.trailing_zeros() as usize % W;
                left &= left - 1;
                let mut best = found.lane(lane, rays.t_far[lane]);
                if self.intersect_block(narrow, block, &rays.single(group, lane), &mut best) {
                    found.set_lane(lane, &best, rays);
                }
            }
            return;
        }
        let mut triangles = used;
        while triangles != 0 {
            let triangle = triangles.trailing_zeros() as usize % WIDTH;
            triangles &= triangles - 1;
            let Some((edges, distances)) = test_triangle(wide, rays, group, block, triangle, lanes) else {
                continue;
            };
            let id = block.ids[triangle];
            if distances.undecided == 0 && !self.has_masks {
                if distances.hits != 0 {
                    found.offer_all(&distances, id, rays);
                }
                continue;
            }
            let mut hits = distances.hits | distances.undecided;
            while hits != 0 {
                let lane = hits.trailing_zeros() as usize % W;
                hits &= hits - 1;
                let interval = [rays.t_near[lane], rays.t_far[lane]];
                let hit = edges.decide(wide, &distances, lane, group.shear[2][lane], interval);
                let mut best = found.lane(lane, rays.t_far[lane]);
                if let Some(hit) = hit
                    && self.is_opaque(id, &hit)
                    && best.offer(hit, id)
                {
                    found.set_lane(lane, &best, rays);
                }
            }
        }
    }
}

/// Closest hits of a packet, whose distances are the rays' `t_far`.
struct ClosestLanes<const W: usize> {
    u: [f32; W],
    v: [f32; W],
    ids: [u32; W],
}

impl<const W: usize> ClosestLanes<W> {
    #[inline(always)]
    fn lane(&self, lane: usize, t_far: f32) -> Closest {
        let lane = lane % W;
        Closest { hit: LaneHit { t: t_far, u: self.u[lane], v: self.v[lane] }, id: self.ids[lane] }
    }

    #[inline(always)]
    fn set_lane(&mut self, lane: usize, closest: &Closest, rays: &mut PacketRays<W>) {
        let lane = lane % W;
        rays.t_far[lane] = closest.hit.t;
        (self.u[lane], self.v[lane], self.ids[lane]) = (closest.hit.u, closest.hit.v, closest.id);
    }

    /// [`Closest::offer`] for all lanes that one triangle hits; without branches, so that it vectorises.
    #[inline(always)]
    fn offer_all(&mut self, distances: &Distances<W>, id: u32, rays: &mut PacketRays<W>) {
        for lane in 0..W {
            let hit = distances.hit(lane);
            let nearer = (hit.t < rays.t_far[lane]) | ((hit.t == rays.t_far[lane]) & (id < self.ids[lane]));
            let better = nearer & (distances.hits >> lane & 1 != 0);
            rays.t_far[lane] = if better { hit.t } else { rays.t_far[lane] };
            self.u[lane] = if better { hit.u } else { self.u[lane] };
            self.v[lane] = if better { hit.v } else { self.v[lane] };
            self.ids[lane] = if better { id } else { self.ids[lane] };
        }
    }
}

/// One triangle against the rays `lanes` of a group; `None` if it is clear that none hits.
#[inline(always)]
fn test_triangle<K: Lanes<W>, const W: usize>(
    simd: K,
    rays: &PacketRays<W>,
    group: &Group<W>,
    block: &TriangleBlock,
    triangle: usize,
    lanes: LaneMask,
) -> Option<(EdgeTest<K::F>, Distances<W>)> {
    let corners = map3(
        [&block.corners[0], &block.corners[1], &block.corners[2]],
        #[inline(always)]
        |corner| {
            map3(
                group.axes,
                #[inline(always)]
                |axis| simd.splat(corner[axis][triangle]),
            )
        },
    );
    let origin = map3(
        group.axes,
        #[inline(always)]
        |axis| simd.load(&rays.origin[axis]),
    );
    let shear = map3(
        [&group.shear[0], &group.shear[1], &group.shear[2]],
        #[inline(always)]
        |s| simd.load(s),
    );
    let edges = test_edges::<K, W>(simd, corners, origin, shear);
    let candidates = edges.candidates & lanes;
    if candidates == 0 {
        return None;
    }
    let distances =
        edges.distances::<K, W>(simd, candidates, shear[2], simd.load(&rays.t_near), simd.load(&rays.t_far));
    Some((edges, distances))
}
