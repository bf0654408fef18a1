//! Which rays towards a light are traced in a tile.

use super::patch::Patch;
use super::places::Places;
use super::prior::{Assumption, Prior};
use super::strengths::strengths;
use crate::accel::{Accel, Coherence, LaneMask, RayPacket};
use crate::lights::PackedLights;
use crate::render::paths::PathVertex;
use crate::render::shadow_edges::TileVisibility;
use crate::render::stats::{HybridError, ShadeCounters};
use crate::render::tiles::{TILE, Tile};
use crate::simd::LANES;

/// Rays per patch that check what is assumed, all lights together, for a tolerance of [`TOLERANCE`]; for half of it four
/// times as many, as the errors of samples go. They are shared among the lights in proportion to what each would give the tile if nothing
/// stood in its way; a patch gets at most one per light.
///
/// The more the mesh points disagree about some lights, the less their agreement about others is worth: the number is
/// divided by the share of lights that they agree on.
const CHECKS: f32 = 10.0;
/// See [`CHECKS`].
const TOLERANCE: f32 = 0.01;

/// Corners that agree stand for their patch above this tolerance.
const MOST_WITHOUT_CORNERS: f32 = 0.005;

/// Where this share of the squares around have corners that disagree, shadows are so fine that corners may agree by chance. A
/// straight edge beside a square crosses three of the eight around it.
const MIXED_OF: [u32; 2] = [4, 9];

/// What is known of the light in one patch.
#[derive(Clone, Copy)]
struct View {
    /// What the mesh says.
    prior: Assumption,
    /// Points that have the light above their horizon.
    facing: LaneMask,
    /// Points whose ray was traced.
    traced: LaneMask,
    /// Those of them that see the light.
    seeing: LaneMask,
    /// Points whose rays are to be traced next.
    wanted: LaneMask,
    /// What is assumed of the points that aren't traced; an open patch has `None` until its corners agree.
    assumed: Option<bool>,
    /// Whether `facing` is known.
    aimed: bool,
}

impl View {
    /// Before any ray is traced.
    fn new(prior: Assumption) -> Self {
        let assumed = match prior {
            Assumption::Lit => Some(true),
            Assumption::Dark | Assumption::Weak => Some(false),
            Assumption::Open => None,
        };
        Self { prior, facing: 0, traced: 0, seeing: 0, wanted: 0, assumed, aimed: false }
    }

    /// The points that see the light, as far as is known.
    fn lit(&self) -> LaneMask {
        let assumed = if self.assumed == Some(true) { !self.traced } else { 0 };
        self.facing & (self.seeing | assumed)
    }
}

/// Traces rays towards the lights of a tile.
pub struct LightTracer<'a, A> {
    accel: &'a A,
    lights: &'a PackedLights,
    tile: &'a Tile,
    patches: &'a mut [Patch],
    prior: &'a Prior<'a>,
    /// What is known of all lights, if that is asked for.
    visibility: Option<&'a mut TileVisibility>,
    views: Vec<View>,
    /// The patches along a Morton curve, so that those that follow each other are neighbours.
    order: Vec<u32>,
    /// The checks of the light that is traced: patch and point.
    checks: Vec<(u32, LaneMask)>,
    /// Estimated light that is wrong still, summed over the points and the colours.
    missed: f32,
    /// Rays under way: patch and lane of each.
    batch: Vec<(u32, u32)>,
    rays: u64,
}

impl<'a, A: Accel> LightTracer<'a, A> {
    pub fn new(
        accel: &'a A,
        lights: &'a PackedLights,
        tile: &'a Tile,
        patches: &'a mut [Patch],
        prior: &'a Prior<'a>,
        visibility: Option<&'a mut TileVisibility>,
    ) -> Self {
        let views = vec![View::new(Assumption::Dark); patches.len()];
        let mut order: Vec<u32> = (0..patches.len() as u32).collect();
        order.sort_by_key(|&number| morton(patches[number as usize].square));
        Self {
            accel,
            lights,
            tile,
            patches,
            prior,
            visibility,
            views,
            order,
            checks: Vec::new(),
            missed: 0.0,
            batch: Vec::new(),
            rays: 0,
        }
    }

    /// Traces what has to be for all lights, and adds what it changes to the patches' light.
    #[inline(always)]
    pub fn trace(mut self, vertices: &[PathVertex]) -> ShadeCounters {
        let strengths = strengths(self.lights, vertices);
        let total: f32 = strengths.as_flattened().iter().sum();
        let agreed = 1.0 - self.prior.openness();
        let stricter = TOLERANCE / self.prior.tolerance.max(f32::MIN_POSITIVE);
        let checks = CHECKS / agreed.max(f32::MIN_POSITIVE) * stricter * stricter;
        let per_strength = checks * self.patches.len() as f32 / total.max(f32::MIN_POSITIVE);
        for (index, chunk) in self.lights.chunks().iter().enumerate() {
            for light in 0..chunk.used.count_ones() as usize {
                let hash = self.hash(index * LANES + light);
                // Rounded up or down at random.
                let expected = strengths[index][light] * per_strength;
                let checks = (expected + (hash >> 8) as f32 / (1 << 24) as f32) as usize;
                if checks > 0 || self.prior.is_open(index, light) {
                    let checks = checks.min(self.patches.len());
                    self.trace_light(index, light, checks, hash as usize);
                    self.missed += self.missed_light(index, light, checks);
                }
            }
        }
        let received: f32 =
            self.patches.iter().map(|patch| patch.light.as_flattened().iter().sum::<f32>()).sum();
        let error = HybridError { missed: self.missed.into(), received: received.into() };
        ShadeCounters { shadow_rays: self.rays, hybrid_error: error, ..ShadeCounters::default() }
    }

    /// A number without pattern for a light of this tile.
    fn hash(&self, light: usize) -> u32 {
        let Tile { x, y, .. } = self.tile;
        let mixed = [x / TILE, y / TILE, light as u32]
            .iter()
            .fold(0x9E37_79B9u32, |hash, value| (hash ^ value).wrapping_mul(0x85EB_CA6B).rotate_left(13));
        (mixed ^ mixed >> 15).wrapping_mul(0xC2B2_AE35)
    }

    #[inline(always)]
    fn trace_light(&mut self, index: usize, light: usize, checks: usize, hash: usize) {
        self.checks.clear();
        for (number, view) in self.views.iter_mut().enumerate() {
            *view = View::new(self.prior.assumption(number, index, light));
            if view.prior == Assumption::Open {
                aim(view, &mut self.patches[number], self.lights, index, light);
                let asked = if self.prior.tolerance > MOST_WITHOUT_CORNERS {
                    self.patches[number].corners
                } else {
                    LaneMask::MAX
                };
                view.wanted = view.facing & asked;
                if view.wanted == 0 {
                    view.wanted = view.facing;
                }
            }
        }
        let count = self.patches.len();
        for check in 0..checks {
            let number = (hash + check * count / checks) % count;
            let view = &mut self.views[number];
            if view.prior == Assumption::Weak {
                continue;
            }
            aim(view, &mut self.patches[number], self.lights, index, light);
            let checked = any_of(view.facing & !view.wanted, hash / 7 + number * 7);
            view.wanted |= checked;
            if view.prior != Assumption::Open {
                self.checks.push((number as u32, checked));
            }
        }
        let mut crowded = None;
        let coherence = self.lights.chunks()[index].coherence(light);
        while self.trace_wanted(coherence) {
            let first = crowded.is_none();
            let crowded = *crowded.get_or_insert_with(|| self.crowded());
            self.judge(index, light, if first { crowded } else { 0 });
        }
        for (view, patch) in self.views.iter().zip(&mut *self.patches) {
            // What the prior has added already is taken back where it was wrong.
            let (changed, sign) = match view.prior {
                Assumption::Lit => (view.facing & !view.lit(), -1.0),
                Assumption::Weak => (0, 0.0),
                Assumption::Dark | Assumption::Open => (view.lit(), 1.0),
            };
            if changed != 0 {
                patch.add_to(changed, sign, self.lights, index, light);
                if let Some(visibility) = &mut self.visibility {
                    for lane in (0..patch.vertices.len()).filter(|lane| changed >> lane & 1 == 1) {
                        visibility.seen_mut(patch.vertices.start + lane)[index] ^= 1 << light;
                    }
                }
            }
        }
    }

    /// Traces the wanted rays; returns whether there were any.
    #[inline(always)]
    fn trace_wanted(&mut self, coherence: Coherence) -> bool {
        self.batch.clear();
        for &number in &self.order {
            let view = &mut self.views[number as usize];
            let mut lanes = view.wanted;
            while lanes != 0 {
                self.batch.push((number, lanes.trailing_zeros()));
                lanes &= lanes - 1;
            }
            view.traced |= view.wanted;
        }
        self.rays += self.batch.len() as u64;
        for batch in self.batch.chunks(LANES) {
            let mut packet = RayPacket::<LANES>::empty();
            for (to, &(number, lane)) in batch.iter().enumerate() {
                self.patches[number as usize].group.copy_ray(lane as usize, &mut packet, to);
            }
            let active = ((1u64 << batch.len()) - 1) as LaneMask;
            let blocked = self.accel.occluded_packet(active, &mut packet, coherence);
            for (from, &(number, lane)) in batch.iter().enumerate() {
                self.views[number as usize].seeing |= (!blocked >> from & 1) << lane;
            }
        }
        !self.batch.is_empty()
    }

    /// Estimates how much of the light that was traced last is wrong still, after so many checks: the sum over points and colours.
    ///
    /// What no sample has found is about as much as what exactly one has (Good, 1953). Points about which the mesh was mistaken,
    /// in squares next to each other, are a place; one that a single check found is mended, and stands for others that
    /// were missed, unless it was so large, and checks so many, that it couldn't have been.
    fn missed_light(&self, index: usize, light: usize, checks: usize) -> f32 {
        let mut places = Places::new();
        for &(number, point) in &self.checks {
            let view = &self.views[number as usize];
            if (view.seeing & point != 0) != (view.prior == Assumption::Lit) {
                places.add_check(self.patches[number as usize].square, number);
            }
        }
        if places.is_empty() {
            return 0.0;
        }
        for (view, patch) in self.views.iter().zip(&*self.patches) {
            let mistaken = match view.prior {
                Assumption::Lit => view.facing & !view.lit(),
                Assumption::Dark => view.lit(),
                Assumption::Open | Assumption::Weak => 0,
            };
            places.add_points(patch.square, mistaken.count_ones());
        }
        let per_patch = checks as f32 / self.patches.len() as f32;
        let mut missed = 0.0;
        places.for_each_found_once(|patch, size| {
            let chance = 1.0 - per_patch * (size as f32 / LANES as f32).min(1.0);
            missed += chance * self.mean_factor(patch as usize, index, light);
        });
        let points: usize = self.patches.iter().map(|patch| patch.vertices.len()).sum();
        let amount: f32 = self.lights.intensity(index, light).iter().sum();
        missed * amount * points as f32 / checks as f32
    }

    /// What a light's intensity is multiplied by at the points of a patch that have it above their horizon: the mean.
    fn mean_factor(&self, patch: usize, index: usize, light: usize) -> f32 {
        let factors = self.lights.factors(index, light, &self.patches[patch].group.points);
        let facing = self.views[patch].facing;
        let sum: f32 = (0..LANES).filter(|lane| facing >> lane & 1 == 1).map(|lane| factors[lane]).sum();
        sum / facing.count_ones().max(1) as f32
    }

    /// Squares among whose neighbours so many have corners that disagree that no single edge can have made them.
    #[inline(always)]
    fn crowded(&self) -> u64 {
        let (mut mixed, mut squares) = (0u64, 0u64);
        for (view, patch) in self.views.iter().zip(&*self.patches) {
            squares |= patch.square_bit();
            if view.assumed.is_none() && view.seeing != 0 && view.seeing != view.traced {
                mixed |= patch.square_bit();
            }
        }
        if mixed == 0 {
            return 0;
        }
        let is_crowded = |square: u32| {
            let around = Tile::around(1 << square) & !(1 << square);
            (around & mixed).count_ones() * MIXED_OF[1] >= (around & squares).count_ones() * MIXED_OF[0]
        };
        (0..64)
            .filter(|&square| squares >> square & 1 == 1 && is_crowded(square))
            .fold(0, |mask, square| mask | 1 << square)
    }

    /// Decides what the rays that were traced last ask for.
    ///
    /// - Corners of an open patch that agree stand for all of its points, unless the square is crowded: then all are traced.
    /// - Where a ray contradicts what was assumed, the patch's corners are asked; if they all contradict, the assumption is
    ///   turned round.
    /// - Where rays disagree, all of the patch is traced.
    /// - In both cases an edge may lie in the neighbours too, and their corners are traced. If the patch's own
    ///   corners agree, so that what was found lies between them, it is thin, and the neighbours are traced as a whole.
    #[inline(always)]
    fn judge(&mut self, index: usize, light: usize, crowded: u64) {
        let (mut near_edges, mut near_thin) = (0, 0);
        for (view, patch) in self.views.iter_mut().zip(&*self.patches) {
            if std::mem::take(&mut view.wanted) == 0 {
                continue;
            }
            let dark = view.traced & !view.seeing;
            let (any_lit, any_dark) = (view.seeing != 0, dark != 0);
            let corners = patch.corners & view.facing;
            if any_lit != any_dark && view.assumed.is_none_or(|assumed| assumed == any_lit) {
                view.assumed = Some(any_lit);
            } else if any_lit != any_dark && corners & !view.traced != 0 {
                view.wanted = corners & !view.traced;
            } else if any_lit != any_dark {
                view.assumed = Some(any_lit);
                near_edges |= patch.square_bit();
            } else if view.traced != view.facing {
                view.wanted = view.facing & !view.traced;
            } else if corners & dark != 0 && corners & view.seeing != 0 {
                near_edges |= patch.square_bit();
            } else {
                near_thin |= patch.square_bit();
            }
        }
        if near_edges | near_thin | crowded == 0 {
            return;
        }
        let (corners, all) = (Tile::around(near_edges), Tile::around(near_thin) | crowded);
        for (view, patch) in self.views.iter_mut().zip(&mut *self.patches) {
            let square = patch.square_bit();
            if (corners | all) & square == 0 || view.prior == Assumption::Weak {
                continue;
            }
            aim(view, patch, self.lights, index, light);
            let asked = if all & square != 0 { LaneMask::MAX } else { patch.corners };
            view.wanted |= asked & view.facing & !view.traced;
        }
    }
}

/// Aims the rays of a patch at a light, unless they are.
#[inline(always)]
fn aim(view: &mut View, patch: &mut Patch, lights: &PackedLights, index: usize, light: usize) {
    if !view.aimed {
        view.facing = patch.group.aim(&lights.chunks()[index], light);
        view.aimed = true;
    }
}

/// Place of a square of a tile along a Morton curve.
fn morton(square: u8) -> u8 {
    let spread = |bits: u8| bits & 1 | (bits & 2) << 1 | (bits & 4) << 2;
    spread(square) | spread(square >> 3) << 1
}

/// One of some points, if there are any; `which` is a number that picks different ones each time.
fn any_of(points: LaneMask, which: usize) -> LaneMask {
    let start = which as u32 % LANES as u32;
    let rotated = (points as u16).rotate_right(start);
    if rotated == 0 { 0 } else { 1 << ((rotated.trailing_zeros() + start) % LANES as u32) }
}
