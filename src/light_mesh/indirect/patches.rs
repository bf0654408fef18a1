//! Patches: what indirect mesh points see of the surfaces, once for all that see the same.
//!
//! Millions of rays from mesh points end on surfaces that hold a few thousand points' worth of light. Space is cut into cells;
//! the surface that faces about one way in one cell is a patch, and the light that falls on it is found once, at one point of
//! it. The mean over a mesh point's directions and the interpolation over D_y blur that light more than the patch does.
//!
//! The point of a patch follows from cell and normal alone, not from who saw it: so values of mesh points depend on their positions
//! alone, as ever.

use std::collections::HashMap;

use glam::Vec3;
use rayon::prelude::*;

use crate::accel::{Accel, Coherence, LaneMask, PacketLanes, RayHitPacket, RayPacket, hit_of_lane};
use crate::light_mesh::direct_light::DirectLight;
use crate::sampling::{BuildKeyHasher, mix};
use crate::scene::{Ray, Scene, SurfacePoint};
use crate::world::World;

/// Number of a ray's patch where the ray left the scene.
pub const NO_PATCH: u32 = u32::MAX;

/// A cell of space, and about which way a surface in it faces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PatchCell {
    middle: Vec3,
    /// Of the rounded normal, unit length.
    normal: Vec3,
    width: f32,
    key: u64,
}

impl PatchCell {
    /// The cell of a surface point; normals are told apart in quarters of unit length by axis.
    #[inline(always)]
    pub fn of(surface: &SurfacePoint, width: f32) -> Self {
        // Rounded down, as `floor` does for numbers that fit; a call of which costs more than all the rest.
        let down = |number: f32| {
            let whole = number as i32;
            whole.saturating_sub(i32::from(number < whole as f32))
        };
        let cell = (surface.position / width).to_array().map(down);
        let normal = (surface.shading_normal * 4.0 + 0.5).to_array().map(down);
        let pair = |a: i32, b: i32| u64::from(a as u32) | u64::from(b as u32) << 32;
        let numbers = [
            pair(cell[0], cell[1]),
            pair(cell[2], normal[0]),
            pair(normal[1], normal[2]),
            u64::from(width.to_bits()),
        ];
        // A hash: other cells practically never have the same.
        let key = numbers.into_iter().fold(0, |hash, number| mix(hash ^ number));
        let middle = Vec3::from_array(cell.map(|number| number as f32 + 0.5)) * width;
        let normal =
            Vec3::from_array(normal.map(|number| number as f32)).normalize_or(surface.shading_normal);
        Self { middle, normal, width, key }
    }

    /// A cell that holds one surface point only, which stands for so much around it.
    fn of_point(surface: &SurfacePoint, width: f32) -> Self {
        let (middle, normal) = (surface.position, surface.shading_normal);
        let bits = [middle, normal].map(|vector| vector.to_array().map(|number| u64::from(number.to_bits())));
        let key = bits.as_flattened().iter().fold(0, |hash, bits| mix(hash ^ bits));
        Self { middle, normal, width, key }
    }

    /// A point of the surface: the first that one of 16 lines through the cell, along the normal, meets. `None` if none does, or
    /// if it doesn't see a quarter of those that the others meet, and can't stand for them: light would leak under a thin wall.
    ///
    /// Also returns the number of occlusion rays.
    fn surface<A: Accel>(&self, accel: &A, scene: &Scene) -> (Option<SurfacePoint>, u64) {
        const WIDTH: usize = 16;
        /// One in so many points may be hidden.
        const HIDDEN_OF: u32 = 4;
        /// The lines in a square of 4×4, from its middle outwards.
        const ORDER: [usize; WIDTH] = [5, 6, 9, 10, 1, 2, 4, 7, 8, 11, 13, 14, 0, 3, 12, 15];
        let Self { middle, normal, width, .. } = *self;
        let (u, v) = normal.any_orthonormal_pair();
        // Of the cell along the normal, and a little more for surfaces along its sides.
        let depth = 1.01 * width * normal.abs().element_sum();
        let mut packet = RayHitPacket::<WIDTH>::empty();
        for (lane, place) in ORDER.into_iter().enumerate() {
            let at = |place: usize| 0.25 * place as f32 - 0.375;
            let origin = middle + width * (u * at(place % 4) + v * at(place / 4)) + normal * (0.5 * depth);
            packet.set_lane(lane, &Ray { t_far: depth, ..Ray::new(origin, -normal) });
        }
        accel.intersect_packet(u32::from(u16::MAX), &mut packet, Coherence::Coherent);
        let found = |lane: usize| {
            let surface = scene.interaction(&hit_of_lane(&packet, lane)?, -normal).point;
            (Self::of(&surface, width).normal == normal).then_some(surface)
        };
        let mut points = (0..WIDTH).filter_map(found);
        let Some(first) = points.next() else { return (None, 0) };
        let mut between = RayPacket::<WIDTH>::empty();
        let mut active: LaneMask = 0;
        for (lane, other) in points.enumerate() {
            between.set_lane(lane, &Ray::between(first.ray_origin(), other.ray_origin()));
            active |= 1 << lane;
        }
        let blocked = accel.occluded_packet(active, &mut between, Coherence::Incoherent) & active;
        let stands_for_all = blocked.count_ones() * HIDDEN_OF <= active.count_ones();
        (stands_for_all.then_some(first), u64::from(active.count_ones()))
    }
}

/// A list of cells, each of them once.
#[derive(Default)]
pub struct PatchCells {
    /// By number.
    pub cells: Vec<PatchCell>,
    numbers: Numbers,
}

type Numbers = HashMap<u64, u32, BuildKeyHasher>;

impl PatchCells {
    /// The number of a cell, which is added if it is new.
    #[inline(always)]
    pub fn number(&mut self, cell: PatchCell) -> u32 {
        let new = self.cells.len() as u32;
        let number = *self.numbers.entry(cell.key).or_insert(new);
        if number == new {
            self.cells.push(cell);
        }
        number
    }
}

/// The patches that are known.
#[derive(Default)]
pub struct Patches {
    cells: PatchCells,
    /// A point of each patch; `None` where none can stand for it.
    surfaces: Vec<Option<SurfacePoint>>,
    /// What falls on each patch directly: I, times the scale of direct light.
    direct: Vec<Vec3>,
}

impl Patches {
    /// Number of patches.
    pub fn len(&self) -> usize {
        self.surfaces.len()
    }

    /// A point of each patch, from number `first` on.
    pub fn surfaces(&self, first: usize) -> impl Iterator<Item = &SurfacePoint> {
        self.surfaces.iter().skip(first).flatten()
    }

    /// What falls on each patch directly.
    pub fn direct(&self) -> &[Vec3] {
        &self.direct
    }

    /// What `of` makes of the point of each patch for which `which` is true, in parallel.
    pub fn map<T: Send>(&self, which: &[bool], of: impl Fn(&SurfacePoint) -> T + Sync) -> Vec<Option<T>> {
        let one = |(surface, &which): (&Option<SurfacePoint>, _)| surface.as_ref().filter(|_| which).map(&of);
        self.surfaces.par_iter().zip(which).map(one).collect()
    }

    /// The number of a cell's patch, whether it is known or not.
    pub fn number(&mut self, cell: PatchCell) -> u32 {
        self.cells.number(cell)
    }

    /// The number of a patch of which one surface point is known; `width` is what it stands for.
    pub fn number_of_point(&mut self, surface: SurfacePoint, width: f32) -> u32 {
        let number = self.cells.number(PatchCell::of_point(&surface, width));
        if number as usize == self.surfaces.len() {
            self.surfaces.push(Some(surface));
        }
        number
    }

    /// Whether a patch has a point.
    pub fn has_point(&self, number: u32) -> bool {
        self.surfaces.get(number as usize).is_some_and(Option::is_some)
    }

    /// Finds points of the cells that were added since; returns the number of occlusion rays.
    pub fn find_points<A: Accel>(&mut self, world: World<A>) -> u64 {
        let World { accel, scene, .. } = world;
        let new = self.cells.cells[self.surfaces.len()..].par_iter();
        let (surfaces, rays): (Vec<_>, Vec<u64>) = new.map(|cell| cell.surface(accel, scene)).unzip();
        self.surfaces.extend(surfaces);
        rays.iter().sum()
    }

    /// Finds what falls on the patches directly that were added since; returns the number of occlusion rays.
    pub fn find_direct<A: Accel>(&mut self, world: World<A>, scale: f32) -> u64 {
        let World { accel, lights, .. } = world;
        let first = self.direct.len();
        let new = self.cells.cells[first..].par_iter().zip(&self.surfaces[first..]);
        let (light, rays): (Vec<Vec3>, Vec<u64>) = new
            .map_init(DirectLight::default, |direct, (cell, surface)| {
                direct.rays = 0;
                let light =
                    surface.map_or(Vec3::ZERO, |surface| direct.at(accel, lights, &surface, cell.width));
                (light * scale, direct.rays)
            })
            .unzip();
        self.direct.extend(light);
        rays.iter().sum()
    }

    /// Bytes held, without the room that lists keep for more.
    pub fn memory_bytes(&self) -> usize {
        self.cells.cells.len() * size_of::<PatchCell>()
            + self.cells.numbers.len() * size_of::<(u64, u32)>()
            + self.surfaces.len() * size_of::<Option<SurfacePoint>>()
            + self.direct.len() * size_of::<Vec3>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::BruteForceAccel;
    use crate::scene::TriangleMesh;

    fn cell(x: f32, normal: Vec3, width: f32) -> PatchCell {
        PatchCell::of(&SurfacePoint::flat(Vec3::new(x, 0.0, 0.0), normal), width)
    }

    /// Hits share a patch where they are near and face the same way; the two sides of a wall never do.
    #[test]
    fn patches_join_what_is_near_and_faces_the_same_way() {
        let mut cells = PatchCells::default();
        let hits = [(0.1, Vec3::Y), (0.9, Vec3::Y), (0.1, Vec3::NEG_Y), (1.1, Vec3::Y), (-0.1, Vec3::Y)];
        let numbers = hits.map(|(x, normal)| cells.number(cell(x, normal, 1.0)));
        assert_eq!(numbers, [0, 0, 1, 2, 3]);
    }

    /// A floor of 2×2, and if asked a wall across it that has no thickness, at x = 0.5.
    fn floor(wall: bool) -> Scene {
        let square = |corner: Vec3, u: Vec3, v: Vec3| [corner, corner + u, corner + u + v, corner + v];
        let mut corners = square(Vec3::new(-1.0, 0.0, -1.0), 2.0 * Vec3::Z, 2.0 * Vec3::X).to_vec();
        if wall {
            corners.extend(square(Vec3::new(0.5, -1.0, -1.0), 2.0 * Vec3::Y, 2.0 * Vec3::Z));
        }
        let triangles =
            (0..corners.len() as u32).step_by(4).flat_map(|i| [[i, i + 1, i + 2], [i, i + 2, i + 3]]);
        let positions = corners.iter().map(|corner| corner.to_array()).collect();
        let mut scene = Scene::new();
        scene.add(TriangleMesh::new(positions, triangles.collect()));
        scene
    }

    /// A point stands for the surface of its cell, wherever in it a ray ended; but not across a wall, and none does where nothing is.
    #[test]
    fn a_point_stands_for_what_it_sees() {
        let (open, walled) = (floor(false), floor(true));
        let [in_the_open, behind_a_wall] = [&open, &walled].map(|scene| {
            let accel = BruteForceAccel::new(scene);
            [0.1, 0.9].map(|x| cell(x, Vec3::Y, 1.0).surface(&accel, scene).0)
        });
        let point = in_the_open[0].expect("there is a floor");
        assert!(point.position.y == 0.0 && (0.0..=1.0).contains(&point.position.x), "{point:?}");
        assert_eq!(in_the_open[1].map(|other| other.position), Some(point.position));
        assert!(behind_a_wall.iter().all(Option::is_none), "{behind_a_wall:?}");
        let accel = BruteForceAccel::new(&open);
        assert!(cell(5.0, Vec3::Y, 1.0).surface(&accel, &open).0.is_none());
    }

    /// Far away cells are too many to count, and nothing panics.
    #[test]
    fn far_hits_have_patches() {
        assert_ne!(cell(1e30, Vec3::Y, 1e-9), cell(-1e30, Vec3::Y, 1e-9));
    }
}
