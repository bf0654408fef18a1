//! Simple solids as OBJ text. Fronts point outwards; indices are relative, so that shapes can follow each other.

use std::f32::consts::{PI, TAU};
use std::fmt::Write as _;

use glam::Vec3;

/// A `v` or `vn` statement, to a ten-thousandth and without trailing zeros.
fn triple(text: &mut String, keyword: &str, value: Vec3) {
    text.push_str(keyword);
    for component in value.to_array() {
        let start = text.len();
        // Writing to a string cannot fail.
        let _ = write!(text, " {component:.4}");
        text.truncate(start + text[start..].trim_end_matches('0').trim_end_matches('.').len());
    }
    text.push('\n');
}

/// A new object of one material.
pub fn object(text: &mut String, name: &str, material: &str) {
    let _ = writeln!(text, "o {name}\nusemtl {material}");
}

/// A parallelogram whose front is the side that `u × v` points to.
pub fn quad(text: &mut String, corner: Vec3, u: Vec3, v: Vec3) {
    for position in [corner, corner + u, corner + u + v, corner + v] {
        triple(text, "v", position);
    }
    text.push_str("f -4 -3 -2 -1\n");
}

/// A box.
pub fn cuboid(text: &mut String, min: Vec3, max: Vec3) {
    let size = max - min;
    for corner in 0..8 {
        let side = Vec3::new((corner & 1) as f32, (corner >> 1 & 1) as f32, (corner >> 2) as f32);
        triple(text, "v", min + size * side);
    }
    for [a, b, c, d] in [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]] {
        let _ = writeln!(text, "f {} {} {} {}", a - 8, b - 8, c - 8, d - 8);
    }
}

/// The mantle of an upright cylinder, smooth to look at.
pub fn cylinder(text: &mut String, foot: Vec3, height: f32, radius: f32, sides: u32) {
    for side in 0..sides {
        let angle = TAU * side as f32 / sides as f32;
        let outward = Vec3::new(angle.cos(), 0.0, angle.sin());
        triple(text, "v", foot + outward * radius);
        triple(text, "v", foot + outward * radius + Vec3::Y * height);
        triple(text, "vn", outward);
    }
    let n = i64::from(sides);
    for side in 0..n {
        let next = (side + 1) % n;
        // Vertices from the back: bottom and top of a side follow each other.
        let vertex = |side: i64, top: i64| 2 * (side - n) + top;
        let normal = |side: i64| side - n;
        let _ = writeln!(
            text,
            "f {}//{} {}//{} {}//{} {}//{}",
            vertex(side, 0),
            normal(side),
            vertex(side, 1),
            normal(side),
            vertex(next, 1),
            normal(next),
            vertex(next, 0),
            normal(next),
        );
    }
}

/// A ball of `rings` rings of quads and triangles, smooth to look at.
pub fn ball(text: &mut String, centre: Vec3, radius: f32, rings: u32) {
    let columns = 2 * rings;
    for ring in 0..=rings {
        let polar = PI * ring as f32 / rings as f32;
        for column in 0..columns {
            let angle = TAU * column as f32 / columns as f32;
            let outward = Vec3::new(polar.sin() * angle.cos(), polar.cos(), polar.sin() * angle.sin());
            triple(text, "v", centre + outward * radius);
            triple(text, "vn", outward);
        }
    }
    let (n, rings) = (i64::from(columns), i64::from(rings));
    let corner = |ring: i64, column: i64| {
        let index = (ring - rings - 1) * n + column % n;
        format!("{index}//{index}")
    };
    for ring in 0..rings {
        for column in 0..n {
            let (a, b) = (corner(ring, column), corner(ring, column + 1));
            let (c, d) = (corner(ring + 1, column + 1), corner(ring + 1, column));
            // At the poles a ring is a point.
            let _ = match ring {
                0 => writeln!(text, "f {a} {c} {d}"),
                _ if ring == rings - 1 => writeln!(text, "f {a} {b} {d}"),
                _ => writeln!(text, "f {a} {b} {c} {d}"),
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::load::load_model;

    /// All faces of closed shapes look outwards: the signed volume is that of the solid.
    #[test]
    fn fronts_point_outwards() {
        let volume = |shape: &dyn Fn(&mut String)| {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("shape.obj");
            let mut text = String::new();
            shape(&mut text);
            std::fs::write(&path, text).unwrap();
            let model = load_model(&path).unwrap();
            let mesh = &model.meshes[0];
            (0..mesh.triangles.len() as u32)
                .map(|triangle| {
                    let [a, b, c] = mesh.corners(triangle);
                    a.dot(b.cross(c)) / 6.0
                })
                .sum::<f32>()
        };
        let cuboid = volume(&|text| cuboid(text, Vec3::new(1.0, 2.0, 3.0), Vec3::new(2.0, 4.0, 6.0)));
        assert!((cuboid - 6.0).abs() < 1e-3, "{cuboid}");
        // A ball of facets is a little smaller than the round one.
        let ball = volume(&|text| ball(text, Vec3::ONE, 1.0, 24));
        assert!((4.1..4.19).contains(&ball), "{ball}");
        // Without its lids, seen from the middle: the mantle's part is 2/3 of the cylinder.
        let mantle = volume(&|text| cylinder(text, Vec3::NEG_Y, 2.0, 1.0, 48));
        assert!((4.1..4.19).contains(&mantle), "{mantle}");
    }
}
