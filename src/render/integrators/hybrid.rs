//! Hybrid shadows (method §4): where the points of D_y agree about a light, their answer stands; where they disagree, an
//! occlusion ray from the surface point gives it.
//!
//! Agreement may still be wrong: an occluder thinner than the spacing, or close to the surface, can miss all of D_y. A few
//! rays per square of pixels verify what is assumed. Where one contradicts the mesh points, the visibility of its square and of
//! the squares around it is traced instead, and so on as long as contradictions turn up: shadows cover connected patches of
//! the image.

use glam::Vec3;

use crate::accel::{Accel, LaneMask};
use crate::light_mesh::direct::DirectView;
use crate::light_mesh::lookup::LookupScratch;
use crate::lights::VisibilityBits;
use crate::render::surface_group::{SurfaceGroup, light_of_seen};
use crate::render::tiles::Tile;
use crate::render::trace::PathVertex;
use crate::simd::LANES;

/// Squares of a tile, one bit each.
type SquareMask = u64;

/// Sixteen surface points of a tile, and what is known about their view of one light.
struct Member {
    group: SurfaceGroup,
    /// The square of each point.
    squares: [u8; LANES],
    /// The points that have the light above their horizon and whose visibility is assumed from the mesh.
    assumed: LaneMask,
    /// The points that see the light, as far as is known.
    seeing: LaneMask,
}

impl Member {
    fn new(vertices: &[PathVertex], tile: &Tile) -> Self {
        let mut squares = [0; LANES];
        for (square, vertex) in squares.iter_mut().zip(vertices) {
            *square = tile.square_of(vertex.pixel);
        }
        Self { group: SurfaceGroup::new(vertices), squares, assumed: 0, seeing: 0 }
    }

    /// Traces `points`, whose visibility is assumed no longer; returns the squares of those for which the assumption was wrong.
    fn trace<A: Accel>(&mut self, accel: &A, points: LaneMask) -> SquareMask {
        let truth = self.group.seeing(accel, points);
        let wrong = (self.seeing ^ truth) & points & self.assumed;
        self.seeing = self.seeing & !points | truth;
        self.assumed &= !points;
        self.squares_of(wrong)
    }

    fn squares_of(&self, points: LaneMask) -> SquareMask {
        (0..LANES).filter(|lane| points >> lane & 1 == 1).fold(0, |mask, lane| mask | 1 << self.squares[lane])
    }

    /// The points of some squares whose visibility is assumed.
    fn assumed_in(&self, squares: SquareMask) -> LaneMask {
        let mut points = 0;
        for (lane, square) in self.squares.iter().enumerate() {
            points |= ((squares >> square & 1) as LaneMask) << lane;
        }
        points & self.assumed
    }
}

/// `count` of the given points, if there are as many; `which` is a number that picks different ones each time.
fn choose(points: LaneMask, count: u32, which: usize) -> LaneMask {
    let mut rest = points as u16;
    let mut chosen = 0;
    for k in 0..count {
        if rest == 0 {
            break;
        }
        let start = (which as u32 + k * LANES as u32 / count) % LANES as u32;
        let lane = (rest.rotate_right(start).trailing_zeros() + start) % LANES as u32;
        chosen |= 1 << lane;
        rest &= !(1 << lane);
    }
    chosen
}

/// Shades surface points of a tile: fills `light` with the I of each; returns the number of rays traced towards lights.
pub(super) fn shade_hybrid<A: Accel>(
    accel: &A,
    mesh: DirectView,
    tile: &Tile,
    vertices: &[PathVertex],
    scratch: &mut LookupScratch,
    light: &mut [Vec3],
) -> u64 {
    let lights = mesh.estimator.lights;
    let chunks = lights.chunks().len();
    let mut seen: Vec<VisibilityBits> = vec![0; chunks * vertices.len()];
    let mut uncertain = seen.clone();
    if chunks > 0 {
        for ((vertex, seen), uncertain) in
            vertices.iter().zip(seen.chunks_exact_mut(chunks)).zip(uncertain.chunks_exact_mut(chunks))
        {
            mesh.classify(accel, &vertex.surface, scratch, seen, uncertain);
        }
    }
    let mut members: Vec<Member> =
        vertices.chunks(LANES).map(|vertices| Member::new(vertices, tile)).collect();
    let mut rays = 0;
    for (index, chunk) in lights.chunks().iter().enumerate() {
        // The lights of a chunk are neighbours: disagreement about some makes agreement about the others less certain.
        let uncertain_lights: Vec<u32> = (0..members.len())
            .map(|number| {
                let first = number * LANES;
                let points = first..vertices.len().min(first + LANES);
                points.fold(0, |any, vertex| any | uncertain[vertex * chunks + index]).count_ones()
            })
            .collect();
        for light in (0..LANES).filter(|light| chunk.used >> light & 1 == 1) {
            let mut wrong: SquareMask = 0;
            for (number, member) in members.iter_mut().enumerate() {
                let facing = member.group.aim(chunk, light);
                let (mut disagreed, mut seeing) = (0, 0);
                for point in 0..LANES.min(vertices.len() - number * LANES) {
                    let at = (number * LANES + point) * chunks + index;
                    disagreed |= LaneMask::from(uncertain[at] >> light & 1) << point;
                    seeing |= LaneMask::from(seen[at] >> light & 1) << point;
                }
                member.assumed = facing & !disagreed;
                member.seeing = seeing;
                let checks = match uncertain_lights[number] {
                    0 => (number + light) as u32 % 2,
                    1..=3 => 1,
                    _ => 2,
                };
                let which = number * 7 + light + index * 5;
                let traced = facing & disagreed | choose(member.assumed, checks, which);
                if traced != 0 {
                    rays += u64::from(traced.count_ones());
                    wrong |= member.trace(accel, traced);
                }
            }
            let mut verified: SquareMask = 0;
            loop {
                let open = Tile::around(wrong) & !verified;
                if open == 0 {
                    break;
                }
                verified |= open;
                for member in &mut members {
                    let traced = member.assumed_in(open);
                    if traced != 0 {
                        member.group.aim(chunk, light);
                        rays += u64::from(traced.count_ones());
                        wrong |= member.trace(accel, traced);
                    }
                }
            }
            for (number, member) in members.iter().enumerate() {
                for point in 0..LANES.min(vertices.len() - number * LANES) {
                    let bits = &mut seen[(number * LANES + point) * chunks + index];
                    *bits = *bits & !(1 << light) | ((member.seeing >> point & 1) << light) as VisibilityBits;
                }
            }
        }
    }
    light_of_seen(lights, vertices, &seen, light);
    rays
}
