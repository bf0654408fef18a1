//! Averaged shadows: the light of vertices as the mean over mesh points (method §3, §4).

use glam::Vec3;

use super::smooth_square::{self, LookUp};
use crate::accel::Accel;
use crate::light_mesh::direct::DirectView;
use crate::light_mesh::lookup::LookupScratch;
use crate::render::layers::LightParts;
use crate::render::paths::PathVertex;
use crate::render::tiles::Tile;

/// Size of squares of pixels in which light is interpolated, in units of R: weights of mesh points hardly change over less.
const SMOOTH_SIZE: f32 = 0.25;

/// How a tile's vertices are shaded by averages.
pub(super) struct Averages<'a, 'p, A> {
    pub accel: &'a A,
    pub direct: DirectView<'a>,
    /// Between pixels of one plane light is interpolated where that is wrong by no more than this share of it.
    pub tolerance: f32,
    pub tile: &'a Tile,
    pub vertices: &'a [PathVertex],
    /// What is asked for of the light beside its sum.
    pub parts: Option<&'a mut LightParts<'p>>,
}

impl<A: Accel> Averages<'_, '_, A> {
    /// Fills `light` with the I of the vertices, and what is asked for of its parts, `WITH_PARTS` being whether anything may be. That is told apart here, since whoever
    /// asks for no parts shades measurably slower in a loop that could make some.
    #[inline(always)]
    pub fn fill<const WITH_PARTS: bool>(mut self, scratch: &mut LookupScratch, light: &mut [Vec3]) {
        let vertices = self.vertices;
        let neighbourhoods = self.direct.lookup.neighbourhoods;
        let between_pixels = self.tolerance > 0.0 && neighbourhoods.is_smooth();
        let size = |y: Vec3| SMOOTH_SIZE * neighbourhoods.radius_at(y);
        let mut before = Vec3::NAN;
        let mut number = 0;
        while let Some(vertex) = vertices.get(number) {
            let normal = vertex.surface.shading_normal;
            if between_pixels && smooth_square::comes_first(self.tile, &vertices[number..], size) {
                let light = &mut light[number..][..smooth_square::PIXELS];
                let tolerance = self.tolerance;
                let square = Square::<A, WITH_PARTS> { averages: &mut self, first: number, scratch };
                let interpolated = smooth_square::fill(light, tolerance, square);
                if WITH_PARTS && interpolated {
                    self.interpolate_parts(number);
                }
                number += smooth_square::PIXELS;
            } else {
                let after = vertices.get(number + 1).map_or(Vec3::NAN, |next| next.surface.shading_normal);
                let in_row = normal == before || normal == after;
                light[number] = self.look_up::<WITH_PARTS>(number, in_row, scratch);
                number += 1;
            }
            before = normal;
        }
    }

    /// I of a vertex, which may be one of several `in_row` that have the same normal.
    #[inline(always)]
    fn look_up<const WITH_PARTS: bool>(
        &mut self,
        number: usize,
        in_row: bool,
        scratch: &mut LookupScratch,
    ) -> Vec3 {
        let Self { accel, direct, vertices, parts, .. } = self;
        let surface = &vertices[number].surface;
        let light = if in_row {
            direct.illumination_in_row(*accel, surface, scratch)
        } else {
            direct.illumination(*accel, surface, scratch)
        };
        if let (true, Some(parts)) = (WITH_PARTS, parts) {
            let (groups, error) = parts.of_direct();
            if groups.is_some() || error.is_some() {
                direct.find_again(*accel, surface, scratch);
            }
            if let Some(groups) = groups {
                let (groups, sums) = groups.of_vertex(number);
                direct.add_by_group(surface, scratch, groups, sums);
            }
            if let Some(error) = error.and_then(|error| error.get_mut(number)) {
                *error = direct.half_difference(surface, scratch);
            }
        }
        light
    }

    /// Makes the parts of a square's light of those of its corners, as its light is made.
    fn interpolate_parts(&mut self, first: usize) {
        let Some(parts) = &mut self.parts else { return };
        let (mut groups, mut error) = parts.of_direct();
        for place in smooth_square::interpolated_places() {
            if let Some(groups) = &mut groups {
                for group in 0..groups.count() {
                    let light =
                        smooth_square::between(|corner| groups.of_vertex(first + corner).1[group], place);
                    groups.of_vertex(first + place).1[group] = light;
                }
            }
            if let Some(error) = &mut error {
                error[first + place] = smooth_square::between(|corner| error[first + corner], place);
            }
        }
    }
}

/// A smooth square of vertices.
struct Square<'s, 'a, 'p, A, const WITH_PARTS: bool> {
    averages: &'s mut Averages<'a, 'p, A>,
    /// Number of its first vertex.
    first: usize,
    scratch: &'s mut LookupScratch,
}

impl<A: Accel, const WITH_PARTS: bool> LookUp for Square<'_, '_, '_, A, WITH_PARTS> {
    #[inline(always)]
    fn light(&mut self, place: usize) -> Vec3 {
        self.averages.look_up::<WITH_PARTS>(self.first + place, true, self.scratch)
    }
}
