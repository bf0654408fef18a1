//! What is true of a ray, in double precision, and what single precision may make of it.
//!
//! The bounds are derived in docs/crosscheck.md. In short: a ray tracer in single precision sees every corner
//! moved by a few roundings of its distance from the ray's origin. [`Judge::test`] decides whether a triangle is
//! hit, missed, or within that doubt.

use glam::Vec3;
use rayon::prelude::*;

use super::boxes::{BoxTree, Stack, Walker};
use super::crossing::Crossing;
use super::local_ray::LocalRay;
use super::placement::Placement;
use crate::Bounds;
use crate::accel::{MAX_COORDINATE, is_valid_ray, largest_coordinate};
use crate::scene::{Hit, Ray, Scene, TriangleMesh};

/// A triangle that a ray hits, or may be reported to hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// Index into [`Scene::instances`].
    pub instance: u32,
    /// Triangle within the mesh.
    pub triangle: u32,
    /// Distance, in units of the direction's length.
    pub t: f64,
    /// By how much a distance in single precision may differ from `t`.
    pub error: f64,
    /// Whether every ray tracer has to find the hit.
    pub certain: bool,
    /// Whether the ray runs in the triangle's plane within the bound (from far away, small triangles have any
    /// plane), so that distances are a quotient of two roundings.
    pub in_plane: bool,
}

impl Candidate {
    /// Whether a reported distance is that of this hit.
    pub fn admits(&self, t: f64) -> bool {
        self.in_plane || self.is_near(t)
    }

    /// Whether a distance lies where the triangle is.
    pub fn is_near(&self, t: f64) -> bool {
        (t - self.t).abs() <= self.error
    }
}

/// What the answers about a ray may be.
#[derive(Clone, Copy, Debug)]
pub struct Truth {
    /// No certain hit ends later than this; infinite if there is none.
    pub certain_before: f64,
    /// Whether any triangle is hit or in doubt.
    pub any_possible: bool,
}

/// A scene in double precision.
pub struct Judge<'a> {
    scene: &'a Scene,
    placements: Vec<Placement>,
    /// Trees of triangles, by mesh.
    trees: Vec<BoxTree>,
    top: BoxTree,
    /// Largest magnitude of the coordinates of rays that can hit anything.
    largest: f32,
}

impl<'a> Judge<'a> {
    /// Builds trees of its own over the scene.
    pub fn new(scene: &'a Scene) -> Self {
        let placements: Vec<_> =
            scene.instances.iter().map(|i| Placement::new(i.to_world.as_ref())).collect();
        let boxes_of = |mesh: &TriangleMesh| -> Vec<(Bounds, u32)> {
            let triangles = 0..mesh.triangles.len() as u32;
            let boxes = triangles.into_par_iter().filter_map(|triangle| {
                let corners = mesh.corners(triangle);
                is_usable(&corners).then(|| {
                    let mut bounds = Bounds::EMPTY;
                    corners.into_iter().for_each(|corner| bounds.extend(corner));
                    (bounds, triangle)
                })
            });
            boxes.collect()
        };
        let trees: Vec<_> = scene.meshes.par_iter().map(|mesh| BoxTree::new(&boxes_of(mesh))).collect();
        let placed = scene.instances.iter().zip(&placements).zip(0..);
        let boxes: Vec<_> = placed
            .filter_map(|((instance, placement), number)| {
                let mesh = scene.meshes.get(instance.mesh as usize)?;
                let bounds = placement.world_bounds(&mesh.bounds())?;
                (!bounds.is_empty()).then_some((bounds, number))
            })
            .collect();
        Self { scene, placements, trees, top: BoxTree::new(&boxes), largest: largest_coordinate(scene) }
    }

    /// Whether the ray can hit anything at all.
    fn is_ray(&self, ray: &Ray) -> bool {
        is_valid_ray(ray, self.largest)
    }

    /// Whether a ray hits a triangle; `None` where no ray tracer may report it.
    pub fn test(&self, ray: &Ray, instance: u32, triangle: u32) -> Option<Candidate> {
        if !self.is_ray(ray) {
            return None;
        }
        let local = self.placements.get(instance as usize)?.ray(ray)?;
        let mesh = self.scene.meshes.get(self.scene.instances.get(instance as usize)?.mesh as usize)?;
        if triangle as usize >= mesh.triangles.len() || !is_usable(&mesh.corners(triangle)) {
            return None;
        }
        self.test_local(ray, &local, mesh, instance, triangle)
    }

    /// [`Judge::test`] for a triangle that exists and is usable.
    fn test_local(
        &self,
        ray: &Ray,
        local: &LocalRay,
        mesh: &TriangleMesh,
        instance: u32,
        triangle: u32,
    ) -> Option<Candidate> {
        let corners = mesh.corners(triangle);
        let crossing = Crossing::new(local, corners.map(|corner| corner.as_dvec3() - local.origin))?;
        let (near, far) = (f64::from(ray.t_near.max(0.0)), f64::from(ray.t_far));
        let Crossing { t, error, .. } = crossing;
        // In its plane any distance may come out, though the triangle lies outside the interval.
        if !crossing.in_plane && (t + error < near || t - error > far) {
            return None;
        }
        let within = t - error > near && t + error < far;
        let mut certain = crossing.certain && within;
        if let Some(mask) = self.scene.alpha_mask(mesh, triangle) {
            let answers = crossing.surroundings().map(|(u, v)| mask.is_opaque(mesh.uv(triangle, u, v)));
            if answers == [false; 9] && crossing.certain {
                return None;
            }
            certain &= answers == [true; 9];
        }
        Some(Candidate { instance, triangle, t, error, certain, in_plane: crossing.in_plane })
    }

    /// Looks at all triangles near the ray.
    pub fn truth(&self, ray: &Ray) -> Truth {
        let mut truth = Truth { certain_before: f64::INFINITY, any_possible: false };
        self.each_candidate(ray, |candidate| {
            truth.any_possible = true;
            if candidate.certain {
                truth.certain_before = truth.certain_before.min(candidate.t + candidate.error);
            }
            truth.certain_before
        });
        truth
    }

    /// Calls `found` with all candidates that begin before the limit that it returns.
    pub fn each_candidate(&self, ray: &Ray, mut found: impl FnMut(&Candidate) -> f64) {
        if !self.is_ray(ray) {
            return;
        }
        let Some(world) = Placement::World.ray(ray) else { return };
        let mut limit = f64::from(ray.t_far);
        let (mut stack, mut inner) = (Stack::with_capacity(64), Stack::with_capacity(64));
        self.top.walk(&Walker::new(&world), &mut stack, widened(limit), |instance, _| {
            let placement = &self.placements[instance as usize];
            let Some(local) = placement.ray(ray) else { return widened(limit) };
            let mesh = self.scene.instances[instance as usize].mesh as usize;
            let (tree, mesh) = (&self.trees[mesh], &self.scene.meshes[mesh]);
            tree.walk(&Walker::new(&local), &mut inner, widened(limit), |triangle, _| {
                if let Some(candidate) = self.test_local(ray, &local, mesh, instance, triangle) {
                    limit = limit.min(found(&candidate));
                }
                widened(limit)
            });
            widened(limit)
        });
    }

    /// Whether a closest hit may be reported.
    pub fn admits_closest(&self, ray: &Ray, truth: &Truth, hit: Option<&Hit>) -> bool {
        let Some(hit) = hit else { return truth.certain_before == f64::INFINITY };
        let t = f64::from(hit.t);
        let inside = hit.t >= ray.t_near.max(0.0) && hit.t <= ray.t_far;
        inside
            && t <= truth.certain_before
            && self.test(ray, hit.instance, hit.triangle).is_some_and(|candidate| candidate.admits(t))
    }

    /// Whether an occlusion query may answer so.
    pub fn admits_occlusion(truth: &Truth, occluded: bool) -> bool {
        if occluded { truth.any_possible } else { truth.certain_before == f64::INFINITY }
    }
}

/// Boxes are looked at a little beyond the end of the interval.
fn widened(limit: f64) -> f64 {
    limit * (1.0 + 1e-5)
}

/// Whether a triangle is in the scene at all.
fn is_usable(corners: &[Vec3; 3]) -> bool {
    corners.iter().all(|corner| corner.abs().cmple(Vec3::splat(MAX_COORDINATE)).all())
}
