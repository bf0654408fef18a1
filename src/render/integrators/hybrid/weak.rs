//! Lights that were too weak to be traced beside others, and a second look at them once the others are known.

use std::ops::Range;

use glam::Vec3;

use super::patch::Patch;
use crate::accel::{Accel, LaneMask};
use crate::lights::PackedLights;
use crate::render::shadow_edges::TileVisibility;
use crate::simd::{LANES, Lanes};

/// A light that isn't traced from a patch.
#[derive(Clone, Copy)]
pub(super) struct WeakLight {
    pub index: usize,
    pub light: usize,
    /// The share of the mesh points that see it, and of its light that the patch's points have been given.
    pub share: f32,
}

impl WeakLight {
    /// What its share may be wrong by, over what it gives without occluders.
    fn doubt(&self) -> f32 {
        self.share.max(1.0 - self.share)
    }
}

/// The weak lights of all patches of a tile.
#[derive(Default)]
pub(super) struct WeakLights {
    all: Vec<WeakLight>,
    /// Where those of each patch end.
    ends: Vec<usize>,
    /// What all of a patch may be wrong by, at each point: the sum over colours.
    staked: Vec<Lanes>,
    /// The same of the patch that isn't ended yet.
    stake: Lanes,
}

impl WeakLights {
    /// Adds a light of the next patch; the points receive `factors` of its intensity.
    #[inline(always)]
    pub fn add(&mut self, lights: &PackedLights, weak: WeakLight, factors: &Lanes) {
        self.all.push(weak);
        let most = weak.doubt() * lights.intensity(weak.index, weak.light).iter().sum::<f32>();
        for lane in 0..LANES {
            self.stake[lane] += most * factors[lane];
        }
    }

    /// Ends a patch.
    #[inline(always)]
    pub fn end_patch(&mut self) {
        self.ends.push(self.all.len());
        self.staked.push(std::mem::replace(&mut self.stake, [0.0; LANES]));
    }

    /// The weak lights of a patch.
    fn of(&self, patch: usize) -> &[WeakLight] {
        let Range { start, end } =
            patch.checked_sub(1).map_or(0, |before| self.ends[before])..self.ends[patch];
        &self.all[start..end]
    }

    /// Traces the weak lights of those points whose light turned out so dim that all of them together may be wrong by more than
    /// `tolerance` of it: the strong lights beside which they were weak are hidden there. Returns the number of rays.
    ///
    /// What the others may be wrong by is added to `error`, a number for each vertex, if anybody asks.
    #[inline(always)]
    pub fn look_again<A: Accel>(
        &self,
        accel: &A,
        lights: &PackedLights,
        patches: &mut [Patch],
        tolerance: f32,
        mut visibility: Option<&mut TileVisibility>,
        mut error: Option<&mut [Vec3]>,
    ) -> u64 {
        let mut rays = 0;
        for (number, patch) in patches.iter_mut().enumerate() {
            let weak = self.of(number);
            let doubtful =
                if weak.is_empty() { 0 } else { doubtful_points(patch, &self.staked[number], tolerance) };
            if doubtful == 0 && error.is_none() {
                continue;
            }
            for weak in weak {
                let WeakLight { index, light, share } = *weak;
                let factors = lights.factors(index, light, &patch.group.points);
                let intensity = lights.intensity(index, light);
                if let Some(error) =
                    error.as_deref_mut().and_then(|error| error.get_mut(patch.vertices.clone()))
                {
                    let most = Vec3::from(intensity) * weak.doubt();
                    for (lane, error) in
                        error.iter_mut().enumerate().filter(|(lane, _)| doubtful >> lane & 1 == 0)
                    {
                        *error += most * factors[lane];
                    }
                }
                if doubtful == 0 {
                    continue;
                }
                let asked = doubtful & patch.group.aim(&lights.chunks()[index], light);
                let seeing = if asked == 0 { 0 } else { patch.group.seeing(accel, asked) };
                rays += u64::from(asked.count_ones());
                let mut change = [0.0; LANES];
                for lane in 0..LANES {
                    let seen = (seeing >> lane & 1) as f32;
                    change[lane] =
                        if doubtful >> lane & 1 == 1 { (seen - share) * factors[lane] } else { 0.0 };
                }
                patch.add_light(intensity, &change);
                if let Some(visibility) = &mut visibility {
                    for lane in (0..patch.vertices.len()).filter(|lane| doubtful >> lane & 1 == 1) {
                        let vertex = patch.vertices.start + lane;
                        visibility.unsettle(vertex, index, light, seeing >> lane & 1 == 1);
                    }
                }
            }
        }
        rays
    }
}

/// The points of a patch of whose light more than `tolerance` is staked.
#[inline(always)]
fn doubtful_points(patch: &Patch, staked: &Lanes, tolerance: f32) -> LaneMask {
    let [r, g, b] = &patch.light;
    let mut doubtful = 0;
    for lane in 0..LANES {
        let light = r[lane] + g[lane] + b[lane];
        doubtful |= LaneMask::from(staked[lane] > tolerance * light) << lane;
    }
    doubtful & ((1u32 << patch.vertices.len()) - 1)
}
