//! Direct illumination of surface points from the direct light mesh: the estimators of spec §4.

use glam::Vec3;

use super::direct::{Basis, DirectValues};
use super::directional;
use super::lights::{LANES, Lanes, LightTable, VisibilityBits};
use super::neighbours::Neighbours;
use super::points::{MeshError, MeshPoints};
use super::store::PointMask;
use crate::accel::Accel;
use crate::scene::{Scene, SurfacePoint};
use crate::settings::{Estimator, LightMeshSettings};

/// Direct light mesh: points, their values, and the estimator that reads them.
pub struct DirectMesh {
    /// The mesh points.
    pub points: MeshPoints,
    values: DirectValues,
    lights: LightTable,
    estimator: Estimator,
}

/// Working memory of one thread while it shades.
#[derive(Default)]
pub struct Scratch {
    pub(super) neighbours: Neighbours,
    slots: Vec<(u32, f32)>,
}

impl DirectMesh {
    /// Mesh over a scene, with no point known.
    pub fn new(scene: &Scene, settings: &LightMeshSettings) -> Result<Self, MeshError> {
        Ok(Self {
            points: MeshPoints::new(scene.bounds(), &settings.points)?,
            values: DirectValues::default(),
            lights: LightTable::new(&scene.lights, scene.falloff),
            estimator: settings.estimator,
        })
    }

    /// Evaluates those of the needed points that are unknown; returns the number of occlusion rays.
    pub fn evaluate<A: Accel>(&mut self, accel: &A, needed: &PointMask) -> u64 {
        let new = self.points.claim(needed);
        self.values.evaluate(accel, &self.lights, Basis::of(self.estimator), &new)
    }

    /// I(y), the direct illumination of a surface point without its k_d. All points of D_y must be known.
    #[inline(always)]
    pub fn illumination(&self, surface: &SurfacePoint, scratch: &mut Scratch) -> (Vec3, bool) {
        let fallback = self.points.neighbours(surface, &mut scratch.neighbours);
        scratch.slots.clear();
        let mut total = 0.0;
        for (id, weight) in scratch.neighbours.iter() {
            total += weight;
            scratch.slots.push((self.points.slot(id), weight));
        }
        let slots = &scratch.slots[..];
        let scale = 1.0 / total;
        let illumination = match self.estimator {
            Estimator::PerLight => self.per_light(surface, slots, scale),
            Estimator::Paper => {
                let [direct, _] = self.mean_direct_light(slots, scale);
                direct * self.lights.illuminate(surface, |_| Some([1.0; LANES]))
            }
            Estimator::Ratio => {
                let [direct, unoccluded] = self.mean_direct_light(slots, scale);
                let ratio = Vec3::select(unoccluded.cmpgt(Vec3::ZERO), direct / unoccluded, Vec3::ZERO);
                ratio * self.lights.illuminate(surface, |_| Some([1.0; LANES]))
            }
            Estimator::Directional => {
                let mut sums = [0.0f32; directional::STRIDE];
                for &(slot, weight) in slots {
                    for (sum, value) in
                        sums.iter_mut().zip(self.values.values::<{ directional::STRIDE }>(slot))
                    {
                        *sum += weight * value;
                    }
                }
                directional::irradiance(&sums, surface.shading_normal) * scale
            }
        };
        (illumination, fallback)
    }

    /// Σ_i Ṽ_i φ2 E_i/φ1 with Ṽ_i the mean visibility of light i over D_y.
    #[inline(always)]
    fn per_light(&self, surface: &SurfacePoint, slots: &[(u32, f32)], scale: f32) -> Vec3 {
        let chunks = self.lights.chunks().len();
        self.lights.illuminate(surface, |chunk| {
            let (mut all, mut any) = (VisibilityBits::MAX, 0);
            for &(slot, _) in slots {
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
            for &(slot, weight) in slots {
                let bits = self.values.bits(slot, chunks)[chunk];
                for (lane, sum) in visible.iter_mut().enumerate() {
                    *sum += if bits >> lane & 1 == 1 { weight } else { 0.0 };
                }
            }
            Some(visible.map(|sum| sum * scale))
        })
    }

    /// What D_y says of the lights: per chunk the lights that all of D_y sees (`seen`), and those on which its
    /// points disagree (`mixed`). Returns whether D_y was empty and the nearest point spoke for it.
    #[inline(always)]
    pub fn verdict(
        &self,
        surface: &SurfacePoint,
        scratch: &mut Scratch,
        seen: &mut [VisibilityBits],
        mixed: &mut [VisibilityBits],
    ) -> bool {
        let fallback = self.points.neighbours(surface, &mut scratch.neighbours);
        let chunks = self.lights.chunks().len();
        seen.fill(VisibilityBits::MAX);
        mixed.fill(0);
        for (id, _) in scratch.neighbours.iter() {
            let bits = self.values.bits(self.points.slot(id), chunks);
            for ((all, any), bits) in seen.iter_mut().zip(&mut *mixed).zip(bits) {
                *all &= bits;
                *any |= bits;
            }
        }
        mixed.iter_mut().zip(seen).for_each(|(any, all)| *any &= !*all);
        fallback
    }

    /// Ĩ of eq. (3), and the same mean of the unoccluded field.
    #[inline(always)]
    fn mean_direct_light(&self, slots: &[(u32, f32)], scale: f32) -> [Vec3; 2] {
        let mut sums = [0.0f32; 6];
        for &(slot, weight) in slots {
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
