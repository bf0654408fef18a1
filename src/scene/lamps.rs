//! Lamps with a size as geometry.

use std::f32::consts::{PI, TAU};

use glam::Vec3;

use super::material::Material;
use super::mesh::TriangleMesh;
use super::scene::Scene;

/// Sides of a disc and of a ball's equator.
const SIDES: u32 = 24;

impl Scene {
    /// Adds the geometry of a ball lamp ([`Light::ball`](super::Light::ball)), to be seen and to cast shadows: it shows a radiance of I/(π r²), its light being
    /// the [`Light`](super::Light)'s alone.
    pub fn add_ball(&mut self, center: Vec3, radius: f32, intensity: Vec3) {
        let rings = SIDES / 2;
        let emitted = intensity / (PI * radius * radius);
        // The disc that one sees of it is as large as that of the sphere, to a thousandth.
        let radius = radius * corner_of_disc();
        let mut positions = vec![[0.0, radius, 0.0]];
        for ring in 1..rings {
            let (height, from_axis) = (PI * ring as f32 / rings as f32).sin_cos();
            let (from_axis, height) = (radius * height, radius * from_axis);
            positions.extend((0..SIDES).map(|side| {
                let (z, x) = (TAU * side as f32 / SIDES as f32).sin_cos();
                [from_axis * x, height, from_axis * z]
            }));
        }
        positions.push([0.0, -radius, 0.0]);
        let last = positions.len() as u32 - 1;
        let mut triangles = Vec::new();
        for side in 0..SIDES {
            let next = (side + 1) % SIDES;
            let at = |ring: u32, side: u32| 1 + ring * SIDES + side;
            triangles.push([0, at(0, next), at(0, side)]);
            for ring in 0..rings - 2 {
                triangles.push([at(ring, side), at(ring, next), at(ring + 1, side)]);
                triangles.push([at(ring, next), at(ring + 1, next), at(ring + 1, side)]);
            }
            triangles.push([at(rings - 2, side), at(rings - 2, next), last]);
        }
        let moved = |position: [f32; 3]| (Vec3::from(position) + center).to_array();
        let positions = positions.into_iter().map(moved).collect();
        self.add_lamp(positions, triangles, emitted, true);
    }

    /// Adds a flat rectangle that shines to one side, that of `u × v`, its edges; I is its radiant intensity straight ahead, its radiance
    /// I/|u × v|.
    pub fn add_rectangle(&mut self, center: Vec3, u: Vec3, v: Vec3, intensity: Vec3) {
        let corner = center - 0.5 * (u + v);
        let positions = [corner, corner + u, corner + u + v, corner + v].map(|at| at.to_array());
        let radiance = intensity / u.cross(v).length();
        self.add_lamp(positions.to_vec(), vec![[0, 1, 2], [0, 2, 3]], radiance, false);
    }

    /// Adds a flat disc that shines to one side, along `axis` (any length but 0); I is its radiant intensity straight ahead, its radiance I/(π r²).
    pub fn add_disc(&mut self, center: Vec3, axis: Vec3, radius: f32, intensity: Vec3) {
        let (u, v) = axis.normalize_or(Vec3::Y).any_orthonormal_pair();
        let corner = radius * corner_of_disc();
        let at = |side: u32| {
            let (sine, cosine) = (TAU * side as f32 / SIDES as f32).sin_cos();
            (center + (u * cosine + v * sine) * corner).to_array()
        };
        let positions = (0..SIDES).map(at).collect();
        let triangles = (1..SIDES - 1).map(|side| [0, side, side + 1]).collect();
        self.add_lamp(positions, triangles, intensity / (PI * radius * radius), false);
    }

    fn add_lamp(&mut self, positions: Vec<[f32; 3]>, triangles: Vec<[u32; 3]>, radiance: Vec3, lamp: bool) {
        let name = "lamp".to_owned();
        let material =
            Material { name, diffuse: Vec3::ZERO, emission: radiance, lamp, ..Material::default() };
        let material = self.add_material(material);
        self.add(TriangleMesh::new(positions, triangles).with_material(material));
    }
}

/// Distance of the corners of a regular polygon from its middle, whose area is that of a circle of radius 1.
fn corner_of_disc() -> f32 {
    let side = TAU / SIDES as f32;
    (side / side.sin()).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Hit, Interaction};

    fn areas_and_normals(scene: &Scene) -> (f32, Vec<(Vec3, Vec3)>) {
        let mesh = &scene.meshes[0];
        let mut area = 0.0;
        let normals = (0..mesh.triangles.len() as u32).map(|triangle| {
            let [a, b, c] = mesh.corners(triangle);
            let cross = (b - a).cross(c - a);
            area += 0.5 * cross.length();
            ((a + b + c) / 3.0, cross.normalize())
        });
        let normals = normals.collect();
        (area, normals)
    }

    /// The ball's front points outwards everywhere, its area is that of the sphere to 2 %, and it is nowhere larger than rays to it allow for.
    #[test]
    fn a_ball_is_round() {
        let (center, mut scene) = (Vec3::new(1.0, 2.0, 3.0), Scene::new());
        scene.add_ball(center, 0.5, Vec3::ONE);
        let (area, normals) = areas_and_normals(&scene);
        assert!((area / PI - 1.0).abs() < 0.02, "{area}");
        for (at, normal) in normals {
            assert!(normal.dot((at - center).normalize()) > 0.95 && at.distance(center) < 0.505);
        }
        assert_eq!(scene.validate(), Ok(()));
    }

    /// Rectangle and disc shine where they should, with the radiance of their intensity.
    #[test]
    fn flat_lamps_shine_ahead() {
        let lamps: [fn(&mut Scene); 2] = [
            |scene| scene.add_rectangle(Vec3::ONE, Vec3::X * 2.0, Vec3::Z * -3.0, Vec3::splat(6.0)),
            |scene| scene.add_disc(Vec3::ONE, Vec3::Y, 2.0, Vec3::splat(4.0 * PI)),
        ];
        for (lamp, size) in lamps.into_iter().zip([6.0, 4.0 * PI]) {
            let mut scene = Scene::new();
            lamp(&mut scene);
            let (area, normals) = areas_and_normals(&scene);
            assert!((area / size - 1.0).abs() < 0.001, "{area}");
            assert!(normals.iter().all(|(at, normal)| at.y == 1.0 && normal.y > 0.999));
            let hit = Hit { t: 1.0, u: 0.2, v: 0.2, instance: 0, triangle: 0 };
            let Interaction { emission, lamp, .. } = scene.interaction(&hit, Vec3::NEG_Y);
            assert!((emission - 1.0).abs().max_element() < 1e-5 && !lamp);
        }
    }
}
