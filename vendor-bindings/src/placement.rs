//! Placements of instances: which can be undone.

use crate::packet::MAX_COORDINATE;

/// Largest magnitude of a ray's coordinates that stays within [`MAX_COORDINATE`] when the ray is brought
/// into the space of an instance; `None` where that is too small to be of use.
///
/// `to_world` holds three axes, then the origin. Debian's builds abort on rays beyond, so this is not left to
/// Embree; and other ray tracers that are to give the same answers need the same rule.
pub fn largest_coordinate(to_world: &[[f32; 3]; 4]) -> Option<f32> {
    if !to_world.iter().flatten().all(|entry| entry.is_finite()) {
        return None;
    }
    let [x, y, z, origin] = to_world.map(|column| column.map(f64::from));
    let cross = |a: [f64; 3], b: [f64; 3]| {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    };
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let adjugate = [cross(y, z), cross(z, x), cross(x, y)];
    let determinant = dot(x, adjugate[0]);
    // Embree inverts in f32: the determinant must be an ordinary number there, and stand out from the
    // rounding of the products that it is made of (a few 10⁻⁷ of the axes' lengths).
    let ordinary = (determinant as f32).is_normal() && (determinant as f32).recip().is_normal();
    let volume = [x, y, z].iter().map(|axis| dot(*axis, *axis).sqrt()).product::<f64>();
    if !ordinary || determinant.abs() < 1e-5 * volume {
        return None;
    }
    // The inverse has the rows adjugate / determinant; half the range is left for its rounding.
    let mut largest = f64::from(MAX_COORDINATE);
    for row in adjugate {
        let factor = row.iter().map(|a| (a / determinant).abs()).sum::<f64>();
        let offset = (dot(row, origin) / determinant).abs();
        largest = largest.min((0.5 * f64::from(MAX_COORDINATE) - offset) / factor);
    }
    (largest >= 1e9).then_some(largest as f32)
}
