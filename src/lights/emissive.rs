//! Emissive triangles: points on them, chosen by their power, to which mesh points look for light.
//!
//! A lamp that covers a hundredth of the sphere is hit by a hundredth of the directions of eq. (4): its light would come
//! out as noise. So mesh points also send occlusion rays to points on the lamps. Each kind of ray counts with the share
//! that it has in the pdf of both, the balance heuristic (Veach, 1997), so that the sum is eq. (4) still.

use crate::scene::{Hit, Interaction, Scene, SurfacePoint};
use glam::{Vec2, Vec3};

/// The shining triangles of a scene.
#[derive(Clone, Debug, Default)]
pub struct EmissiveTriangles {
    /// Instance and triangle.
    triangles: Vec<(u32, u32)>,
    /// Sums of area times strength, up to and with each triangle.
    cumulative: Vec<f64>,
}

/// A point on an emitter as seen from a mesh point.
pub struct EmissiveSample {
    /// The point.
    pub surface: SurfacePoint,
    /// Emiss towards the mesh point.
    pub emission: Vec3,
    /// Unit direction towards it.
    pub direction: Vec3,
    /// Pdf of the choice per solid angle at the mesh point.
    pub pdf: f32,
}

/// Emiss of a hit triangle, before textures: what the choice of points goes by.
fn strength(scene: &Scene, instance: u32, triangle: u32) -> f32 {
    let mesh = &scene.meshes[scene.instances[instance as usize].mesh as usize];
    let material = &scene.materials[mesh.materials.of(triangle) as usize];
    // A negative or infinite strength would spoil the choice of all others.
    let strength = if material.lamp { 0.0 } else { material.emission.max_element() };
    if strength.is_finite() { strength.max(0.0) } else { 0.0 }
}

impl EmissiveTriangles {
    /// The emissive of a scene.
    pub fn of_scene(scene: &Scene) -> Self {
        let mut emissive = Self::default();
        if scene.materials.iter().all(|material| material.emission == Vec3::ZERO) {
            return emissive;
        }
        let mut sum = 0.0;
        for (index, instance) in (0..).zip(&scene.instances) {
            let mesh = &scene.meshes[instance.mesh as usize];
            for triangle in 0..mesh.triangles.len() as u32 {
                let strength = strength(scene, index, triangle);
                if strength == 0.0 {
                    continue;
                }
                let corners = mesh.corners(triangle).map(|corner| {
                    instance.to_world.map_or(corner, |to_world| to_world.transform_point3(corner))
                });
                let area = 0.5 * (corners[1] - corners[0]).cross(corners[2] - corners[0]).length();
                if area > 0.0 && area.is_finite() {
                    sum += f64::from(area) * f64::from(strength);
                    emissive.triangles.push((index, triangle));
                    emissive.cumulative.push(sum);
                }
            }
        }
        emissive
    }

    /// Whether no triangle emits.
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// Pdf per solid angle at `x` with which one choice of a point finds `surface`, the surface of `hit`.
    #[inline(always)]
    pub(crate) fn pdf(&self, scene: &Scene, x: Vec3, hit: &Hit, surface: &SurfacePoint) -> f32 {
        let Some(&total) = self.cumulative.last() else { return 0.0 };
        let way = surface.position - x;
        let distance_squared = way.length_squared();
        let cosine = surface.geometric_normal.dot(way).abs() / distance_squared.sqrt();
        let per_area = f64::from(strength(scene, hit.instance, hit.triangle)) / total;
        // A grazing look at an emitter is as good as never chosen through its area; 0/0 is no number.
        let pdf = per_area as f32 * distance_squared / cosine;
        if pdf.is_nan() { 0.0 } else { pdf }
    }

    /// Choice `k` of `count` for the mesh point at `x`, given three random numbers of [0, 1) that belong to `x`; `None`
    /// where it shows a side that doesn't emit.
    #[inline(always)]
    pub(crate) fn sample(
        &self,
        scene: &Scene,
        x: Vec3,
        k: u32,
        count: u32,
        noise: Vec3,
    ) -> Option<EmissiveSample> {
        let total = *self.cumulative.last()?;
        let target = f64::from(k as f32 + noise.x) / f64::from(count) * total;
        let index = self.cumulative.partition_point(|&sum| sum <= target).min(self.triangles.len() - 1);
        let &(instance, triangle) = self.triangles.get(index)?;
        // A sequence whose every stretch fills the square evenly (Roberts' R2), shifted by the noise.
        let step = Vec2::new(0.754_877_7, 0.569_840_3);
        let mut at = (Vec2::new(noise.y, noise.z) + step * k as f32).fract();
        if at.x + at.y > 1.0 {
            at = Vec2::ONE - at;
        }
        let mesh = &scene.meshes[scene.instances[instance as usize].mesh as usize];
        if !scene.is_opaque(mesh, triangle, at.x, at.y) {
            return None;
        }
        let mut hit = Hit { t: 1.0, u: at.x, v: at.y, instance, triangle };
        // Which side shows is known once the point is: the direction decides it.
        let way = scene.interaction(&hit, Vec3::Z).point.position - x;
        hit.t = way.length();
        let direction = way.try_normalize()?;
        let Interaction { point: surface, emission, .. } = scene.interaction(&hit, direction);
        if emission == Vec3::ZERO {
            return None;
        }
        let pdf = self.pdf(scene, x, &hit, &surface);
        (pdf > 0.0 && pdf.is_finite()).then_some(EmissiveSample { surface, emission, direction, pdf })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Instance, Material, Positions, TriangleMaterials, TriangleMesh};
    use std::f32::consts::PI;
    use std::sync::Arc;

    /// A shining square of edge 2 at height 1 over the point, facing down.
    fn lamp() -> Scene {
        Scene {
            meshes: vec![Arc::new(TriangleMesh {
                name: String::new(),
                positions: Positions::new(vec![
                    [-1.0, 1.0, -1.0],
                    [1.0, 1.0, -1.0],
                    [1.0, 1.0, 1.0],
                    [-1.0, 1.0, 1.0],
                ]),
                triangles: Arc::new(vec![[0, 1, 2], [0, 2, 3]]),
                normals: None,
                uvs: None,
                colors: None,
                materials: TriangleMaterials::Uniform(0),
            })],
            instances: vec![Instance { mesh: 0, to_world: None }],
            materials: vec![Material { emission: Vec3::ONE, ..Material::default() }],
            ..Scene::default()
        }
    }

    /// The mean of 1/pdf is the solid angle: a face of a cube seen from its centre is a sixth of the sphere.
    #[test]
    fn the_pdf_is_that_of_the_choice() {
        let scene = lamp();
        let emissive = EmissiveTriangles::of_scene(&scene);
        const COUNT: u32 = 4096;
        let mut solid_angle = 0.0;
        for k in 0..COUNT {
            let sample = emissive.sample(&scene, Vec3::ZERO, k, COUNT, Vec3::splat(0.5)).unwrap();
            assert!(sample.direction.y > 0.5 && sample.surface.position.y == 1.0);
            solid_angle += 1.0 / sample.pdf / COUNT as f32;
        }
        assert!((solid_angle - 4.0 * PI / 6.0).abs() < 0.01, "{solid_angle}");
    }

    /// The back of a one-sided lamp is dark, and so is a scene without emission.
    #[test]
    fn what_does_not_emit_is_not_chosen() {
        let mut scene = lamp();
        let emissive = EmissiveTriangles::of_scene(&scene);
        let above = Vec3::new(0.0, 3.0, 0.0);
        assert!((0..64).all(|k| emissive.sample(&scene, above, k, 64, Vec3::ZERO).is_none()));
        scene.materials[0].emission = Vec3::ZERO;
        assert!(EmissiveTriangles::of_scene(&scene).is_empty());
    }
}
