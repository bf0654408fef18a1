//! Small squares of pixels in which averaged light is interpolated (method §9).

use glam::Vec3;

use crate::render::paths::PathVertex;
use crate::render::tiles::Tile;

/// Edge of a square in pixels, and how many pixels that are.
const EDGE: usize = 4;
pub(super) const PIXELS: usize = EDGE * EDGE;

/// Corners of a square, and one of the pixels between them, which tells how well they stand for all.
const CORNERS: [usize; 4] = [0, EDGE - 1, PIXELS - EDGE, PIXELS - 1];
const WITNESS: usize = EDGE + 1;

/// The order in which pixels are looked up, and how many of them always are: the corners and the witness.
const ORDER: [usize; PIXELS] = [0, 3, 12, 15, 5, 1, 2, 4, 6, 7, 8, 9, 10, 11, 13, 14];
const ASKED: usize = 5;

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

/// Finds the light of one vertex of a square, by its place in the square.
///
/// A trait, since closures are compiled for the oldest processor wherever they are not inlined.
pub(super) trait LookUp {
    /// The light.
    fn light(&mut self, place: usize) -> Vec3;
}

/// Fills in the light of a smooth square's vertices. That of five is looked up; only if the one between the corners is by more than a share of `tolerance` beside what they say of
/// it, that of all others too. Returns whether it was not, so that they are interpolated.
#[inline(always)]
pub(super) fn fill(light: &mut [Vec3], tolerance: f32, mut look_up: impl LookUp) -> bool {
    let mut place = 0;
    while let Some(&asked) = ORDER.get(place) {
        if place == ASKED {
            let said = between(|corner| light[corner], WITNESS);
            if (said - light[WITNESS]).abs().cmple(tolerance * light[WITNESS]).all() {
                for place in interpolated_places() {
                    light[place] = between(|corner| light[corner], place);
                }
                return true;
            }
        }
        light[asked] = look_up.light(asked);
        place += 1;
    }
    false
}

/// Places in a square between those that are always looked up.
#[inline(always)]
pub(super) fn interpolated_places() -> impl Iterator<Item = usize> {
    ORDER.into_iter().skip(ASKED)
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

    /// Light by place that counts how often it is asked.
    struct Counted<'a, F> {
        light: F,
        asked: &'a mut usize,
    }

    impl<F: Fn(usize) -> Vec3> LookUp for Counted<'_, F> {
        fn light(&mut self, place: usize) -> Vec3 {
            *self.asked += 1;
            (self.light)(place)
        }
    }

    /// Every pixel is in the order once, those first that are always asked.
    #[test]
    fn all_pixels_are_in_order() {
        let mut sorted = ORDER;
        sorted.sort_unstable();
        assert_eq!(sorted, std::array::from_fn(|place| place));
        assert_eq!(ORDER[..ASKED], [CORNERS.as_slice(), &[WITNESS]].concat());
    }

    /// Light that is bilinear is looked up at five of sixteen pixels and right at all. Where it is not, as at a dark spot, all are looked up.
    #[test]
    fn what_corners_do_not_say_is_looked_up() {
        let vertices = plane();
        let spot = |at: Vec3| if at.distance(Vec3::new(5.0, 0.0, 1.0)) < 1.2 { 0.98 } else { 1.0 };
        for (tolerance, dark, expected) in [(0.01, false, 5), (0.01, true, 16), (0.05, true, 5)] {
            let mut asked = 0;
            let light = &|place: usize| {
                let at = vertices[place].surface.position;
                Vec3::splat((2.0 + at.x) * (1.0 + at.z) * if dark { spot(at) } else { 1.0 })
            };
            let mut found = [Vec3::ZERO; 16];
            let counted = Counted { light, asked: &mut asked };
            let interpolated = fill(&mut found, tolerance, counted);
            assert_eq!((asked, interpolated), (expected, expected == 5));
            for (place, found) in found.into_iter().enumerate() {
                assert!(found.abs_diff_eq(light(place), 1.1 * tolerance * light(place).x), "{found}");
            }
        }
    }
}
