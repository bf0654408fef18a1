//! Small squares of pixels in which averaged light is interpolated (method §9).

use glam::Vec3;

use crate::render::paths::PathVertex;
use crate::render::tiles::Tile;

/// Edge of a square in pixels, and how many pixels that are.
const EDGE: usize = 4;
pub(super) const PIXELS: usize = EDGE * EDGE;

/// Pixels whose light is looked up: the corners, and one between them that tells how well they stand for all.
const CORNERS: [usize; 4] = [0, EDGE - 1, PIXELS - EDGE, PIXELS - 1];
const WITNESS: usize = EDGE + 1;

/// Least cosine between the normals of a square, and greatest distance from its plane over its size.
const FLAT_COSINE: f32 = 0.9995;
const FLAT_HEIGHT: f32 = 0.01;

/// Whether some vertices of a tile begin with a smooth square, no larger than `size` says of its place: those of 4×4 pixels in all of which one flat surface is
/// seen, and nothing else.
#[inline(always)]
pub(super) fn comes_first(tile: &Tile, vertices: &[PathVertex], size: impl Fn(Vec3) -> f32) -> bool {
    let Some(square) = vertices.first_chunk::<PIXELS>() else { return false };
    let [first, .., last] = square;
    let (x, y) = (first.pixel % tile.width, first.pixel / tile.width);
    let edge = EDGE as u32;
    if last.pixel != first.pixel + (edge - 1) * (tile.width + 1) || x % edge != 0 || y % edge != 0 {
        return false;
    }
    let [a, b, c, d] = CORNERS;
    let position = |corner: usize| square[corner].surface.position;
    let (a, b, c, d) = (position(a), position(b), position(c), position(d));
    let size = size(a);
    let longest = a.distance_squared(d).max(b.distance_squared(c));
    let (normal, shading) = (first.surface.geometric_normal, first.surface.shading_normal);
    let height = FLAT_HEIGHT * longest.sqrt();
    longest <= size * size
        && square.iter().zip(0u32..).all(|(vertex, number)| {
            let surface = &vertex.surface;
            vertex.pixel == first.pixel + number / edge * tile.width + number % edge
                && normal.dot(surface.geometric_normal) >= FLAT_COSINE
                && shading.dot(surface.shading_normal) >= FLAT_COSINE
                && normal.dot(surface.position - a).abs() <= height
        })
}

/// Fills in the light of a smooth square's vertices. `look_up` is asked, by place in the square, for that of five; only if the one between the corners is by more than a share of
/// `tolerance` beside what they say of it, for that of all others. Returns whether it was not, so that they are interpolated.
#[inline(always)]
pub(super) fn fill(light: &mut [Vec3], tolerance: f32, mut look_up: impl FnMut(usize) -> Vec3) -> bool {
    for place in CORNERS {
        light[place] = look_up(place);
    }
    light[WITNESS] = look_up(WITNESS);
    let said = between(|corner| light[corner], WITNESS);
    let is_close = (said - light[WITNESS]).abs().cmple(tolerance * light[WITNESS]).all();
    for place in interpolated_places() {
        light[place] = if is_close { between(|corner| light[corner], place) } else { look_up(place) };
    }
    is_close
}

/// Places in a square between those that are always looked up.
#[inline(always)]
pub(super) fn interpolated_places() -> impl Iterator<Item = usize> {
    (0..PIXELS).filter(|place| *place != WITNESS && !CORNERS.contains(place))
}

/// What the corners say of a place in their square: they give a value each, and it is bilinear between them.
#[inline(always)]
pub(super) fn between(mut of_corner: impl FnMut(usize) -> Vec3, place: usize) -> Vec3 {
    let [a, b, c, d] = CORNERS;
    let [a, b, c, d] = [of_corner(a), of_corner(b), of_corner(c), of_corner(d)];
    let step = 1.0 / (EDGE - 1) as f32;
    let (x, y) = ((place % EDGE) as f32 * step, (place / EDGE) as f32 * step);
    a.lerp(b, x).lerp(c.lerp(d, x), y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::SurfacePoint;

    const TILE: Tile = Tile { x: 0, y: 0, width: 8, height: 4 };

    /// The second square of a tile that sees a plane, its pixels one unit apart.
    fn plane() -> Vec<PathVertex> {
        let vertex = |number: u32| {
            let (x, y) = (4 + number % 4, number / 4);
            let surface = SurfacePoint::flat(Vec3::new(x as f32, 0.0, y as f32), Vec3::Y);
            PathVertex { surface, reflectance: Vec3::ONE, pixel: y * TILE.width + x }
        };
        (0..16).map(vertex).collect()
    }

    /// A square of one plane is smooth; one that is too large, or cut off, or has another surface, a step or a bend in one of its pixels, is not, for what lies there would
    /// get the light of its surroundings.
    #[test]
    fn only_squares_of_one_plane_are_smooth() {
        let is_smooth = |vertices: &[PathVertex], size: f32| comes_first(&TILE, vertices, |_| size);
        let smooth = plane();
        assert!(is_smooth(&smooth, 4.3) && !is_smooth(&smooth, 4.2) && !is_smooth(&smooth, f32::NAN));
        assert!(!is_smooth(&smooth[..15], 4.3) && !is_smooth(&smooth[1..], 4.3));
        for number in 0..16 {
            let mut double = smooth.clone();
            double.insert(number, smooth[number]);
            assert!(!is_smooth(&double, 4.3) || number == 15);
            let mut step = smooth.clone();
            step[number].surface.position.y += 0.1;
            assert!(!is_smooth(&step, 4.3));
            let mut bend = smooth.clone();
            bend[number].surface.shading_normal = Vec3::new(0.1, 1.0, 0.0).normalize();
            assert!(!is_smooth(&bend, 4.3));
        }
    }

    /// Light that is bilinear is looked up at five of sixteen pixels and right at all. Where it is not, as at a dark spot, all are looked up.
    #[test]
    fn what_corners_do_not_say_is_looked_up() {
        let vertices = plane();
        let spot = |at: Vec3| if at.distance(Vec3::new(5.0, 0.0, 1.0)) < 1.2 { 0.98 } else { 1.0 };
        for (tolerance, dark, expected) in [(0.01, false, 5), (0.01, true, 16), (0.05, true, 5)] {
            let mut asked = 0;
            let light = |place: usize| {
                let at = vertices[place].surface.position;
                Vec3::splat((2.0 + at.x) * (1.0 + at.z) * if dark { spot(at) } else { 1.0 })
            };
            let mut found = [Vec3::ZERO; 16];
            let interpolated = fill(&mut found, tolerance, |place| {
                asked += 1;
                light(place)
            });
            assert_eq!((asked, interpolated), (expected, expected == 5));
            for (place, found) in found.into_iter().enumerate() {
                assert!(found.abs_diff_eq(light(place), 1.1 * tolerance * light(place).x), "{found}");
            }
        }
    }
}
