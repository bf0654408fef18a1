//! Both levels: rays through the tree of all that is in world space, then through the tree of instances.

use pulp::NullaryFnOnce;

use crate::accel::{LaneMask, is_valid_ray};

use super::blas::{Blas, Closest};
use super::lanes::Lanes;
use super::node::WIDTH;
use super::packet::{PacketRays, RawRays, lane_of};
use super::ray::SingleRay;
use super::scene_tree::Placed;
use super::structure::BvhAccel;
use super::traverse::{STACK, any_hit, closest_hit};
use super::traverse_packet::{Visit, any_hit_packet, closest_hit_packet};
use crate::scene::{Hit, Ray};

/// A ray through the tree of one instance. These tasks are functions of their own, which keeps the code for
/// instances out of the loops of scenes that have none.
struct SingleAny<'a, S> {
    simd: S,
    blas: &'a Blas,
    ray: &'a SingleRay,
}

impl<S: Lanes<WIDTH>> NullaryFnOnce for SingleAny<'_, S> {
    type Output = bool;

    #[inline(always)]
    fn call(self) -> bool {
        self.blas.occluded::<S, STACK>(self.simd, self.ray)
    }
}

struct SingleClosest<'a, S> {
    simd: S,
    blas: &'a Blas,
    ray: &'a SingleRay,
}

impl<S: Lanes<WIDTH>> NullaryFnOnce for SingleClosest<'_, S> {
    type Output = Closest;

    #[inline(always)]
    fn call(self) -> Closest {
        self.blas.intersect::<S, STACK>(self.simd, self.ray)
    }
}

struct PacketAny<'a, K, S, const W: usize> {
    simd: (K, S),
    blas: &'a Blas,
    placed: &'a Placed,
    rays: &'a PacketRays<W>,
    lanes: LaneMask,
}

impl<K: Lanes<W>, S: Lanes<WIDTH>, const W: usize> NullaryFnOnce for PacketAny<'_, K, S, W> {
    type Output = LaneMask;

    #[inline(always)]
    fn call(self) -> LaneMask {
        let local = transformed(self.rays, self.placed, self.lanes);
        self.blas.occluded_packet::<K, S, W, STACK>(self.simd, &local, local.active)
    }
}

struct PacketClosest<'a, K, S, const W: usize> {
    simd: (K, S),
    blas: &'a Blas,
    placed: &'a Placed,
    rays: &'a PacketRays<W>,
    lanes: LaneMask,
}

impl<K: Lanes<W>, S: Lanes<WIDTH>, const W: usize> NullaryFnOnce for PacketClosest<'_, K, S, W> {
    type Output = [Closest; W];

    #[inline(always)]
    fn call(self) -> [Closest; W] {
        let mut local = transformed(self.rays, self.placed, self.lanes);
        let mut closest = no_hits(&local.t_far);
        let active = local.active;
        self.blas.intersect_packet::<K, S, W, STACK>(self.simd, &mut local, active, &mut closest);
        closest
    }
}

impl BvhAccel {
    #[inline(always)]
    pub(super) fn intersect_with<S: Lanes<WIDTH>>(&self, simd: S, ray: &Ray) -> Option<Hit> {
        let single = SingleRay::new(ray).filter(|_| is_valid_ray(ray, self.largest))?;
        let closest = self.fixed.intersect::<S, STACK>(simd, &single);
        let mut best = None;
        self.offer_fixed(&closest, &mut best);
        if self.instances.placed.is_empty() {
            return best;
        }
        let t_far = best.map_or(ray.t_far, |hit| hit.t);
        closest_hit(
            &self.instances.tree,
            simd,
            &single,
            0,
            &mut [0; STACK],
            t_far,
            #[inline(always)]
            |leaf| {
                for &number in &self.instances.leaves[leaf] {
                    self.intersect_placed(simd, number, ray, &mut best);
                }
                best.map_or(ray.t_far, |hit| hit.t)
            },
        );
        best
    }

    #[inline(always)]
    fn intersect_placed<S: Lanes<WIDTH>>(&self, simd: S, number: u32, ray: &Ray, best: &mut Option<Hit>) {
        let Some(placed) = self.instances.placed.get(number as usize) else { return };
        let t_far = best.map_or(ray.t_far, |hit| hit.t);
        let Some(ray) = SingleRay::new(&Ray { t_far, ..placed.to_object.ray(ray) }) else { return };
        let closest =
            simd.vectorize(SingleClosest { simd, blas: &self.instances.trees[placed.tree], ray: &ray });
        offer_placed(&closest, placed.instance, best);
    }

    fn offer_fixed(&self, closest: &Closest, best: &mut Option<Hit>) {
        if closest.id != u32::MAX {
            let (instance, triangle) = self.fixed.resolve(closest.id);
            offer(best, closest, instance, triangle);
        }
    }

    #[inline(always)]
    pub(super) fn occluded_with<S: Lanes<WIDTH>>(&self, simd: S, ray: &Ray) -> bool {
        let Some(single) = SingleRay::new(ray).filter(|_| is_valid_ray(ray, self.largest)) else {
            return false;
        };
        if self.fixed.occluded::<S, STACK>(simd, &single) {
            return true;
        }
        if self.instances.placed.is_empty() {
            return false;
        }
        any_hit(
            &self.instances.tree,
            simd,
            &single,
            0,
            &mut [0; STACK],
            #[inline(always)]
            |leaf| {
                self.instances.leaves[leaf].iter().any(|&number| {
                    let Some(placed) = self.instances.placed.get(number as usize) else { return false };
                    let Some(ray) = SingleRay::new(&placed.to_object.ray(ray)) else { return false };
                    simd.vectorize(SingleAny { simd, blas: &self.instances.trees[placed.tree], ray: &ray })
                })
            },
        )
    }

    #[inline(always)]
    pub(super) fn occluded_lanes<K: Lanes<W>, S: Lanes<WIDTH>, const W: usize>(
        &self,
        simd: (K, S),
        rays: &PacketRays<W>,
    ) -> LaneMask {
        let mut blocked = self.fixed.occluded_packet::<K, S, W, STACK>(simd, rays, rays.active);
        if self.instances.placed.is_empty() {
            return blocked;
        }
        let mut remaining = rays.active & !blocked;
        while remaining != 0 {
            let group = rays.group_of(remaining.trailing_zeros() as usize, remaining);
            remaining &= !group.lanes;
            let visit_leaf = |leaf: usize, lanes: LaneMask| {
                let mut found = 0;
                for &number in &self.instances.leaves[leaf] {
                    let Some(placed) = self.instances.placed.get(number as usize) else { break };
                    let (blas, lanes) = (&self.instances.trees[placed.tree], lanes & !found);
                    found |= simd.0.vectorize(PacketAny { simd, blas, placed, rays, lanes });
                }
                found
            };
            let mut stack = [0; STACK];
            let mut group_stack = [0; STACK];
            blocked |= any_hit_packet::<K, S, W, STACK>(
                &self.instances.tree,
                simd,
                rays,
                &group,
                &mut group_stack,
                #[inline(always)]
                |visit| match visit {
                    Visit::Leaf(leaf, lanes) => visit_leaf(leaf, lanes),
                    Visit::Alone(start, lane) => {
                        let ray = rays.single(&group, lane);
                        let hit = any_hit(&self.instances.tree, simd.1, &ray, start, &mut stack, |leaf| {
                            visit_leaf(leaf, 1 << lane) != 0
                        });
                        u32::from(hit) << lane
                    }
                },
            );
        }
        blocked
    }

    #[inline(always)]
    pub(super) fn intersect_lanes<K: Lanes<W>, S: Lanes<WIDTH>, const W: usize>(
        &self,
        simd: (K, S),
        rays: &mut PacketRays<W>,
    ) -> [Option<Hit>; W] {
        let mut found = [None; W];
        let mut closest = no_hits(&rays.t_far);
        self.fixed.intersect_packet::<K, S, W, STACK>(simd, rays, rays.active, &mut closest);
        for (closest, best) in closest.iter().zip(&mut found) {
            self.offer_fixed(closest, best);
        }
        if self.instances.placed.is_empty() {
            return found;
        }
        let mut remaining = rays.active;
        let mut stack = [0; STACK];
        let mut group_stack = [(0, 0, 0.0); STACK];
        while remaining != 0 {
            let group = rays.group_of(remaining.trailing_zeros() as usize, remaining);
            remaining &= !group.lanes;
            let hits = &mut found;
            let mut visit_leaf = |leaf: usize, lanes: LaneMask, rays: &mut PacketRays<W>| {
                for &number in &self.instances.leaves[leaf] {
                    let Some(placed) = self.instances.placed.get(number as usize) else { break };
                    let blas = &self.instances.trees[placed.tree];
                    let closest = simd.0.vectorize(PacketClosest { simd, blas, placed, rays, lanes });
                    for (lane, closest) in closest.iter().enumerate() {
                        offer_placed(closest, placed.instance, &mut hits[lane]);
                        if let Some(hit) = hits[lane] {
                            rays.t_far[lane] = hit.t;
                        }
                    }
                }
            };
            closest_hit_packet::<K, S, W, STACK>(
                &self.instances.tree,
                simd,
                rays,
                &group,
                &mut group_stack,
                #[inline(always)]
                |visit, rays| match visit {
                    Visit::Leaf(leaf, lanes) => visit_leaf(leaf, lanes, rays),
                    Visit::Alone(start, lane) => {
                        let ray = rays.single(&group, lane);
                        let t_far = ray.t_far;
                        closest_hit(&self.instances.tree, simd.1, &ray, start, &mut stack, t_far, |leaf| {
                            visit_leaf(leaf, 1 << lane, rays);
                            rays.t_far[lane % W]
                        });
                    }
                },
            );
        }
        found
    }
}

#[inline(always)]
fn no_hits<const W: usize>(t_far: &[f32; W]) -> [Closest; W] {
    let mut closest = [Closest::none(0.0); W];
    for (closest, &t_far) in closest.iter_mut().zip(t_far) {
        *closest = Closest::none(t_far);
    }
    closest
}

/// The rays `lanes` in the object space of an instance.
#[inline(always)]
fn transformed<const W: usize>(rays: &PacketRays<W>, placed: &Placed, lanes: LaneMask) -> PacketRays<W> {
    let (mut origin, mut direction) = ([[0.0; W]; 3], [[0.0; W]; 3]);
    for lane in 0..W {
        let point = placed.to_object.point(lane_of(&rays.origin, lane));
        let along = placed.to_object.direction(lane_of(&rays.direction, lane));
        for axis in 0..3 {
            origin[axis][lane] = point[axis];
            direction[axis][lane] = along[axis];
        }
    }
    PacketRays::new(&RawRays { origin, direction, t_near: rays.t_near, t_far: rays.t_far, active: lanes })
}

fn offer_placed(closest: &Closest, instance: u32, best: &mut Option<Hit>) {
    if closest.id != u32::MAX {
        offer(best, closest, instance, closest.id);
    }
}

/// Takes a hit that is nearer, or as near with a lower instance and triangle.
fn offer(best: &mut Option<Hit>, closest: &Closest, instance: u32, triangle: u32) {
    let t = closest.hit.t;
    let better = best.is_none_or(|best| {
        t < best.t || (t == best.t && (instance, triangle) < (best.instance, best.triangle))
    });
    if better {
        *best = Some(Hit { t, u: closest.hit.u, v: closest.hit.v, instance, triangle });
    }
}
