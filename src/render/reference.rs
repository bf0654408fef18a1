//! The reference (spec §10): eq. (3) without a light mesh. The mean of the exact field over D_y, by dense sampling.

use glam::{Vec3, Vec4};

use super::paths::{PathVertex, TilePaths};
use super::stats::RenderStats;
use super::tiles::Tile;
use super::wavefront::{BlockIntegrator, ShadeCounters, direct_scale};
use crate::accel::{Accel, Coherence, PacketLanes, RayPacket};
use crate::light_mesh::{
    Ball, Basis, DirectValues, LANES, LightTable, MeshError, MeshPoints, directional, is_inside,
};
use crate::scene::random::SplitMix64;
use crate::scene::{Ray, Scene, SurfacePoint};
use crate::settings::{Estimator, Leaks, Neighbourhood, Settings};

/// Shades surface points with the means over D_y that a light mesh of infinite density would give.
///
/// The field is evaluated afresh at [`Settings::reference_samples`] positions around every surface point: a
/// low-discrepancy sequence, shifted by a hash of the surface point's position, so that pictures don't depend on
/// the order of evaluation and the remaining error is noise and not a pattern. Direct light only.
pub(super) struct ReferenceIntegrator<'a, A> {
    accel: &'a A,
    scene: &'a Scene,
    settings: &'a Settings,
    lights: LightTable,
    /// Asked for the shape of D_y only; none of its points is ever evaluated.
    neighbourhoods: MeshPoints,
    /// Points of the unit cube.
    sequence: Vec<Vec3>,
}

/// The samples of one surface point.
#[derive(Default)]
struct Samples {
    positions: Vec<Vec3>,
    weights: Vec<f32>,
}

impl<'a, A: Accel> ReferenceIntegrator<'a, A> {
    /// # Errors
    /// As for a light mesh of the same settings.
    pub fn new(accel: &'a A, scene: &'a Scene, settings: &'a Settings) -> Result<Self, MeshError> {
        Ok(Self {
            accel,
            scene,
            settings,
            lights: LightTable::of_scene(scene),
            neighbourhoods: MeshPoints::new(scene.bounds(), &settings.light_mesh.points)?,
            sequence: (0..settings.reference_samples).map(sequence_point).collect(),
        })
    }

    /// Fills `samples` with positions evenly spread over D_y and their weights; returns whether D_y is so small that y
    /// itself has to stand for it.
    fn place(&self, surface: &SurfacePoint, samples: &mut Samples) -> bool {
        samples.positions.clear();
        samples.weights.clear();
        // At infinite density the nearest mesh point is y itself.
        let nearest = self.settings.light_mesh.points.neighbourhood == Neighbourhood::Nearest;
        if !nearest {
            let ball = self.neighbourhoods.ball(surface);
            let shift = shift_of(surface.position);
            for point in &self.sequence {
                let position = in_neighbourhood(&ball, (*point + shift).fract());
                if let Some(weight) = ball.weight(position) {
                    samples.positions.push(position);
                    samples.weights.push(weight);
                }
            }
        }
        let empty = samples.positions.is_empty();
        if empty {
            samples.positions.push(surface.ray_origin());
            samples.weights.push(1.0);
        }
        empty && !nearest
    }

    /// Takes the weight from samples that the settings don't let count; returns the number of rays.
    ///
    /// As with mesh points, it matters only where the samples disagree, and if none is left all of them count.
    fn exclude_leaks(&self, surface: &SurfacePoint, samples: &mut Samples, field: &DirectValues) -> u64 {
        let keep: Vec<bool> = match self.settings.light_mesh.points.leaks {
            Leaks::Allow => return 0,
            Leaks::Invalidate => {
                samples.positions.iter().map(|&x| !is_inside(self.accel, self.scene, x)).collect()
            }
            Leaks::Visibility => {
                let chunks = self.lights.chunks().len();
                let first = field.bits(0, chunks);
                let slots = 1..samples.positions.len() as u32;
                if slots.into_iter().all(|slot| field.bits(slot, chunks) == first) {
                    return 0;
                }
                self.seen_from(surface, &samples.positions)
            }
        };
        if keep.contains(&true) {
            for (weight, keep) in samples.weights.iter_mut().zip(&keep) {
                *weight = if *keep { *weight } else { 0.0 };
            }
        }
        keep.len() as u64
    }

    /// Which positions a surface point sees.
    fn seen_from(&self, surface: &SurfacePoint, positions: &[Vec3]) -> Vec<bool> {
        let origin = surface.ray_origin();
        let mut seen = Vec::with_capacity(positions.len());
        for group in positions.chunks(LANES) {
            let mut packet = RayPacket::<LANES>::empty();
            for (lane, &position) in group.iter().enumerate() {
                packet.set_lane(lane, &Ray::between(origin, position));
            }
            let active = ((1u64 << group.len()) - 1) as u32;
            let blocked = self.accel.occluded_packet(active, &mut packet, Coherence::Incoherent);
            seen.extend((0..group.len()).map(|lane| blocked >> lane & 1 == 0));
        }
        seen
    }

    /// I(y) without k_d (spec §4), from the weighted mean of the field over the samples.
    fn estimate(&self, surface: &SurfacePoint, weights: &[f32], field: &DirectValues) -> Vec3 {
        let total: f32 = weights.iter().sum();
        let scale = if total > 0.0 { 1.0 / total } else { 0.0 };
        match self.settings.light_mesh.estimator {
            Estimator::PerLight => {
                let chunks = self.lights.chunks().len();
                self.lights.illuminate(surface, |chunk| {
                    let mut visible = [0.0; LANES];
                    for (slot, weight) in (0..).zip(weights) {
                        let bits = field.bits(slot, chunks)[chunk];
                        for (lane, sum) in visible.iter_mut().enumerate() {
                            *sum += if bits >> lane & 1 == 1 { *weight } else { 0.0 };
                        }
                    }
                    Some(visible.map(|sum| sum * scale))
                })
            }
            Estimator::Paper => {
                let [direct, _] = halves(mean(field, weights, scale));
                direct * self.lights.illuminate(surface, |_| Some([1.0; LANES]))
            }
            Estimator::Ratio => {
                let [direct, unoccluded] = halves(mean(field, weights, scale));
                let ratio = Vec3::select(unoccluded.cmpgt(Vec3::ZERO), direct / unoccluded, Vec3::ZERO);
                ratio * self.lights.illuminate(surface, |_| Some([1.0; LANES]))
            }
            Estimator::Directional => {
                let mean: [f32; directional::STRIDE] = mean(field, weights, scale);
                let mut coefficients = [Vec4::ZERO; directional::COEFFICIENTS];
                for (coefficient, values) in coefficients.iter_mut().zip(mean.as_chunks::<4>().0) {
                    *coefficient = Vec4::from_array(*values);
                }
                directional::irradiance(&coefficients, surface.shading_normal)
            }
        }
    }
}

impl<A: Accel> BlockIntegrator for ReferenceIntegrator<'_, A> {
    fn prepare(&mut self, _: &[TilePaths], _: &mut RenderStats) {}

    fn shade(&self, _: &Tile, vertices: &[PathVertex], light: &mut [Vec3]) -> ShadeCounters {
        let basis = Basis::of(self.settings.light_mesh.estimator);
        let scale = direct_scale(self.settings);
        let mut counters = ShadeCounters::default();
        let mut samples = Samples::default();
        if self.lights.is_empty() {
            return counters;
        }
        for (vertex, light) in vertices.iter().zip(light) {
            let surface = &vertex.surface;
            counters.direct_fallbacks += u64::from(self.place(surface, &mut samples));
            let mut field = DirectValues::default();
            counters.shadow_rays += field.evaluate(self.accel, &self.lights, basis, &samples.positions);
            counters.shadow_rays += self.exclude_leaks(surface, &mut samples, &field);
            *light = self.estimate(surface, &samples.weights, &field) * scale;
        }
        counters
    }
}

/// Weighted mean of `N` numbers per sample; `scale` is 1 over the sum of the weights.
fn mean<const N: usize>(field: &DirectValues, weights: &[f32], scale: f32) -> [f32; N] {
    let mut sums = [0.0; N];
    for (slot, weight) in (0..).zip(weights) {
        for (sum, value) in sums.iter_mut().zip(field.values::<N>(slot)) {
            *sum += weight * value;
        }
    }
    sums.map(|sum| sum * scale)
}

/// DirectLight and the unoccluded DirectLight.
fn halves([a, b, c, d, e, f]: [f32; 6]) -> [Vec3; 2] {
    [Vec3::new(a, b, c), Vec3::new(d, e, f)]
}

/// Point `index` of Roberts' R₃ sequence in the unit cube, whose points stay evenly spread however many are taken.
fn sequence_point(index: u32) -> Vec3 {
    // Powers of the root of g⁴ = g + 1.
    const ALPHA: [f64; 3] = [0.819_172_513_396_164_5, 0.671_043_606_703_789_3, 0.549_700_477_901_970_3];
    Vec3::from_array(ALPHA.map(|alpha| (0.5 + alpha * f64::from(index)).fract() as f32))
}

/// Maps the unit cube to D_y's ball, equal volumes to equal volumes, and folds the half that isn't admitted onto the
/// other.
fn in_neighbourhood(ball: &Ball, cube: Vec3) -> Vec3 {
    let z = 1.0 - 2.0 * cube.y;
    let ring = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = (std::f32::consts::TAU * cube.z).sin_cos();
    let offset = Vec3::new(ring * cos, ring * sin, z) * (cube.x.cbrt() * ball.radius);
    let position = ball.center + offset;
    if ball.admits(position) { position } else { ball.center - offset }
}

/// Shift of the sequence for the surface point at `y`, in the unit cube.
fn shift_of(y: Vec3) -> Vec3 {
    let [a, b, c] = y.to_array().map(|value| u64::from(value.to_bits()));
    SplitMix64::new(a ^ b.rotate_left(21) ^ c.rotate_left(42)).in_box(Vec3::ZERO, Vec3::ONE)
}
