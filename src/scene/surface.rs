//! Surface points, and what a ray finds out about them.

use glam::{Mat3A, Vec2, Vec3, Vec3A};
use serde::{Deserialize, Serialize};

use super::ray::Hit;
use super::scene::Scene;
use super::texture::TextureMap;
use crate::simd::{LANES, Lanes, each_lane, horizontal_sum};

/// A visible surface point y (docs/method.md §1).
///
/// Both normals are unit length and face the side from which the point was seen (docs/method.md §7).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SurfacePoint {
    /// y in world space, on the triangle to within rounding.
    pub position: Vec3,
    /// How far rays that leave y must start from it along the geometric normal so that rounding can't
    /// put them behind the triangle; scene units.
    pub offset: f32,
    /// Normal of the triangle; it decides sides.
    pub geometric_normal: Vec3,
    /// Interpolated vertex normal, or the geometric one; it turns the cosines only.
    pub shading_normal: Vec3,
}

/// What a ray found: a surface point and its material there.
///
/// Apart from the point, since an image's worth of points is kept for their light, and of the material only a product.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interaction {
    /// y.
    pub point: SurfacePoint,
    /// k_d.
    pub diffuse: Vec3,
    /// k_s.
    pub specular: Vec3,
    /// Emiss towards the side that was seen.
    pub emission: Vec3,
    /// Whether a light stands for what it emits.
    pub lamp: bool,
    /// Whether the front of the triangle (counter-clockwise winding) was seen.
    pub front: bool,
    /// Whether both sides of the material are alike.
    pub two_sided: bool,
    /// Whether camera and reflected rays pass through this side (a culled back face).
    pub culled: bool,
}

impl SurfacePoint {
    /// A point of a flat surface near the origin: rays leave it from 10⁻⁵ above.
    pub fn flat(position: Vec3, normal: Vec3) -> Self {
        Self { position, offset: 1e-5, geometric_normal: normal, shading_normal: normal }
    }

    /// Start of rays that leave the point on the side from which it was seen.
    #[inline(always)]
    pub fn ray_origin(&self) -> Vec3 {
        self.position + self.geometric_normal * self.offset
    }
}

impl Interaction {
    /// Whether it is the back of a one-sided surface.
    pub fn shows_back(&self) -> bool {
        !self.front && !self.two_sided
    }
}

/// Rounding of a coordinate of size c is about ε·c; interpolation of three vertices, the instance transform and
/// the ray–triangle test of the next ray each add a few of those. 32 covers their sum with room to spare, and
/// is still below 1/250,000 of the coordinates' size.
const OFFSET_FACTOR: f32 = 32.0 * f32::EPSILON;

impl Scene {
    /// Surface point and material of a hit, seen along `direction` (any length).
    #[inline(always)]
    pub fn interaction(&self, hit: &Hit, direction: Vec3) -> Interaction {
        self.interaction_with(hit, direction, |map, corners| {
            map.sample(corners[0] * (1.0 - hit.u - hit.v) + corners[1] * hit.u + corners[2] * hit.v).0
        })
    }

    /// The same in the middle of several hits on one triangle, with the mean of what textures have at each of them; and where the
    /// hits lie, by axis.
    ///
    /// `hit` names the triangle; `lanes` are those of the barycentric coordinates that are of hits on it, at least one.
    #[inline(always)]
    pub fn interaction_of_lanes(
        &self,
        hit: &Hit,
        lanes: u32,
        u: &Lanes,
        v: &Lanes,
        direction: Vec3,
    ) -> (Interaction, [Lanes; 3]) {
        let part = 1.0 / lanes.count_ones() as f32;
        let mean = |values: &Lanes| {
            let mut counting = *values;
            for lane in 0..LANES {
                counting[lane] = if lanes >> lane & 1 == 1 { counting[lane] } else { 0.0 };
            }
            horizontal_sum(&counting) * part
        };
        let middle = Hit { u: mean(u), v: mean(v), ..*hit };
        let interaction = self.interaction_with(&middle, direction, |map, [a, b, c]| {
            let at = |lane: usize| a * (1.0 - u[lane] - v[lane]) + b * u[lane] + c * v[lane];
            each_lane(lanes).map(|lane| map.sample(at(lane)).0).sum::<Vec3>() * part
        });
        let [a, b, c] = self.corners(hit);
        let positions = [0, 1, 2].map(|axis| {
            let (start, along_u, along_v) = (a[axis], b[axis] - a[axis], c[axis] - a[axis]);
            let mut positions = [0.0; LANES];
            for lane in 0..LANES {
                positions[lane] = start + u[lane] * along_u + v[lane] * along_v;
            }
            positions
        });
        (interaction, positions)
    }

    /// The corners of the triangle that was hit, in world space.
    #[inline(always)]
    pub(crate) fn corners(&self, hit: &Hit) -> [Vec3; 3] {
        let instance = &self.instances[hit.instance as usize];
        let corners = self.meshes[instance.mesh as usize].corners(hit.triangle);
        match &instance.to_world {
            Some(to_world) => corners.map(|corner| to_world.transform_point3(corner)),
            None => corners,
        }
    }

    /// The interaction at a hit; `color` is the colour of a texture, given the texture coordinates of the triangle's corners.
    #[inline(always)]
    fn interaction_with(
        &self,
        hit: &Hit,
        direction: Vec3,
        color: impl Fn(&TextureMap, [Vec2; 3]) -> Vec3,
    ) -> Interaction {
        let instance = &self.instances[hit.instance as usize];
        let mesh = &*self.meshes[instance.mesh as usize];
        let corners = mesh.corners(hit.triangle);
        let (u, v) = (hit.u, hit.v);
        let w = 1.0 - u - v;

        let mut position = corners[0] * w + corners[1] * u + corners[2] * v;
        let edges = [corners[1] - corners[0], corners[2] - corners[0]];
        // The next ray's test measures its distance to the plane from the vertices, so that the
        // rounding grows with the triangle as well as with the coordinates.
        let mut extent = edges[0].abs().max_element().max(edges[1].abs().max_element());
        let mut normal = edges[0].cross(edges[1]);
        let mut shading = mesh.normals.as_ref().map(|normals| {
            let [a, b, c] =
                mesh.triangles[hit.triangle as usize].map(|i| Vec3::from_array(normals[i as usize]));
            a * w + b * u + c * v
        });
        if let Some(to_world) = &instance.to_world {
            extent = (extent + position.abs().max_element()) * max_scale(&to_world.matrix3);
            position = to_world.transform_point3(position);
            extent += to_world.translation.abs().max_element();
            // The cofactor matrix carries normals, keeps their side under mirroring up to the sign of
            // the determinant, and exists for singular transforms.
            let cofactors = cofactors(&to_world.matrix3);
            let mirrored = to_world.matrix3.determinant() < 0.0;
            let carry = |n: Vec3| {
                let n = Vec3::from(cofactors * Vec3A::from(n));
                if mirrored { -n } else { n }
            };
            normal = carry(normal);
            shading = shading.map(carry);
            // Counter-clockwise order is judged in object space: a mirrored instance keeps its front.
        }

        let normal = normal.normalize_or(-direction.normalize_or(Vec3::Z));
        let front = normal.dot(direction) <= 0.0;
        let geometric_normal = if front { normal } else { -normal };
        let shading_normal = shading.and_then(Vec3::try_normalize).map_or(geometric_normal, |n| {
            // Vertex normals may be wound against the triangle; what counts is the side seen.
            if n.dot(geometric_normal) < 0.0 { -n } else { n }
        });

        let material = &self.materials[mesh.materials.of(hit.triangle) as usize];
        let mut diffuse = material.diffuse;
        let mut emission = if front || material.two_sided { material.emission } else { Vec3::ZERO };
        if material.diffuse_map.is_some() || material.emission_map.is_some() {
            let corners = mesh.uvs.as_ref().map_or([Vec2::ZERO; 3], |uvs| {
                mesh.triangles[hit.triangle as usize].map(|i| Vec2::from_array(uvs[i as usize]))
            });
            let color = |map: &Option<TextureMap>| map.as_ref().map_or(Vec3::ONE, |map| color(map, corners));
            diffuse *= color(&material.diffuse_map);
            emission *= color(&material.emission_map);
        }
        if let Some(colors) = &mesh.colors {
            let [a, b, c] =
                mesh.triangles[hit.triangle as usize].map(|i| Vec3::from_array(colors[i as usize]));
            diffuse *= a * w + b * u + c * v;
        }
        let offset = OFFSET_FACTOR * (position.abs().max_element() + extent);
        Interaction {
            point: SurfacePoint { position, offset, geometric_normal, shading_normal },
            diffuse,
            specular: material.specular,
            emission,
            lamp: material.lamp,
            front,
            two_sided: material.two_sided,
            culled: !front && material.cull && !material.two_sided,
        }
    }
}

/// Upper bound of how much a matrix stretches a vector's largest component.
#[inline(always)]
fn max_scale(matrix: &Mat3A) -> f32 {
    let sum = matrix.x_axis.abs() + matrix.y_axis.abs() + matrix.z_axis.abs();
    sum.max_element()
}

/// Cofactor matrix: the inverse transpose times the determinant.
#[inline(always)]
fn cofactors(m: &Mat3A) -> Mat3A {
    Mat3A::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Instance, Material, Positions, TriangleMaterials, TriangleMesh};
    use glam::Affine3A;
    use std::sync::Arc;

    fn triangle(to_world: Option<Affine3A>) -> Scene {
        Scene {
            meshes: vec![Arc::new(TriangleMesh {
                name: String::new(),
                positions: Positions::new(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
                triangles: Arc::new(vec![[0, 1, 2]]),
                normals: None,
                uvs: None,
                colors: None,
                materials: TriangleMaterials::Uniform(0),
            })],
            instances: vec![Instance { mesh: 0, to_world }],
            materials: vec![Material { emission: Vec3::ONE, ..Material::default() }],
            ..Scene::default()
        }
    }

    const HIT: Hit = Hit { t: 1.0, u: 0.25, v: 0.5, instance: 0, triangle: 0 };

    /// Counter-clockwise winding seen from +z is the front: the normal faces the viewer and it emits.
    #[test]
    fn the_front_is_the_counter_clockwise_side() {
        let scene = triangle(None);
        let front = scene.interaction(&HIT, Vec3::NEG_Z);
        assert!(front.front);
        assert_eq!(front.point.geometric_normal, Vec3::Z);
        assert_eq!(front.emission, Vec3::ONE);
        assert_eq!(front.point.position, Vec3::new(0.25, 0.5, 0.0));
        let back = scene.interaction(&HIT, Vec3::Z);
        assert!(!back.front);
        assert_eq!(back.point.geometric_normal, Vec3::NEG_Z);
        assert_eq!(back.emission, Vec3::ZERO);
    }

    /// A mirrored instance keeps its material on the same side: its front is the image of the front.
    #[test]
    fn mirroring_carries_the_front_along() {
        let mirror = triangle(Some(Affine3A::from_scale(Vec3::new(1.0, 1.0, -1.0))));
        // The front pointed to +z; its mirror image points to −z.
        assert!(mirror.interaction(&HIT, Vec3::Z).front);
        let flipped_x = triangle(Some(Affine3A::from_scale(Vec3::new(-1.0, 1.0, 1.0))));
        // Mirrored in x, the image of the +z normal is still +z.
        assert!(flipped_x.interaction(&HIT, Vec3::NEG_Z).front);
    }
}
