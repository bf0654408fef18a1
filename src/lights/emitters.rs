//! Emissive triangles as lights: clusters of pieces of them, small and facing one way, so that each is nearly what a small flat lamp is
//! (method §4).

use std::collections::BinaryHeap;
use std::collections::binary_heap::PeekMut;
use std::f32::consts::PI;
use std::sync::Arc;

use glam::{Vec2, Vec3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::Bounds;
use crate::scene::{Hit, Scene};

/// Clusters that a scene has at least, if it has so many pieces, and at most.
const EMITTERS: std::ops::Range<usize> = 16..256;
/// Pieces that its triangles may be cut into beyond their own number.
const MOST_CUTS: usize = 4096;
/// Power times size of a cluster that is not divided further, over the power of all and the diagonal of the scene.
const FINE: f32 = 1.0 / 512.0;

/// A part of an emissive triangle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Piece {
    /// A corner, and the ways from it to the other two.
    corner: Vec3,
    edges: [Vec3; 2],
    /// Share of the cluster's power in this piece and those before it.
    pub up_to: f32,
}

impl Piece {
    /// A point of the piece, evenly distributed if the numbers are, of [0, 1).
    #[inline(always)]
    pub fn point(&self, numbers: Vec2) -> Vec3 {
        let root = numbers.x.sqrt();
        self.corner + self.edges[0] * (1.0 - root) + self.edges[1] * (numbers.y * root)
    }
}

/// Pieces of emissive triangles that stand for a small flat lamp: radiant intensity I · cos in each direction at an angle from its axis, 0 beyond
/// 90°.
#[derive(Clone, Debug)]
pub struct Emitter {
    /// Mean of its points, weighted by power.
    pub position: Vec3,
    /// Where it shines, of unit length.
    pub axis: Vec3,
    /// I, radiance times area, linear RGB.
    pub intensity: Vec3,
    /// Area over π, the square of the radius of a disc of its size.
    pub radius_squared: f32,
    /// What it is made of.
    pub pieces: Arc<[Piece]>,
}

/// A piece that is not in a cluster yet.
#[derive(Clone)]
struct LoosePiece {
    instance: u32,
    triangle: u32,
    /// Barycentric coordinates of the corners.
    barycentric: [Vec2; 3],
    corners: [Vec3; 3],
    /// Of the side that emits, of unit length.
    normal: Vec3,
    area: f32,
    radiance: Vec3,
}

impl LoosePiece {
    fn power(&self) -> f32 {
        self.area * self.radiance.element_sum()
    }

    fn middle(&self) -> Vec3 {
        self.corners.iter().sum::<Vec3>() / 3.0
    }

    /// The longest edge's number, and its squared length.
    fn longest(&self) -> (usize, f32) {
        let length = |i: usize| self.corners[i].distance_squared(self.corners[(i + 1) % 3]);
        (0..3).map(|i| (i, length(i))).fold((0, -1.0), |best, edge| if edge.1 > best.1 { edge } else { best })
    }

    /// The halves on both sides of the middle of the longest edge.
    fn halves(&self) -> [Self; 2] {
        let (first, _) = self.longest();
        let second = (first + 1) % 3;
        let half = |end: usize| {
            let mut half = self.clone();
            half.area *= 0.5;
            half.corners[end] = 0.5 * (self.corners[first] + self.corners[second]);
            half.barycentric[end] = 0.5 * (self.barycentric[first] + self.barycentric[second]);
            half
        };
        [half(first), half(second)]
    }

    /// Finds out the mean radiance, from a few points.
    fn look(&mut self, scene: &Scene) {
        let points = [[0.6, 0.2, 0.2], [0.2, 0.6, 0.2], [0.2, 0.2, 0.6], [1.0 / 3.0; 3]];
        let [a, b, c] = self.barycentric;
        let mesh = &scene.meshes[scene.instances[self.instance as usize].mesh as usize];
        let radiance = points.map(|[p, q, r]| {
            let at = a * p + b * q + c * r;
            let hit = Hit { t: 1.0, u: at.x, v: at.y, instance: self.instance, triangle: self.triangle };
            let emission = scene.interaction(&hit, -self.normal).emission;
            if scene.is_opaque(mesh, self.triangle, at.x, at.y) && emission.is_finite() {
                emission.max(Vec3::ZERO)
            } else {
                Vec3::ZERO
            }
        });
        self.radiance = radiance.iter().sum::<Vec3>() / points.len() as f32;
    }
}

/// The emissive triangles of a scene, as lights.
pub fn emitters(scene: &Scene) -> Vec<Emitter> {
    let mut pieces = pieces(scene);
    let total: f32 = pieces.iter().map(LoosePiece::power).sum();
    let fine = FINE * total * scene.bounds().extent().length();
    if pieces.is_empty() || !(fine > 0.0 && fine.is_finite()) {
        return Vec::new();
    }
    cut(&mut pieces, scene, |piece| {
        let power = piece.power();
        power * piece.longest().1.sqrt() > 0.5 * fine || power * 4.0 * EMITTERS.start as f32 > total
    });
    // By the main direction in which they shine: the pieces of a cluster have to face one way.
    let side = |piece: &LoosePiece| {
        let axis = piece.normal.abs().max_position();
        2 * axis + usize::from(piece.normal[axis] < 0.0)
    };
    let mut sides: [Vec<LoosePiece>; 6] = Default::default();
    pieces.into_iter().for_each(|piece| sides[side(&piece)].push(piece));
    let mut clusters: BinaryHeap<Cluster> = sides.into_iter().enumerate().filter_map(Cluster::of).collect();
    let mut next = clusters.len();
    while clusters.len() < EMITTERS.end {
        let limit = if clusters.len() < EMITTERS.start { 0.0 } else { fine };
        let Some(largest) = clusters.peek_mut().filter(|c| c.coarseness > limit && c.pieces.len() > 1) else {
            break;
        };
        for half in PeekMut::pop(largest).halves() {
            clusters.extend(Cluster::of((next, half)));
            next += 1;
        }
    }
    clusters.into_sorted_vec().iter().filter_map(Cluster::emitter).collect()
}

/// All emissive triangles, once for each side that emits.
fn pieces(scene: &Scene) -> Vec<LoosePiece> {
    let shines = |material: &crate::scene::Material| material.emission != Vec3::ZERO && !material.lamp;
    if !scene.materials.iter().any(shines) {
        return Vec::new();
    }
    let of_instance = |instance: u32| {
        let placed = &scene.instances[instance as usize];
        let mesh = &scene.meshes[placed.mesh as usize];
        (0..mesh.triangles.len() as u32).into_par_iter().flat_map_iter(move |triangle| {
            let material = &scene.materials[mesh.materials.of(triangle) as usize];
            let sides = if !shines(material) { 0 } else { 1 + usize::from(material.two_sided) };
            let corners = mesh
                .corners(triangle)
                .map(|corner| placed.to_world.map_or(corner, |to_world| to_world.transform_point3(corner)));
            let cross = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
            let mirrored = placed.to_world.is_some_and(|to_world| to_world.matrix3.determinant() < 0.0);
            let front = cross.normalize_or_zero() * if mirrored { -1.0 } else { 1.0 };
            [front, -front].into_iter().take(sides).filter_map(move |normal| {
                let area = 0.5 * cross.length();
                let mut piece = LoosePiece {
                    instance,
                    triangle,
                    barycentric: [Vec2::ZERO, Vec2::X, Vec2::Y],
                    corners,
                    normal,
                    area,
                    radiance: Vec3::ZERO,
                };
                if !(area > 0.0 && area.is_finite()) {
                    return None;
                }
                piece.look(scene);
                let power = piece.power();
                (power > 0.0 && power.is_finite()).then_some(piece)
            })
        })
    };
    (0..scene.instances.len() as u32).into_par_iter().flat_map(of_instance).collect()
}

/// Cuts pieces in halves that are too large, as long as there are few.
fn cut(pieces: &mut Vec<LoosePiece>, scene: &Scene, is_large: impl Fn(&LoosePiece) -> bool) {
    let most = pieces.len() + MOST_CUTS;
    let mut first = 0;
    while first < pieces.len() && pieces.len() < most {
        let piece = &pieces[first];
        if is_large(piece) {
            let [mut left, mut right] = piece.halves();
            left.look(scene);
            right.look(scene);
            pieces[first] = left;
            pieces.push(right);
        } else {
            first += 1;
        }
    }
    pieces.retain(|piece| piece.power() > 0.0);
}

/// Pieces that shine in about one direction.
struct Cluster {
    /// Power times size.
    coarseness: f32,
    /// Different for each: of two that are equally coarse the older one comes first.
    number: usize,
    pieces: Vec<LoosePiece>,
}

impl Cluster {
    fn of((number, pieces): (usize, Vec<LoosePiece>)) -> Option<Self> {
        let mut bounds = Bounds::EMPTY;
        pieces.iter().flat_map(|piece| piece.corners).for_each(|corner| bounds.extend(corner));
        let power: f32 = pieces.iter().map(LoosePiece::power).sum();
        let coarseness = power * bounds.extent().length();
        (!pieces.is_empty()).then_some(Self { coarseness, number, pieces })
    }

    /// The pieces on both sides of the middle along the longest way.
    fn halves(mut self) -> [Vec<LoosePiece>; 2] {
        let mut bounds = Bounds::EMPTY;
        self.pieces.iter().for_each(|piece| bounds.extend(piece.middle()));
        let axis = bounds.extent().max_position();
        self.pieces.sort_by(|a, b| a.middle()[axis].total_cmp(&b.middle()[axis]));
        let power: f32 = self.pieces.iter().map(LoosePiece::power).sum();
        let mut sum = 0.0;
        let half = self.pieces.iter().take_while(|piece| {
            sum += piece.power();
            sum <= 0.5 * power * (1.0 + 1e-4)
        });
        let half = half.count().clamp(1, self.pieces.len() - 1);
        let right = self.pieces.split_off(half);
        [self.pieces, right]
    }

    fn emitter(&self) -> Option<Emitter> {
        let power: f32 = self.pieces.iter().map(LoosePiece::power).sum();
        let position = self.pieces.iter().map(|piece| piece.middle() * (piece.power() / power)).sum();
        let vector: Vec3 = self.pieces.iter().map(|piece| piece.normal * piece.power()).sum();
        let axis = vector.try_normalize()?;
        let facing = |piece: &LoosePiece| piece.area * piece.normal.dot(axis).max(0.0);
        let intensity = self.pieces.iter().map(|piece| piece.radiance * facing(piece)).sum();
        let area: f32 = self.pieces.iter().map(facing).sum();
        let mut sum = 0.0;
        let with_share = |piece: &LoosePiece| {
            sum += piece.power();
            let [corner, b, c] = piece.corners;
            Piece { corner, edges: [b - corner, c - corner], up_to: sum / power }
        };
        let pieces = self.pieces.iter().map(with_share).collect();
        Some(Emitter { position, axis, intensity, radius_squared: area / PI, pieces })
    }
}

impl Ord for Cluster {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.coarseness.total_cmp(&other.coarseness).then(other.number.cmp(&self.number))
    }
}

impl PartialOrd for Cluster {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Cluster {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Cluster {}
