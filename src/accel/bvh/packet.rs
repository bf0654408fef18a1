//! Packets of rays, grouped so that all rays of a group see boxes and triangles from the same sides.

use crate::accel::LaneMask;

use super::lanes::{Lanes, map3};
use super::node::{FAR_SCALE, Node, WIDTH};
use super::ray::{SingleRay, largest_axis, safe_reciprocal};

/// From this many rays on a node's children are tested one by one against the whole group.
pub const GROUP_TEST: u32 = 6;

/// `W` rays as a structure of arrays, prepared for traversal.
#[derive(Clone)]
pub struct PacketRays<const W: usize> {
    pub origin: [[f32; W]; 3],
    pub direction: [[f32; W]; 3],
    reciprocal: [[f32; W]; 3],
    scaled_origin: [[f32; W]; 3],
    pub t_near: [f32; W],
    pub t_far: [f32; W],
    /// Lanes that can hit anything.
    pub active: LaneMask,
    /// Signs of the direction and its largest axis, in one number.
    kinds: [u8; W],
}

/// `W` rays as they come.
#[derive(Clone, Copy)]
pub struct RawRays<const W: usize> {
    pub origin: [[f32; W]; 3],
    pub direction: [[f32; W]; 3],
    pub t_near: [f32; W],
    pub t_far: [f32; W],
    pub active: LaneMask,
}

/// Lanes of one packet with the same direction signs and the same largest axis.
#[derive(Clone, Copy)]
pub struct Group<const W: usize> {
    pub lanes: LaneMask,
    pub signs: [usize; 3],
    pub axes: [usize; 3],
    pub shear: [[f32; W]; 3],
    /// Ranges over the group's rays, axis by axis; unset for groups below [`GROUP_TEST`].
    origins: [(f32, f32); 3],
    reciprocals: [(f32, f32); 3],
}

impl<const W: usize> PacketRays<W> {
    /// Prepares those rays that [`SingleRay::new`] would accept.
    #[inline(always)]
    pub fn new(raw: &RawRays<W>) -> Self {
        let RawRays { origin, direction, t_near, t_far, active } = *raw;
        let mut rays = Self {
            origin,
            direction,
            reciprocal: [[0.0; W]; 3],
            scaled_origin: [[0.0; W]; 3],
            t_near,
            t_far,
            active: 0,
            kinds: [0; W],
        };
        for lane in 0..W {
            let o = lane_of(&origin, lane);
            let d = lane_of(&direction, lane);
            let largest = d[0].abs().max(d[1].abs()).max(d[2].abs());
            let near = t_near[lane].max(0.0) + 0.0;
            // x · 0 is 0 for finite x only.
            let finite = (o[0] + o[1] + o[2]) * 0.0 + (d[0] + d[1] + d[2]) * 0.0 == 0.0 || is_finite(o, d);
            let fit = finite & (largest > 0.0) & !t_near[lane].is_nan() & (near <= t_far[lane]);
            rays.active |= (u32::from(fit) << lane) & active;
            rays.t_near[lane] = near;
            rays.t_far[lane] = t_far[lane].min(f32::MAX);
            for axis in 0..3 {
                let (reciprocal, scaled) = safe_reciprocal(o[axis], d[axis], largest);
                rays.reciprocal[axis][lane] = reciprocal;
                rays.scaled_origin[axis][lane] = scaled;
            }
            let signs = map3(d, |d| d.to_bits() >> 31);
            rays.kinds[lane] =
                (signs[0] | signs[1] << 1 | signs[2] << 2 | (largest_axis(d) as u32) << 3) as u8;
        }
        rays
    }

    /// The group that lane `first` belongs to, within `lanes`.
    #[inline(always)]
    pub fn group_of(&self, first: usize, lanes: LaneMask) -> Group<W> {
        let kind = self.kinds[first % W];
        let mut mask = 0;
        for (lane, &other) in self.kinds.iter().enumerate() {
            mask |= u32::from(other == kind) << lane;
        }
        let kz = usize::from(kind >> 3) % 3;
        let kx = (kz + 1) % 3;
        let ky = (kz + 2) % 3;
        let lanes = mask & lanes;
        let signs = [usize::from(kind & 1), usize::from(kind >> 1 & 1), usize::from(kind >> 2 & 1)];
        let mut group = Group {
            lanes,
            signs,
            axes: [kx, ky, kz],
            shear: [[0.0; W]; 3],
            origins: [(0.0, 0.0); 3],
            reciprocals: [(0.0, 0.0); 3],
        };
        if lanes.count_ones() >= GROUP_TEST {
            for lane in 0..W {
                self.set_shear(&mut group, lane);
            }
            for axis in 0..3 {
                group.origins[axis] = range(&self.origin[axis], first, lanes);
                group.reciprocals[axis] = range(&self.reciprocal[axis], first, lanes);
            }
        } else {
            let mut left = lanes;
            while left != 0 {
                self.set_shear(&mut group, left.trailing_zeros() as usize % W);
                left &= left - 1;
            }
        }
        group
    }

    #[inline(always)]
    fn set_shear(&self, group: &mut Group<W>, lane: usize) {
        let [kx, ky, kz] = group.axes;
        let dz = self.direction[kz][lane];
        group.shear[0][lane] = self.direction[kx][lane] / dz;
        group.shear[1][lane] = self.direction[ky][lane] / dz;
        group.shear[2][lane] = 1.0 / dz;
    }

    /// One lane of a group as a single ray.
    #[inline(always)]
    pub fn single(&self, group: &Group<W>, lane: usize) -> SingleRay {
        let lane = lane % W;
        SingleRay {
            origin: lane_of(&self.origin, lane),
            reciprocal: lane_of(&self.reciprocal, lane),
            scaled_origin: lane_of(&self.scaled_origin, lane),
            signs: group.signs,
            axes: group.axes,
            shear: lane_of(&group.shear, lane),
            t_near: self.t_near[lane],
            t_far: self.t_far[lane],
        }
    }

    /// The children of a node that any ray of the group may meet, by interval arithmetic: cheaper than
    /// testing each ray, and never less.
    #[inline(always)]
    pub fn may_meet<S: Lanes<WIDTH>>(&self, simd: S, group: &Group<W>, node: &Node) -> u32 {
        let (mut near, mut far) = (simd.splat(0.0), simd.splat(f32::MAX));
        for axis in 0..3 {
            let sign = group.signs[axis] & 1;
            let (least_origin, most_origin) = group.origins[axis];
            // From the origin that reaches the near planes first, and the far planes last.
            let (early, late) =
                if sign == 0 { (most_origin, least_origin) } else { (least_origin, most_origin) };
            let (a, b) = group.reciprocals[axis];
            let (a, b) = (simd.splat(a), simd.splat(b));
            let enter = simd.sub(simd.load(&node.planes[2 * axis + sign]), simd.splat(early));
            let leave = simd.sub(simd.load(&node.planes[2 * axis + (sign ^ 1)]), simd.splat(late));
            let (enter_a, enter_b) = (simd.mul(enter, a), simd.mul(enter, b));
            let (leave_a, leave_b) = (simd.mul(leave, a), simd.mul(leave, b));
            // A NaN, from an overflow, must not cull: it is the first operand and drops out.
            near = simd.max(simd.min(enter_a, simd.min(enter_b, simd.splat(f32::MAX))), near);
            far = simd.min(simd.max(leave_a, simd.max(leave_b, simd.splat(-f32::MAX))), far);
        }
        simd.le(near, simd.mul(far, simd.splat(FAR_SCALE))) & node.used
    }

    /// Where the rays meet one plane of a child.
    #[inline(always)]
    fn distance<K: Lanes<W>>(&self, simd: K, node: &Node, slot: usize, axis: usize, upper: usize) -> K::F {
        let plane = simd.splat(node.planes[2 * axis + (upper & 1)][slot % WIDTH]);
        simd.mul_sub(plane, simd.load(&self.reciprocal[axis]), simd.load(&self.scaled_origin[axis]))
    }

    /// The lanes that meet one child of a node and where: [`Node::test`] the other way round.
    #[inline(always)]
    pub fn test_child<K: Lanes<W>>(
        &self,
        simd: K,
        group: &Group<W>,
        node: &Node,
        slot: usize,
    ) -> (LaneMask, K::F) {
        let [sx, sy, sz] = group.signs;
        let near = simd.max(self.distance(simd, node, slot, 0, sx), simd.load(&self.t_near));
        let near = simd.max(
            self.distance(simd, node, slot, 2, sz),
            simd.max(self.distance(simd, node, slot, 1, sy), near),
        );
        let far = simd.min(self.distance(simd, node, slot, 0, sx ^ 1), simd.load(&self.t_far));
        let far = simd.min(
            self.distance(simd, node, slot, 2, sz ^ 1),
            simd.min(self.distance(simd, node, slot, 1, sy ^ 1), far),
        );
        (simd.le(near, simd.mul(far, simd.splat(FAR_SCALE))), near)
    }
}

/// Least and greatest value of some lanes, of which `first` is one.
#[inline(always)]
fn range<const W: usize>(values: &[f32; W], first: usize, lanes: LaneMask) -> (f32, f32) {
    let mut members = *values;
    for (lane, member) in members.iter_mut().enumerate() {
        *member = if lanes >> lane & 1 != 0 { *member } else { values[first % W] };
    }
    (least(members), -least(negated(members)))
}

/// The least value; NaN doesn't count unless all are.
#[inline(always)]
pub fn least<const W: usize>(mut values: [f32; W]) -> f32 {
    // Halving rather than one after the other, which vectorises.
    let mut width = W;
    while width > 1 {
        width /= 2;
        for lane in 0..width {
            let (a, b) = (values[lane], values[lane + width]);
            values[lane] = if a < b { a } else { b };
        }
    }
    values[0]
}

#[inline(always)]
fn negated<const W: usize>(mut values: [f32; W]) -> [f32; W] {
    for value in &mut values {
        *value = -*value;
    }
    values
}

#[inline(always)]
pub fn lane_of<const W: usize>(values: &[[f32; W]; 3], lane: usize) -> [f32; 3] {
    [values[0][lane], values[1][lane], values[2][lane]]
}

/// The slow, exact form of the test for finite rays: sums of large finite numbers may overflow.
#[cold]
fn is_finite(o: [f32; 3], d: [f32; 3]) -> bool {
    o.iter().chain(&d).all(|c| c.is_finite())
}
