//! Direct illumination of surface points from the direct light mesh: the estimators of spec §4.

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use super::direct::{Basis, DirectValues};
use super::directional;
use super::lanes::{LANES, Lanes, VisibilityBits, horizontal_extremes, horizontal_sums};
use super::leaks::{amounts_differ, is_inside, keep_visible, lights_differ};
use super::lights::LightTable;
use super::neighbours::Neighbours;
use super::points::{MeshError, MeshPoints};
use super::store::{PointMask, UNKNOWN};
use super::vicinity::{Group, Vicinity};
use crate::accel::Accel;
use crate::scene::{Scene, SurfacePoint};
use crate::settings::{Estimator, Leaks, LightMeshSettings};

/// Direct light mesh: points, their values, and the estimator that reads them.
pub struct DirectMesh {
    /// The mesh points.
    pub points: MeshPoints,
    values: DirectValues,
    lights: LightTable,
    estimator: Estimator,
    /// Points inside of geometry, by slot; only kept where they are to be invalidated.
    inside: Vec<bool>,
}

/// Working memory and counters of one thread while it shades.
#[derive(Default)]
pub struct Scratch {
    /// D_y.
    pub(super) points: Neighbours,
    /// What surface points that lie close together share; `None` where they come from anywhere.
    vicinity: Option<Vicinity>,
    /// Occlusion rays traced from surface points to mesh points.
    pub rays: u64,
    /// Surface points whose D_y was empty, so that the nearest mesh point took its place.
    pub fallbacks: u64,
}

impl Scratch {
    /// For surface points that lie close together. It must not outlive the next evaluation of mesh points.
    pub fn for_tile() -> Self {
        Self { vicinity: Some(Vicinity::default()), ..Self::default() }
    }

    /// Finds the points of D_y that count for a surface point; all must be known.
    ///
    /// `inside` tells by slot which points lie in geometry; `disagree` whether points differ so much that it matters
    /// which of them the surface point sees.
    #[inline(always)]
    pub(super) fn find<A: Accel>(
        &mut self,
        accel: &A,
        mesh: &MeshPoints,
        surface: &SurfacePoint,
        inside: &[bool],
        disagree: impl Fn(&[u32]) -> bool,
    ) {
        let fallback = match &mut self.vicinity {
            Some(vicinity) => mesh.neighbours_within(surface, vicinity, &mut self.points),
            None => mesh.known_neighbours(surface, &mut self.points),
        };
        self.fallbacks += u64::from(fallback);
        match mesh.leaks() {
            Leaks::Allow => {}
            Leaks::Invalidate => {
                if self.points.slots().iter().any(|&slot| inside[slot as usize])
                    && !self.points.keep(|_, slot| !inside[slot as usize])
                {
                    self.points.keep_first();
                    self.fallbacks += 1;
                }
            }
            Leaks::Visibility => {
                if disagree(self.points.slots()) {
                    self.rays += keep_visible(accel, mesh, surface, &mut self.points);
                }
            }
        }
    }
}

impl DirectMesh {
    /// Mesh over a scene, with no point known.
    pub fn new(scene: &Scene, settings: &LightMeshSettings) -> Result<Self, MeshError> {
        Ok(Self {
            inside: Vec::new(),
            points: MeshPoints::new(scene.bounds(), &settings.points)?,
            values: DirectValues::default(),
            lights: LightTable::of_scene(scene),
            estimator: settings.estimator,
        })
    }

    /// Evaluates those of the needed points that are unknown; returns the number of occlusion rays.
    pub fn evaluate<A: Accel>(&mut self, accel: &A, scene: &Scene, needed: &PointMask) -> u64 {
        let new = self.points.claim(needed);
        if self.points.leaks() == Leaks::Invalidate {
            self.inside.par_extend(new.par_iter().map(|&x| is_inside(accel, scene, x)));
        }
        self.values.evaluate(accel, &self.lights, Basis::of(self.estimator), &new)
    }

    /// Whether the points of D_y differ so much that a wall may stand between them.
    #[inline(always)]
    fn disagree(&self, slots: &[u32]) -> bool {
        match Basis::of(self.estimator) {
            Basis::Bits => {
                let chunks = self.lights.chunks().len();
                lights_differ(slots.iter().map(|&slot| self.values.bits(slot, chunks)))
            }
            // Not a look at each light, since the cost of these must not grow with the lights.
            Basis::Scalar | Basis::Directional => {
                amounts_differ(slots.iter().map(|&slot| self.values.amount(slot)))
            }
        }
    }

    /// I(y), the direct illumination of a surface point without its k_d. All points of D_y must be known.
    #[inline(always)]
    pub fn illumination<A: Accel>(&self, accel: &A, surface: &SurfacePoint, scratch: &mut Scratch) -> Vec3 {
        scratch.find(accel, &self.points, surface, &self.inside, |slots| self.disagree(slots));
        let points = &scratch.points;
        let scale = 1.0 / points.total_weight();
        match self.estimator {
            Estimator::PerLight => self.per_light(surface, points, scale),
            Estimator::Paper => {
                let [direct, _] = self.mean_direct_light(points, scale);
                direct * self.lights.illuminate(surface, |_| Some([1.0; LANES]))
            }
            Estimator::Ratio => {
                let [direct, unoccluded] = self.mean_direct_light(points, scale);
                let ratio = Vec3::select(unoccluded.cmpgt(Vec3::ZERO), direct / unoccluded, Vec3::ZERO);
                ratio * self.lights.illuminate(surface, |_| Some([1.0; LANES]))
            }
            Estimator::Directional => {
                let mut sums = [Vec4::ZERO; directional::COEFFICIENTS];
                for (slot, weight) in points.iter() {
                    let values = self.values.values::<{ directional::STRIDE }>(slot);
                    for (sum, value) in sums.iter_mut().zip(values.as_chunks::<4>().0) {
                        *sum += Vec4::from_array(*value) * weight;
                    }
                }
                directional::irradiance(&sums, surface.shading_normal) * scale
            }
        }
    }

    /// [`DirectMesh::illumination`] of a surface point that is one of several in a row of the same normal.
    ///
    /// They differ in the weights of the mesh points only, so that `directional` needs what each mesh point gives to
    /// that normal just once.
    #[inline(always)]
    pub fn illumination_in_row<A: Accel>(
        &self,
        accel: &A,
        surface: &SurfacePoint,
        scratch: &mut Scratch,
    ) -> Vec3 {
        if self.estimator == Estimator::Directional
            && let Some(light) = self.directional_in_row(surface, scratch)
        {
            return light;
        }
        self.illumination(accel, surface, scratch)
    }

    /// The estimate `directional`; `None` where D_y is empty, or has to be looked at more closely.
    #[inline(always)]
    fn directional_in_row(&self, surface: &SurfacePoint, scratch: &mut Scratch) -> Option<Vec3> {
        let (ball, around) = self.points.around(surface, scratch.vicinity.as_mut()?, |_| {})?;
        if *around.normal != surface.shading_normal {
            *around.normal = surface.shading_normal;
            around.groups.iter_mut().for_each(|group| self.light_up(group, surface.shading_normal));
        }
        let mut sums = [[0.0f32; LANES]; 4];
        let (mut least, mut most) = ([f32::INFINITY; LANES], [0.0f32; LANES]);
        for group in around.groups {
            let (weights, _) = group.weigh(&ball);
            let [r, g, b] = &group.lit;
            for lane in 0..LANES {
                // Points that don't count are marked by an amount below 0.
                let amount = group.amount[lane];
                let counts = amount >= 0.0 && weights[lane] > 0.0;
                let weight = if counts { weights[lane] } else { 0.0 };
                sums[0][lane] += weight * r[lane];
                sums[1][lane] += weight * g[lane];
                sums[2][lane] += weight * b[lane];
                sums[3][lane] += weight;
                let (low, high) = if counts { (amount, amount) } else { (f32::INFINITY, 0.0) };
                least[lane] = if low < least[lane] { low } else { least[lane] };
                most[lane] = if high > most[lane] { high } else { most[lane] };
            }
        }
        let [r, g, b, weights] = &sums;
        let sums = horizontal_sums([r, g, b, weights]);
        let differ = self.points.leaks() == Leaks::Visibility
            && amounts_differ(horizontal_extremes(&least, &most).into_iter());
        (sums.w > 0.0 && !differ).then(|| sums.truncate().max(Vec3::ZERO) / sums.w)
    }

    /// Notes what the points of a group give to a normal.
    #[inline(always)]
    fn light_up(&self, group: &mut Group, normal: Vec3) {
        let monomials = directional::monomials(normal);
        for lane in 0..LANES {
            let slot = group.slots[lane];
            group.amount[lane] = -1.0;
            if slot == UNKNOWN || self.inside.get(slot as usize).is_some_and(|&inside| inside) {
                continue;
            }
            let mut light = Vec4::ZERO;
            let values = self.values.values::<{ directional::STRIDE }>(slot);
            for (value, monomial) in values.as_chunks::<4>().0.iter().zip(monomials) {
                light += Vec4::from_array(*value) * monomial;
            }
            (0..3).for_each(|channel| group.lit[channel][lane] = light[channel]);
            group.amount[lane] = self.values.amount(slot);
        }
    }

    /// Σ_i Ṽ_i φ2 E_i/φ1 with Ṽ_i the mean visibility of light i over D_y.
    #[inline(always)]
    fn per_light(&self, surface: &SurfacePoint, points: &Neighbours, scale: f32) -> Vec3 {
        let chunks = self.lights.chunks().len();
        self.lights.illuminate(surface, |chunk| {
            let (mut all, mut any) = (VisibilityBits::MAX, 0);
            for &slot in points.slots() {
                let bits = self.values.bits(slot, chunks)[chunk];
                all &= bits;
                any |= bits;
            }
            // Most chunks are wholly hidden or wholly seen from all of D_y.
            if any == 0 {
                return None;
            }
            if all == self.lights.chunks()[chunk].used {
                return Some([1.0; LANES]);
            }
            let mut visible: Lanes = [0.0; LANES];
            for (slot, weight) in points.iter() {
                let bits = self.values.bits(slot, chunks)[chunk];
                for (lane, sum) in visible.iter_mut().enumerate() {
                    *sum += if bits >> lane & 1 == 1 { weight } else { 0.0 };
                }
            }
            Some(visible.map(|sum| sum * scale))
        })
    }

    /// What D_y says of the lights: per chunk the lights that all of D_y sees (`seen`), and those on which its
    /// points disagree (`mixed`).
    #[inline(always)]
    pub fn verdict<A: Accel>(
        &self,
        accel: &A,
        surface: &SurfacePoint,
        scratch: &mut Scratch,
        seen: &mut [VisibilityBits],
        mixed: &mut [VisibilityBits],
    ) {
        // Disagreement is settled by rays to the lights themselves: fewer opinions would only hide it.
        scratch.find(accel, &self.points, surface, &self.inside, |_| false);
        let chunks = self.lights.chunks().len();
        seen.fill(VisibilityBits::MAX);
        mixed.fill(0);
        for &slot in scratch.points.slots() {
            let bits = self.values.bits(slot, chunks);
            for ((all, any), bits) in seen.iter_mut().zip(&mut *mixed).zip(bits) {
                *all &= bits;
                *any |= bits;
            }
        }
        mixed.iter_mut().zip(seen).for_each(|(any, all)| *any &= !*all);
    }

    /// Ĩ of eq. (3), and the same mean of the unoccluded field.
    #[inline(always)]
    fn mean_direct_light(&self, points: &Neighbours, scale: f32) -> [Vec3; 2] {
        let mut sums = [0.0f32; 6];
        for (slot, weight) in points.iter() {
            for (sum, value) in sums.iter_mut().zip(self.values.values::<6>(slot)) {
                *sum += weight * value;
            }
        }
        let [a, b, c, d, e, f] = sums.map(|sum| sum * scale);
        [Vec3::new(a, b, c), Vec3::new(d, e, f)]
    }

    /// The lights.
    pub fn lights(&self) -> &LightTable {
        &self.lights
    }

    /// Bytes held by slots and values.
    pub fn memory_bytes(&self) -> usize {
        self.points.memory_bytes() + self.values.memory_bytes()
    }
}
