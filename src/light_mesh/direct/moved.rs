//! What becomes of known bits when something moves: those that the motion cannot have changed stay, the others are traced again where they
//! are needed (method §9).

use glam::Vec3;
use pulp::NullaryFnOnce;
use rayon::prelude::*;

use super::field::DirectField;
use super::refine::seen_from;
use crate::Bounds;
use crate::accel::Accel;
use crate::lights::{LightChunk, PackedLights, VisibilityBits};
use crate::simd::{LANES, Lanes, vectorize};

/// Boxes that are looked at one by one; more are merged, which forgets more than need be.
const MOST_BOXES: usize = 32;

/// Points of a task.
const GROUP: usize = 64;

/// What moved in a scene.
pub(crate) struct Motion {
    /// Boxes around all geometry that moved, where it was and where it is.
    boxes: Vec<Bounds>,
    /// By chunk of lights, those that are elsewhere now, so that nothing is known of them.
    moved: Vec<VisibilityBits>,
}

/// What is still known of the visibility of lights after something moved.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct KeptBits {
    /// Mesh points of which all stays known.
    pub points_kept: u64,
    /// Mesh points of which something has to be traced again, once they are needed.
    pub points_changed: u64,
    /// Bits that stay known: pairs of a mesh point and a light.
    pub bits_kept: u64,
    /// Bits that don't.
    pub bits_forgotten: u64,
}

impl Motion {
    /// Geometry that moved in some boxes, where it was and where it is, under lights that were others before; `None` if the lights were so different
    /// that bits of one are none of the other.
    pub fn new(boxes: Vec<Bounds>, before: &PackedLights, after: &PackedLights) -> Option<Self> {
        let (before, after) = (before.chunks(), after.chunks());
        let moved = |(before, after): (&LightChunk, &LightChunk)| after.placed_unlike(before) & after.used;
        (before.len() == after.len())
            .then(|| Self { boxes: merged(boxes), moved: before.iter().zip(after).map(moved).collect() })
    }
}

/// At most [`MOST_BOXES`] boxes that hold all of some boxes.
fn merged(mut boxes: Vec<Bounds>) -> Vec<Bounds> {
    if boxes.len() <= MOST_BOXES {
        return boxes;
    }
    let all = boxes.iter().copied().fold(Bounds::EMPTY, Bounds::union);
    let axis = all.extent().max_position();
    boxes.sort_by(|a, b| a.center()[axis].total_cmp(&b.center()[axis]));
    let each = boxes.len().div_ceil(MOST_BOXES);
    boxes.chunks(each).map(|boxes| boxes.iter().copied().fold(Bounds::EMPTY, Bounds::union)).collect()
}

impl DirectField {
    /// Marks the bits that a motion may have changed; `points` are the positions of all slots.
    pub(super) fn mark_moved(&mut self, lights: &PackedLights, points: &[Vec3], motion: &Motion) -> KeptBits {
        let chunks = lights.chunks().len();
        if chunks == 0 {
            return KeptBits { points_kept: points.len() as u64, ..KeptBits::default() };
        }
        self.stale.resize(self.bits().len(), 0);
        let marked = self.stale.par_chunks_mut(GROUP * chunks).zip(points.par_chunks(GROUP));
        let kept = marked.map(|(stale, points)| vectorize(Mark { lights, points, motion, stale }));
        kept.reduce(KeptBits::default, |a, b| KeptBits {
            points_kept: a.points_kept + b.points_kept,
            points_changed: a.points_changed + b.points_changed,
            bits_kept: a.bits_kept + b.bits_kept,
            bits_forgotten: a.bits_forgotten + b.bits_forgotten,
        })
    }

    /// The slots among some in which a bit has to be traced again.
    pub(super) fn stale_among(&self, slots: impl Iterator<Item = u32>, chunks: usize) -> Vec<u32> {
        let is_stale = |&slot: &u32| {
            let stale = self.stale.get(slot as usize * chunks..).and_then(|stale| stale.get(..chunks));
            stale.is_some_and(|stale| stale.iter().any(|&stale| stale != 0))
        };
        slots.filter(is_stale).collect()
    }

    /// Traces the marked bits in some different slots again; returns the number of occlusion rays.
    pub(super) fn retrace<A: Accel>(
        &mut self,
        accel: &A,
        lights: &PackedLights,
        points: &[Vec3],
        slots: &[u32],
    ) -> u64 {
        let chunks = lights.chunks().len();
        let Self { bits, stale, .. } = self;
        let known = bits.as_slice();
        let traced: Vec<(Vec<VisibilityBits>, u64)> = slots
            .par_chunks(GROUP)
            .with_max_len(1)
            .map(|slots| retrace_group(accel, lights, points, slots, known, stale))
            .collect();
        let bits = bits.to_mut();
        let mut rays = 0;
        for (slots, (new, count)) in slots.chunks(GROUP).zip(&traced) {
            rays += count;
            for (&slot, new) in slots.iter().zip(new.chunks_exact(chunks)) {
                let range = slot as usize * chunks..(slot as usize + 1) * chunks;
                bits[range.clone()].copy_from_slice(new);
                stale[range].fill(0);
            }
        }
        rays
    }
}

/// The bits in some slots with those that are marked traced again, and the number of rays.
fn retrace_group<A: Accel>(
    accel: &A,
    lights: &PackedLights,
    points: &[Vec3],
    slots: &[u32],
    bits: &[VisibilityBits],
    stale: &[VisibilityBits],
) -> (Vec<VisibilityBits>, u64) {
    let chunks = lights.chunks().len();
    let points: Vec<Vec3> = slots.iter().map(|&slot| points[slot as usize]).collect();
    let mut new: Vec<VisibilityBits> =
        slots.iter().flat_map(|&slot| &bits[slot as usize * chunks..][..chunks]).copied().collect();
    let mut rays = 0;
    for (index, chunk) in lights.chunks().iter().enumerate() {
        let open = |point: usize| stale[slots[point] as usize * chunks + index];
        let mut anywhere = (0..points.len()).fold(0, |any, point| any | open(point));
        while anywhere != 0 {
            let light = anywhere.trailing_zeros() as usize;
            anywhere &= anywhere - 1;
            let asking: Vec<usize> =
                (0..points.len()).filter(|&point| open(point) >> light & 1 == 1).collect();
            for owners in asking.chunks(LANES) {
                let seen = seen_from(accel, chunk, light, &points, owners);
                rays += owners.len() as u64;
                for (lane, &owner) in owners.iter().enumerate() {
                    let bits = &mut new[owner * chunks + index];
                    *bits = *bits & !(1 << light) | VisibilityBits::from(seen >> lane & 1 == 1) << light;
                }
            }
        }
    }
    (new, rays)
}

/// Some points of [`DirectField::mark_moved`], as work for the best instruction set.
struct Mark<'a> {
    lights: &'a PackedLights,
    points: &'a [Vec3],
    motion: &'a Motion,
    stale: &'a mut [VisibilityBits],
}

impl NullaryFnOnce for Mark<'_> {
    type Output = KeptBits;

    #[inline(always)]
    fn call(self) -> KeptBits {
        let Self { lights, points, motion, stale } = self;
        let chunks = lights.chunks();
        let mut kept = KeptBits::default();
        for (&x, stale) in points.iter().zip(stale.chunks_exact_mut(chunks.len())) {
            let (mut forgotten, mut all) = (0, 0);
            for ((chunk, stale), moved) in chunks.iter().zip(stale).zip(&motion.moved) {
                *stale |= moved;
                if *stale != chunk.used {
                    *stale |= crossing(chunk, x, &motion.boxes);
                }
                forgotten += u64::from(stale.count_ones());
                all += u64::from(chunk.used.count_ones());
            }
            kept.bits_forgotten += forgotten;
            kept.bits_kept += all - forgotten;
            kept.points_changed += u64::from(forgotten > 0);
            kept.points_kept += u64::from(forgotten == 0);
        }
        kept
    }
}

/// The lights of a chunk to which the way from `x` meets one of some boxes.
#[inline(always)]
fn crossing(chunk: &LightChunk, x: Vec3, boxes: &[Bounds]) -> VisibilityBits {
    let mut ways = [[0.0f32; LANES]; 3];
    for lane in 0..chunk.used.count_ones() as usize {
        // The very ray that is traced.
        let way = chunk.way(lane, x.to_array(), x, 0);
        (0..3).for_each(|axis| ways[axis][lane] = way[axis]);
    }
    let (mut low, mut high) = (Vec3::ZERO, Vec3::ZERO);
    for (axis, way) in ways.iter().enumerate() {
        for &along in way {
            low[axis] = if along < low[axis] { along } else { low[axis] };
            high[axis] = if along > high[axis] { along } else { high[axis] };
        }
    }
    let mut met = 0;
    for one in boxes {
        let apart = one.min.cmpgt(x + high) | one.max.cmplt(x + low);
        if !apart.any() {
            met |= meets(&ways, x, one);
        }
    }
    met & chunk.used
}

/// Which of sixteen ways from `x` meet a box, by their separating axes; never fewer, what can't be computed counts as met.
#[inline(always)]
fn meets(ways: &[Lanes; 3], x: Vec3, one: &Bounds) -> VisibilityBits {
    let (center, half) = (one.center(), one.extent() * 0.5);
    let mut met = 0;
    let mut apart = [false; LANES];
    for lane in 0..LANES {
        let d = [0, 1, 2].map(|axis| ways[axis][lane] * 0.5);
        let m = [0, 1, 2].map(|axis| x[axis] - center[axis] + d[axis]);
        let mut separate = false;
        for axis in 0..3 {
            separate |= m[axis].abs() > half[axis] + d[axis].abs();
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let (left, right) = (m[u] * d[v], m[v] * d[u]);
            let reach = half[u] * d[v].abs() + half[v] * d[u].abs();
            separate |= (left - right).abs() > reach + ROUNDING * (left.abs() + right.abs());
        }
        apart[lane] = separate;
    }
    for (lane, apart) in apart.iter().enumerate() {
        met |= VisibilityBits::from(!apart) << lane;
    }
    met
}

/// What the difference of two products may be wrong by, over the products: a few last places.
const ROUNDING: f32 = 1e-5;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::SplitMix64;
    use crate::scene::{Falloff, Light};

    /// A box that holds a point of the way is never missed, and of those that are far away most are: sixteen points of each way, in and outside of
    /// random boxes.
    #[test]
    fn no_way_through_a_box_is_missed() {
        let mut random = SplitMix64::new(5);
        let mut place = || random.in_box(Vec3::splat(-5.0), Vec3::splat(5.0));
        let (mut through, mut missed) = (0, 0);
        for _ in 0..300 {
            let lights: Vec<Light> = (0..LANES).map(|_| Light::point(place(), Vec3::ONE)).collect();
            let packed = PackedLights::new(&lights, Falloff::None, 0.0);
            let (x, corner) = (place(), place());
            let one = Bounds { min: corner, max: corner + Vec3::new(2.0, 3.0, 4.0) };
            let met = crossing(&packed.chunks()[0], x, &[one]);
            for lane in 0..LANES {
                let way = Vec3::from_array(packed.chunks()[0].to_light(lane, x.to_array()));
                let inside = (0..=400).any(|step| one.contains(x + way * (step as f32 / 400.0)));
                through += u32::from(inside);
                missed += u32::from(met >> lane & 1 == 0);
                assert!(!inside || met >> lane & 1 == 1, "{x} {way} {one:?}");
            }
        }
        assert!(through > 200 && missed > 3000, "{through}, {missed}");
    }

    /// However many boxes there are, those that are looked at hold them all.
    #[test]
    fn merged_boxes_hold_all() {
        let mut random = SplitMix64::new(6);
        let boxes: Vec<Bounds> = (0..1000)
            .map(|_| random.in_box(Vec3::ZERO, Vec3::ONE))
            .map(|min| Bounds { min, max: min + 0.01 })
            .collect();
        let few = merged(boxes.clone());
        assert!(few.len() <= MOST_BOXES);
        for one in boxes {
            assert!(few.iter().any(|few| few.contains(one.min) && few.contains(one.max)));
        }
    }
}
