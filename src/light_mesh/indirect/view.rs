//! What surface points take from an indirect mesh: eq. (5).

use std::f32::consts::PI;

use glam::Vec3;

use super::interpolation::IndirectInterpolation;
use super::mesh::IndirectMesh;
use super::octahedral::OctahedralWeights;
use crate::accel::Accel;
use crate::light_mesh::leaks::amounts_differ;
use crate::light_mesh::lookup::{Differ, Lookup, LookupScratch};
use crate::scene::SurfacePoint;
use crate::settings::{IndirectForm, IndirectShading, Normalization};

/// An indirect mesh as surface points interpolate it.
#[derive(Clone, Copy)]
pub struct IndirectView<'a> {
    mesh: &'a IndirectMesh,
    /// Finds the points of D_y.
    pub lookup: Lookup<'a>,
    shading: &'a IndirectShading,
}

impl IndirectMesh {
    /// The mesh as surface points interpolate it.
    pub fn view<'a>(&'a self, interpolation: &'a IndirectInterpolation) -> IndirectView<'a> {
        let IndirectInterpolation { neighbourhoods, shading } = interpolation;
        let lookup = Lookup { store: &self.store, neighbourhoods, leaks: shading.kernel.leaks };
        IndirectView { mesh: self, lookup, shading }
    }
}

impl IndirectView<'_> {
    /// Ĩ_d of eq. (5) at a surface point, all of whose D_y must be known; with the mean normalization it is the
    /// radiance that an all-white surface would send back.
    #[inline(always)]
    pub fn illumination<A: Accel>(
        &self,
        accel: &A,
        surface: &SurfacePoint,
        scratch: &mut LookupScratch,
    ) -> Vec3 {
        self.find(accel, surface, scratch);
        let points = &scratch.points;
        self.sum(points.iter(), points.total_weight(), surface.shading_normal)
    }

    /// The points of a surface point, for several looks at values that change.
    pub fn stencil<A: Accel>(
        &self,
        accel: &A,
        surface: &SurfacePoint,
        scratch: &mut LookupScratch,
    ) -> Stencil {
        self.find(accel, surface, scratch);
        Stencil {
            points: scratch.points.iter().collect(),
            total: scratch.points.total_weight(),
            normal: surface.shading_normal,
        }
    }

    /// Ĩ_d where a stencil was found.
    pub fn illumination_at(&self, stencil: &Stencil) -> Vec3 {
        self.sum(stencil.points.iter().copied(), stencil.total, stencil.normal)
    }

    #[inline(always)]
    fn find<A: Accel>(&self, accel: &A, surface: &SurfacePoint, scratch: &mut LookupScratch) {
        let Self { lookup, shading, .. } = self;
        lookup.find(accel, surface, scratch, self);
        if shading.at_surface {
            let (y, normal) = (surface.position, surface.geometric_normal);
            let positions = lookup.store.positions();
            scratch.points.extrapolate_to_surface(|slot| normal.dot(positions[slot as usize] - y));
        }
    }

    /// Eq. (5) over mesh points, by slot, with their weights.
    #[inline(always)]
    fn sum(&self, points: impl Iterator<Item = (u32, f32)>, total: f32, normal: Vec3) -> Vec3 {
        let Self { mesh, shading, .. } = self;
        let mut sum = Vec3::ZERO;
        match mesh.settings.form {
            IndirectForm::Scalar => {
                for (slot, weight) in points {
                    sum += Vec3::from_array(mesh.value(slot)[0]) * weight;
                }
            }
            _ => {
                let by_normal = OctahedralWeights::of(normal);
                for (slot, weight) in points {
                    sum += by_normal.apply(mesh.value(slot)) * weight;
                }
            }
        }
        let scale = match shading.normalization {
            Normalization::Mean => 1.0 / total,
            Normalization::Integral => 4.0 * PI / total,
        };
        // The mean and far points may enter with weights below 0, so that a single lamp may leave a trace of darkness behind it.
        sum.max(Vec3::ZERO) * scale
    }
}

/// The mesh points that a surface point takes its light from.
pub struct Stencil {
    /// Slots and weights.
    points: Vec<(u32, f32)>,
    total: f32,
    normal: Vec3,
}

impl Differ for IndirectView<'_> {
    #[inline(always)]
    fn differ(&self, slots: &[u32]) -> bool {
        amounts_differ(slots.iter().map(|&slot| self.mesh.value(slot)[0].iter().sum()))
    }
}
