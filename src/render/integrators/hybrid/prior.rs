//! What the mesh says of the lights, patch by patch, and what follows from it without a ray.

use super::patch::Patch;
use super::weak::{WeakLight, WeakLights};
use crate::light_mesh::direct::{DirectView, Witnesses};
use crate::light_mesh::lookup::LookupScratch;
use crate::lights::VisibilityBits;
use crate::render::paths::PathVertex;
use crate::render::shadow_edges::TileVisibility;
use crate::simd::{LANES, Lanes};

/// What is assumed of a light in a patch until a ray says otherwise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Assumption {
    /// All mesh points around see it.
    Lit,
    /// None does.
    Dark,
    /// They disagree, and it matters.
    Open,
    /// They disagree, but the light is so weak here that the share of them that sees it will do.
    Weak,
}

/// The part of the tolerance that lights which are too weak to be traced may use up; the rest is for what checks don't find.
const WEAK_PART: f32 = 0.05;

/// Lights of all patches of a tile.
pub struct Prior<'a> {
    mesh: DirectView<'a>,
    /// What all decisions not to trace a ray may cost, as a share of a point's light.
    pub tolerance: f32,
    /// By patch and chunk.
    lit: Vec<VisibilityBits>,
    open: Vec<VisibilityBits>,
    weak: Vec<VisibilityBits>,
    weak_lights: WeakLights,
    /// By chunk: lights that are open in some patch.
    open_anywhere: Vec<VisibilityBits>,
    witnesses: Witnesses,
    doubts: Vec<Doubt>,
}

/// A light on which mesh points disagree.
struct Doubt {
    index: usize,
    light: usize,
    /// The share of the mesh points that see it.
    share: f32,
    /// What its visibility may change, over the light of the patch's points: the most of all points.
    stake: f32,
    factors: Lanes,
}

impl<'a> Prior<'a> {
    pub fn new(mesh: DirectView<'a>, tolerance: f32) -> Self {
        let chunks = mesh.estimator.lights.chunks().len();
        Self {
            mesh,
            tolerance,
            lit: Vec::new(),
            open: Vec::new(),
            weak: Vec::new(),
            weak_lights: WeakLights::default(),
            open_anywhere: vec![0; chunks],
            witnesses: Witnesses::default(),
            doubts: Vec::new(),
        }
    }

    /// Sorts the lights for the next patch, and adds to its light what needs no ray.
    ///
    /// Of the lights on which mesh points disagree the weakest are not traced, as long as what they may be wrong by sums up to no
    /// more than [`WEAK_PART`] of `tolerance`, as a share of the light of any point.
    #[inline(always)]
    pub fn add(&mut self, patch: &mut Patch, vertices: &[PathVertex], scratch: &mut LookupScratch) {
        let Self { mesh, tolerance, witnesses, doubts, .. } = self;
        let lights = mesh.estimator.lights;
        let surfaces = vertices[patch.vertices.clone()].iter().map(|vertex| &vertex.surface);
        witnesses.gather(mesh, surfaces, scratch);
        doubts.clear();
        let row = self.open.len();
        let mut total = [0.0f32; LANES];
        for (index, chunk) in lights.chunks().iter().enumerate() {
            let (all, any) = (witnesses.all[index] & chunk.used, witnesses.any[index] & chunk.used);
            self.lit.push(all);
            self.open.push(any & !all);
            self.weak.push(0);
            let mut seen = any;
            while seen != 0 {
                let light = seen.trailing_zeros() as usize % LANES;
                seen &= seen - 1;
                let factors = lights.factors(index, light, &patch.group.points);
                let intensity = lights.intensity(index, light);
                let mut amount: f32 = intensity.iter().sum();
                if all >> light & 1 == 1 {
                    patch.add_light(intensity, &factors);
                } else {
                    let share = witnesses.share(mesh, index, light);
                    doubts.push(Doubt {
                        index,
                        light,
                        share,
                        stake: amount * share.max(1.0 - share),
                        factors,
                    });
                    amount *= share;
                }
                for lane in 0..LANES {
                    total[lane] += amount * factors[lane];
                }
            }
        }
        let mut inverse = [0.0; LANES];
        for lane in 0..LANES {
            inverse[lane] = if total[lane] > 0.0 { 1.0 / total[lane] } else { 0.0 };
        }
        for doubt in &mut *doubts {
            let mut most = 0.0;
            for lane in 0..LANES {
                let part = doubt.factors[lane] * inverse[lane];
                most = if part > most { part } else { most };
            }
            doubt.stake *= most;
        }
        doubts.sort_unstable_by(|a, b| {
            a.stake.total_cmp(&b.stake).then((a.index, a.light).cmp(&(b.index, b.light)))
        });
        let mut staked = 0.0;
        for Doubt { index, light, share, stake, factors } in &*doubts {
            staked += stake;
            if staked > WEAK_PART * *tolerance {
                break;
            }
            let intensity = lights.intensity(*index, *light).map(|channel| channel * share);
            patch.add_light(intensity, factors);
            self.weak_lights.add(lights, WeakLight { index: *index, light: *light, share: *share }, factors);
            self.open[row + index] &= !(1 << light);
            self.weak[row + index] |= 1 << light;
        }
        self.weak_lights.end_patch();
        for (anywhere, open) in self.open_anywhere.iter_mut().zip(&self.open[row..]) {
            *anywhere |= open;
        }
    }

    /// What is assumed of the vertices of a tile: lights that are open are taken for dark, and weak ones settled.
    pub fn visibility(&self, patches: &[Patch], vertices: usize) -> TileVisibility {
        let lights = self.mesh.estimator.lights;
        let chunks = lights.chunks().len();
        let mut visibility = TileVisibility::new(vertices, lights);
        for (number, patch) in patches.iter().enumerate() {
            let row = number * chunks..(number + 1) * chunks;
            for vertex in patch.vertices.clone() {
                visibility.seen_mut(vertex).copy_from_slice(&self.lit[row.clone()]);
            }
            for (index, &weak) in self.weak[row].iter().enumerate().filter(|(_, weak)| **weak != 0) {
                visibility.settle(patch.vertices.clone(), index, weak);
            }
        }
        visibility
    }

    /// The lights that weren't traced because they are weak.
    pub fn weak_lights(&self) -> &WeakLights {
        &self.weak_lights
    }

    /// The share of open lights among those that any mesh point sees, over all patches.
    pub fn openness(&self) -> f32 {
        let count = |bits: &[VisibilityBits]| bits.iter().map(|bits| bits.count_ones()).sum::<u32>();
        let (open, lit) = (count(&self.open), count(&self.lit));
        open as f32 / (open + lit).max(1) as f32
    }

    /// Whether a light is open in some patch.
    #[inline(always)]
    pub fn is_open(&self, index: usize, light: usize) -> bool {
        self.open_anywhere[index] >> light & 1 == 1
    }

    /// What is assumed of a light in a patch.
    #[inline(always)]
    pub fn assumption(&self, patch: usize, index: usize, light: usize) -> Assumption {
        let at = patch * self.open_anywhere.len() + index;
        if self.lit[at] >> light & 1 == 1 {
            Assumption::Lit
        } else if self.open[at] >> light & 1 == 1 {
            Assumption::Open
        } else if self.weak[at] >> light & 1 == 1 {
            Assumption::Weak
        } else {
            Assumption::Dark
        }
    }
}
