//! The reference (method §10): eq. (3) without a light mesh. The mean of the exact field over D_y, by dense sampling.

use glam::Vec3;

use crate::accel::Accel;
use crate::light_mesh::direct::{Basis, DirectField, FieldEstimator};
use crate::light_mesh::leaks::{LeakGuard, PROBES, is_inside};
use crate::light_mesh::lookup::Differ;
use crate::light_mesh::points::{AutoSpacing, Kernel, MeshError, Neighbourhoods, Neighbours, PointSet};
use crate::lights::PackedGroups;
use crate::render::frame::BlockIntegrator;
use crate::render::layers::LightParts;
use crate::render::paths::TilePaths;
use crate::render::stats::{RenderStats, ShadeCounters};
use crate::render::tiles::Tile;
use crate::sampling::{SplitMix64, unit_cube_point};
use crate::scene::SurfacePoint;
use crate::settings::{Leaks, Neighbourhood, Settings, ShadingSettings};
use crate::world::World;

/// Shades surface points with the means over D_y that a light mesh of infinite density would give.
///
/// The field is evaluated afresh at [`ShadingSettings::reference_samples`] positions around every surface point: a
/// low-discrepancy sequence, shifted by a hash of the surface point's position, so that images don't depend on
/// the order of evaluation and the remaining error is noise and not a pattern. Estimators and leak rules are the light mesh's.
/// Direct light only; light from points on surfaces is added to it as to any other.
pub struct ReferenceIntegrator<'a, A> {
    world: World<'a, A>,
    shading: &'a ShadingSettings,
    /// Queried for the kernel only; no mesh point is ever evaluated.
    neighbourhoods: Neighbourhoods,
    /// Points of the unit cube.
    sequence: Vec<Vec3>,
}

/// Positions around one surface point at which the field is evaluated: by slot, with their weights.
#[derive(Default)]
struct Samples {
    positions: Vec<Vec3>,
    points: Neighbours,
}

impl Samples {
    fn clear(&mut self) {
        self.positions.clear();
        self.points.clear();
    }

    fn push(&mut self, position: Vec3, weight: f32) {
        self.points.push(self.positions.len() as u64, weight);
        self.positions.push(position);
    }
}

impl<'a, A: Accel> ReferenceIntegrator<'a, A> {
    /// # Errors
    /// As for a light mesh of the same settings.
    pub fn new(world: World<'a, A>, settings: &'a Settings) -> Result<Self, MeshError> {
        let shading = &settings.shading;
        let mut points = PointSet::new(world.scene.bounds());
        let neighbourhoods =
            Neighbourhoods::new(&mut points, &settings.mesh.direct, &shading.kernel, AutoSpacing::AVERAGED)?;
        let sequence = (0..shading.reference_samples).map(unit_cube_point).collect();
        Ok(Self { world, shading, neighbourhoods, sequence })
    }

    /// Fills `samples` with positions evenly spread over D_y and their weights; returns whether D_y is so small that y
    /// itself has to stand for it.
    fn place(&self, surface: &SurfacePoint, samples: &mut Samples) -> bool {
        samples.clear();
        // At infinite density the nearest mesh point is y itself.
        let nearest = self.shading.kernel.neighbourhood == Neighbourhood::Nearest;
        if !nearest {
            let kernel = self.neighbourhoods.kernel(surface);
            let shift = shift_of(surface.position);
            for point in &self.sequence {
                let position = in_kernel(&kernel, (*point + shift).fract());
                if let Some(weight) = kernel.weight(position) {
                    samples.push(position, weight);
                }
            }
        }
        let empty = samples.positions.is_empty();
        if empty {
            samples.push(surface.ray_origin(), 1.0);
        }
        samples.points.find_slots(|id| id as u32);
        empty && !nearest
    }

    /// I(y) of a surface point.
    fn illumination(
        &self,
        surface: &SurfacePoint,
        samples: &mut Samples,
        counters: &mut ShadeCounters,
        groups: Option<(&PackedGroups, &mut [Vec3])>,
    ) -> Vec3 {
        let World { accel, scene, lights, .. } = self.world;
        counters.direct_fallbacks += u64::from(self.place(surface, samples));
        let Samples { positions, points } = samples;
        let mut field = DirectField::default();
        counters.shadow_rays += field.trace(accel, lights, positions);
        field.derive(lights, Basis::of(self.shading.estimator), positions);
        let estimator = FieldEstimator::new(&field, lights, self.shading.estimator);

        let leaks = self.shading.kernel.leaks;
        let inside: Vec<bool> = if leaks == Leaks::Invalidate {
            counters.inside_rays += positions.len() as u64 * PROBES as u64;
            positions.iter().map(|&x| is_inside(accel, scene, x)).collect()
        } else {
            Vec::new()
        };
        let guard = LeakGuard { accel, leaks, positions };
        let leaked = guard.keep_counting(
            surface,
            points,
            |slot| inside.get(slot as usize).is_some_and(|&inside| inside),
            |slots| estimator.differ(slots),
        );
        counters.shadow_rays += leaked.rays;
        counters.direct_fallbacks += u64::from(leaked.all_dropped);
        if let Some((groups, sums)) = groups {
            estimator.add_by_group(surface, points, groups, sums);
        }
        estimator.estimate(surface, points)
    }
}

impl<A: Accel> BlockIntegrator for ReferenceIntegrator<'_, A> {
    fn evaluate(&mut self, _: &[TilePaths], _: &mut RenderStats) {}

    fn shade(
        &self,
        _: &Tile,
        paths: &TilePaths,
        light: &mut [Vec3],
        parts: Option<&mut LightParts>,
    ) -> ShadeCounters {
        let scale = self.shading.direct_scale();
        let mut counters = ShadeCounters::default();
        let mut samples = Samples::default();
        if self.world.lights.is_empty() {
            return counters;
        }
        let mut groups = parts.and_then(|parts| parts.groups.as_mut());
        for (number, (vertex, light)) in paths.vertices.iter().zip(light).enumerate() {
            let groups = groups.as_mut().map(|groups| groups.of_vertex(number));
            *light = self.illumination(&vertex.surface, &mut samples, &mut counters, groups) * scale;
        }
        counters
    }
}

/// Maps the unit cube to the kernel's ball, equal volumes to equal volumes, and folds the half that isn't admitted onto the
/// other.
fn in_kernel(kernel: &Kernel, unit: Vec3) -> Vec3 {
    let z = 1.0 - 2.0 * unit.y;
    let ring = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = (std::f32::consts::TAU * unit.z).sin_cos();
    let offset = Vec3::new(ring * cos, ring * sin, z) * (unit.x.cbrt() * kernel.radius);
    let position = kernel.center + offset;
    if kernel.admits(position) { position } else { kernel.center - offset }
}

/// Shift of the sequence for the surface point at `y`, in the unit cube.
fn shift_of(y: Vec3) -> Vec3 {
    let [a, b, c] = y.to_array().map(|value| u64::from(value.to_bits()));
    SplitMix64::new(a ^ b.rotate_left(21) ^ c.rotate_left(42)).in_box(Vec3::ZERO, Vec3::ONE)
}
