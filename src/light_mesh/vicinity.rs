//! Mesh points around small cubes of space: found once, and weighed for every surface point in the cube.
//!
//! The surface points of a tile lie close together, so that searching for the D_y of each would find the same mesh points
//! again and again. Here a search is made per cube, and a surface point costs one weighing of sixteen points at a time.

use std::ops::Range;

use glam::{IVec3, Vec3};

use super::lanes::{LANES, Lanes};
use super::neighbours::Ball;
use super::store::UNKNOWN;

/// Cubes and groups of candidates that are kept before all are forgotten: some megabytes per thread.
const MOST_CUBES: usize = 1 << 9;
const MOST_GROUPS: usize = 1 << 12;

/// Sixteen mesh points that lie close to a cube.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub struct Group {
    position: [Lanes; 3],
    /// The points' ids.
    pub ids: [u64; LANES],
    /// Their slots, as far as they are known.
    pub slots: [u32; LANES],
    /// Those that were asked for.
    pub needed: u16,
    /// What the points give to a normal, see [`Surroundings::normal`]: RGB, and what they are compared by.
    pub lit: [Lanes; 3],
    /// See above.
    pub amount: Lanes,
}

impl Group {
    /// A group of no points: their places are so far away that they weigh nothing.
    const EMPTY: Self = Self {
        position: [[f32::MAX; LANES]; 3],
        ids: [0; LANES],
        slots: [UNKNOWN; LANES],
        needed: 0,
        lit: [[0.0; LANES]; 3],
        amount: [0.0; LANES],
    };

    /// Ids of the points that were asked for.
    pub fn needed_ids(&self) -> impl Iterator<Item = u64> + '_ {
        (0..LANES).filter(|lane| self.needed >> lane & 1 == 1).map(|lane| self.ids[lane])
    }

    /// Weights of the points in a ball, and the lanes that weigh anything.
    #[inline(always)]
    pub fn weigh(&self, ball: &Ball) -> (Lanes, u16) {
        let [x, y, z] = &self.position;
        let mut weights = [0.0; LANES];
        for lane in 0..LANES {
            let (dy, dz) = (y[lane] - ball.center.y, z[lane] - ball.center.z);
            weights[lane] = ball.weigh(x[lane] - ball.center.x, ball.row(dy, dz));
        }
        (weights, that_count(&weights))
    }
}

/// The lanes whose weight, from 0 to 1, is at least 2⁻⁶³: what is less doesn't count beside any other.
///
/// The second-highest bit of the exponent tells. Bits of their own per lane are folded together half by half: of a
/// comparison, compilers take the sixteen answers out of a mask register one by one, which costs more than the weights.
#[inline(always)]
fn that_count(weights: &Lanes) -> u16 {
    let mut bits = [0u32; LANES];
    for lane in 0..LANES {
        bits[lane] = (weights[lane].to_bits() >> 29 & 1) << lane;
    }
    let mut half = [0; LANES / 2];
    for lane in 0..LANES / 2 {
        half[lane] = bits[lane] | bits[lane + LANES / 2];
    }
    let mut quarter = [0; LANES / 4];
    for lane in 0..LANES / 4 {
        quarter[lane] = half[lane] | half[lane + LANES / 4];
    }
    (quarter[0] | quarter[1] | quarter[2] | quarter[3]) as u16
}

/// A cube of space: the layer of mesh points that holds there, and its place in units of its side.
pub type Cube = (u32, IVec3);

/// The mesh points around a cube.
pub struct Surroundings<'a> {
    /// The points, in a fixed order.
    pub groups: &'a mut [Group],
    /// The normal that the groups' `lit` is for; NaN to begin with.
    pub normal: &'a mut Vec3,
}

/// A cube that was met, its groups, and [`Surroundings::normal`].
struct KnownCube {
    cube: Cube,
    groups: Range<usize>,
    normal: Vec3,
}

/// The cubes that were met, with the mesh points around each.
#[derive(Default)]
pub struct Vicinity {
    cubes: Vec<KnownCube>,
    /// From hashes of cubes to their numbers plus one; a power of two of them, at most half in use.
    table: Vec<u32>,
    groups: Vec<Group>,
    current: usize,
}

impl Vicinity {
    /// The groups around a cube; `surround` calls its argument for each point (id, slot, position) that may be in the
    /// ball of some point of the cube, in a fixed order. Where much is kept already, `forget` hears of all groups
    /// before they are dropped.
    #[inline(always)]
    pub fn around(
        &mut self,
        cube: Cube,
        surround: impl FnOnce(&mut dyn FnMut(u64, u32, Vec3)),
        forget: impl FnMut(&Group),
    ) -> Surroundings<'_> {
        if self.cubes.get(self.current).is_none_or(|known| known.cube != cube) {
            self.turn_to(cube, surround, forget);
        }
        let known = &mut self.cubes[self.current];
        Surroundings { groups: &mut self.groups[known.groups.clone()], normal: &mut known.normal }
    }

    /// All groups.
    pub fn groups(&self) -> &[Group] {
        &self.groups
    }

    #[inline(never)]
    fn turn_to(
        &mut self,
        cube: Cube,
        surround: impl FnOnce(&mut dyn FnMut(u64, u32, Vec3)),
        forget: impl FnMut(&Group),
    ) {
        if self.table.is_empty() {
            self.table.resize(2 * MOST_CUBES, 0);
        }
        if self.cubes.len() >= MOST_CUBES || self.groups.len() >= MOST_GROUPS {
            self.groups.iter().for_each(forget);
            self.groups.clear();
            self.cubes.clear();
            self.table.fill(0);
        }
        let (layer, place) = cube;
        let mixed = [layer as i32, place.x, place.y, place.z].iter().fold(0u64, |hash, &v| {
            (hash ^ u64::from(v as u32)).wrapping_mul(0x9E37_79B9_7F4A_7C15).rotate_left(29)
        });
        let mut at = mixed as usize & (self.table.len() - 1);
        loop {
            match self.table[at] {
                0 => break,
                number if self.cubes[number as usize - 1].cube == cube => {
                    self.current = number as usize - 1;
                    return;
                }
                _ => at = (at + 1) & (self.table.len() - 1),
            }
        }
        let first = self.groups.len();
        let groups = &mut self.groups;
        let mut lane = LANES;
        surround(&mut |id, slot, position| {
            if lane == LANES {
                groups.push(Group::EMPTY);
                lane = 0;
            }
            if let Some(group) = groups.last_mut() {
                (0..3).for_each(|axis| group.position[axis][lane] = position[axis]);
                (group.ids[lane], group.slots[lane]) = (id, slot);
            }
            lane += 1;
        });
        self.cubes.push(KnownCube { cube, groups: first..self.groups.len(), normal: Vec3::NAN });
        self.current = self.cubes.len() - 1;
        self.table[at] = self.cubes.len() as u32;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light_mesh::{MeshPoints, NeededPoints, Neighbours, PointMask};
    use crate::scene::random::SplitMix64;
    use crate::scene::{Bounds, SurfacePoint};
    use crate::settings::{Neighbourhood, PointLayout, PointSettings, Radius, Region, Spacing};

    const BOUNDS: Bounds = Bounds { min: Vec3::new(-3.0, 0.0, 2.0), max: Vec3::new(3.0, 2.5, 6.0) };

    fn surfaces(count: usize, shift: Vec3) -> Vec<SurfacePoint> {
        let mut random = SplitMix64::new(5);
        let surface = |_| {
            let normal = random.in_box(Vec3::NEG_ONE, Vec3::ONE).normalize_or(Vec3::Y);
            SurfacePoint::flat(shift + random.in_box(BOUNDS.min - 0.3, BOUNDS.max + 0.3), normal)
        };
        (0..count).map(surface).collect()
    }

    /// The mesh points found by way of cubes are those that a search for each surface point finds, with the same weights
    /// in the same order, and the slots that the table gives; for every layout, neighbourhood and region, far from the
    /// origin, and with more cubes than are kept.
    #[test]
    fn cubes_give_what_a_search_for_every_point_gives() {
        let list: Vec<_> = (0..300).map(|i| SplitMix64::new(i).in_box(BOUNDS.min, BOUNDS.max)).collect();
        let layouts = [
            PointLayout::Regular,
            PointLayout::BodyCentred,
            PointLayout::Jittered { seed: 3 },
            PointLayout::BlueNoise { seed: 3 },
            PointLayout::List(list.into()),
        ];
        let hoods = [Neighbourhood::SmoothSphere, Neighbourhood::Sphere, Neighbourhood::Nearest];
        for (number, layout) in layouts.into_iter().enumerate() {
            for (neighbourhood, hemisphere) in hoods.into_iter().zip([true, false, true]) {
                let shift = if number == 1 { Vec3::splat(1000.0) } else { Vec3::ZERO };
                let shifted = Bounds { min: BOUNDS.min + shift, max: BOUNDS.max + shift };
                let fine = Region {
                    bounds: Bounds { min: shifted.min, max: shifted.min + 1.5 },
                    spacing: Some(Vec3::splat(0.11)),
                    radius: None,
                };
                let settings = PointSettings {
                    layout: layout.clone(),
                    spacing: Spacing::Units(Vec3::new(0.4, 0.3, 0.35)),
                    radius: Radius::Spacings(1.4),
                    neighbourhood,
                    hemisphere,
                    regions: vec![fine],
                    ..PointSettings::default()
                };
                let mut points = MeshPoints::new(shifted, &settings).expect("a modest grid");
                let surfaces = surfaces(3000, shift);

                let mut needed = NeededPoints::default();
                let mut expected = Neighbours::default();
                for surface in &surfaces {
                    points.neighbours(surface, &mut expected);
                    expected.ids().iter().for_each(|&id| needed.insert(id));
                }
                let expected_mask = PointMask::union(needed.into_bricks());
                let mask = PointMask::union(points.needed(surfaces.iter()));
                assert_eq!(mask, expected_mask, "{layout:?}, {neighbourhood:?}");

                points.claim(&mask);
                let (mut vicinity, mut found) = (Vicinity::default(), Neighbours::default());
                for surface in &surfaces {
                    let fallback = points.known_neighbours(surface, &mut expected);
                    assert_eq!(points.neighbours_within(surface, &mut vicinity, &mut found), fallback);
                    assert_eq!(found.ids(), expected.ids(), "{layout:?}, {neighbourhood:?}");
                    assert_eq!(found.weights(), expected.weights());
                    assert_eq!(found.slots(), expected.slots());
                }
            }
        }
    }

    /// Bit l stands for lane l, whatever the others hold, for every weight that there is.
    #[test]
    fn lanes_with_weight_are_told_apart() {
        for pattern in [0, 1, 0x8000, 0x0180, 0x5a5a, 0xffff, 0x1234] {
            for weight in [1.0, 0.999, 0.5, 1e-3, 1e-9, 2f32.powi(-63)] {
                for nothing in [0.0, 2f32.powi(-65), f32::MIN_POSITIVE] {
                    let weights =
                        std::array::from_fn(|lane| if pattern >> lane & 1 == 1 { weight } else { nothing });
                    assert_eq!(that_count(&weights), pattern, "{weight}");
                }
            }
        }
    }
}
