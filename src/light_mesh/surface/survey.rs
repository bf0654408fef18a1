//! The surfaces in a cell: where the points of a surface mesh lie.

use glam::Vec3;

use super::cells::{Cell, CellPoint, Cells};
use crate::accel::{Accel, Coherence, LaneMask, PacketLanes, RayHitPacket, RayPacket, hit_of_lane};
use crate::scene::{Ray, Scene, SurfacePoint};

/// Lines through a cell along one axis: a square of 4×4.
const LINES: usize = 16;
/// Surfaces that one line may meet.
const LAYERS: usize = 4;
/// Surfaces that are told apart in a cell.
const MOST_POINTS: usize = 16;
/// Surfaces that face the same way, such as the fronts of the walls on either side of a thin room, or front and back of a wall made of two, are
/// told apart by their planes where those are so many widths apart.
const LAYER: f32 = 0.1;
/// Cosine between normals of one surface.
const SAME_WAY: f32 = 0.8;
/// Fewer than one in so many points of a surface may be hidden from the one that stands for it.
const HIDDEN_OF: u32 = 16;
/// Times that a surface may be divided by walls.
const MOST_DIVISIONS: usize = 4;

/// How far above surfaces the lines run that tell whether two points see each other, in widths of a cell: so far that a surface which
/// bends doesn't hide its own points.
const LIFT: f32 = 0.08;

/// The line between two surface points, a little above both.
#[inline(always)]
pub fn line_between(a: &SurfacePoint, b: &SurfacePoint, width: f32) -> Ray {
    let above =
        |point: &SurfacePoint| point.position + point.geometric_normal * (point.offset + LIFT * width);
    Ray::between(above(a), above(b))
}

/// Finds the surfaces in a cell, each by a point in its middle: both sides of whatever lines through the cell along the three axes
/// meet. Points belong together if they face about the same way and see each other: light would leak under a thin wall.
///
/// Also returns the number of rays.
pub fn survey<A: Accel>(accel: &A, scene: &Scene, cells: &Cells, cell: Cell) -> (Vec<CellPoint>, u64) {
    let (width, corner) = (cells.width(cell.level), cells.corner(cell));
    let (mut surfaces, mut rays): (Vec<Vec<SurfacePoint>>, u64) = (Vec::new(), 0);
    for axis in 0..3 {
        let along = Vec3::AXES[axis];
        let across = [Vec3::AXES[(axis + 1) % 3], Vec3::AXES[(axis + 2) % 3]];
        let origin = |line: usize| {
            let place = |number: usize| (number as f32 + 0.5) / 4.0 * width;
            corner + across[0] * place(line % 4) + across[1] * place(line / 4)
        };
        let mut from = [0.0f32; LINES];
        let mut active: LaneMask = (1 << LINES) - 1;
        for _ in 0..LAYERS {
            let mut packet = RayHitPacket::<LINES>::empty();
            for (line, &t_near) in from.iter().enumerate() {
                packet.set_lane(line, &Ray { t_near, t_far: width, ..Ray::new(origin(line), along) });
            }
            rays += u64::from(active.count_ones());
            accel.intersect_packet(active, &mut packet, Coherence::Coherent);
            for (line, from) in from.iter_mut().enumerate() {
                let hit = if active >> line & 1 == 1 { hit_of_lane(&packet, line) } else { None };
                let Some(hit) = hit else {
                    active &= !(1 << line);
                    continue;
                };
                for direction in [along, -along] {
                    let point = scene.interaction(&hit, direction).point;
                    *from = hit.t + 2.0 * point.offset + 1e-3 * width;
                    let alike = |surface: &Vec<SurfacePoint>| {
                        surface[0].shading_normal.dot(point.shading_normal) > SAME_WAY
                    };
                    match surfaces.iter().position(alike) {
                        Some(number) => surfaces[number].push(point),
                        None if surfaces.len() < MOST_POINTS => surfaces.push(vec![point]),
                        None => {}
                    }
                }
            }
            if active == 0 {
                break;
            }
        }
    }
    let all: Vec<SurfacePoint> = surfaces.iter().flatten().copied().collect();
    let mut points = Vec::with_capacity(surfaces.len());
    for surface in surfaces {
        rays += divide(accel, surface, width, &mut points);
    }
    for point in &mut points {
        point.divided |= all.iter().any(|other| stands_on(other, &point.surface, width));
    }
    (points, rays)
}

/// Whether a surface point belongs to something that rises above another one: a sliver of floor beside a block, which no line may have met, is
/// not for the point below the block to stand for.
fn stands_on(other: &SurfacePoint, point: &SurfacePoint, width: f32) -> bool {
    let height = (other.position - point.position).dot(point.geometric_normal);
    height > LAYER * width && other.geometric_normal.dot(point.geometric_normal).abs() < SAME_WAY
}

/// Takes those of some points away that have something close above them, lower than the lines between points run, unless all do: what
/// lies under a rug is seen by nothing, and would pass for a part of the rug. Returns the number of rays.
fn uncover<A: Accel>(accel: &A, points: &mut Vec<SurfacePoint>, width: f32) -> u64 {
    let mut open = Vec::with_capacity(points.len());
    for points in points.chunks(LINES) {
        let mut packet = RayPacket::<LINES>::empty();
        for (lane, point) in points.iter().enumerate() {
            let way = point.geometric_normal * (LIFT * width);
            packet.set_lane(lane, &Ray { t_far: 1.0, ..Ray::new(point.ray_origin(), way) });
        }
        let active: LaneMask = (1 << points.len()) - 1;
        let blocked = accel.occluded_packet(active, &mut packet, Coherence::Coherent);
        open.extend(
            points.iter().enumerate().filter(|(lane, _)| blocked >> lane & 1 == 0).map(|(_, point)| *point),
        );
    }
    let rays = points.len() as u64;
    if !open.is_empty() {
        *points = open;
    }
    rays
}

/// Adds points for one surface, several if they don't see each other; returns the number of rays.
fn divide<A: Accel>(accel: &A, surface: Vec<SurfacePoint>, width: f32, out: &mut Vec<CellPoint>) -> u64 {
    let mut groups: Vec<Vec<SurfacePoint>> = Vec::new();
    let mut left = surface;
    let mut rays = uncover(accel, &mut left, width);
    while !left.is_empty() && groups.len() < MOST_DIVISIONS {
        let middle = left.iter().map(|point| point.position).sum::<Vec3>() / left.len() as f32;
        let distance = |point: &SurfacePoint| point.position.distance_squared(middle);
        let best = (0..left.len()).min_by(|&a, &b| distance(&left[a]).total_cmp(&distance(&left[b])));
        let best = left[best.unwrap_or_default()];
        // The point that stands for the group comes first, and once more among its members.
        let mut group = vec![best];
        let mut hidden = Vec::new();
        for points in left.chunks(LINES) {
            let mut packet = RayPacket::<LINES>::empty();
            for (lane, point) in points.iter().enumerate() {
                packet.set_lane(lane, &line_between(&best, point, width));
            }
            // A point sees itself.
            let other = |lane: &usize| points[*lane] != best;
            let active: LaneMask = (0..points.len()).filter(other).fold(0, |mask, lane| mask | 1 << lane);
            rays += u64::from(active.count_ones());
            let blocked = accel.occluded_packet(active, &mut packet, Coherence::Incoherent) & active;
            for (lane, point) in points.iter().enumerate() {
                if blocked >> lane & 1 == 1 { hidden.push(*point) } else { group.push(*point) }
            }
        }
        groups.push(group);
        if (hidden.len() as u32) * HIDDEN_OF < left.len() as u32 {
            break;
        }
        left = hidden;
    }
    for (number, group) in groups.iter().enumerate() {
        let others = groups.iter().enumerate().filter(|(other, _)| *other != number);
        let (point, members) = (group[0], &group[1..]);
        let divided = others.into_iter().any(|(_, other)| {
            let near = |point: &SurfacePoint, other: &SurfacePoint| {
                (other.position - point.position).dot(point.shading_normal).abs() < LAYER * width
            };
            other.iter().any(|other| near(&point, other)) || group.iter().any(|point| near(&other[0], point))
        });
        // Lines run row by row: steps of a quarter and one spread over rows and columns.
        let spread = [0, 1, 2, 3].map(|k| members[k * (members.len() + 4) / 4 % members.len()].position);
        out.push(CellPoint { spread, divided, ..CellPoint::alone(&point) });
    }
    rays
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::BruteForceAccel;
    use crate::scene::TriangleMesh;

    /// Parallelograms, each given by its middle and half of its edges.
    fn scene(parts: &[(Vec3, Vec3, Vec3)]) -> Scene {
        let corners = |&(middle, u, v): &(Vec3, Vec3, Vec3)| {
            [middle - u - v, middle + u - v, middle + u + v, middle - u + v].map(|corner| corner.to_array())
        };
        let positions = parts.iter().flat_map(corners).collect();
        let triangles =
            (0..parts.len() as u32).flat_map(|i| [[0, 1, 2], [0, 2, 3]].map(|t| t.map(|c| 4 * i + c)));
        let mut scene = Scene::new();
        scene.add(TriangleMesh::new(positions, triangles.collect()));
        scene
    }

    fn cells() -> Cells {
        Cells::new(1.0)
    }

    /// The points of the cell around the origin.
    fn points(parts: &[(Vec3, Vec3, Vec3)]) -> Vec<CellPoint> {
        let scene = scene(parts);
        survey(&BruteForceAccel::new(&scene), &scene, &cells(), cells().at(0, Vec3::ZERO)).0
    }

    const FLOOR: (Vec3, Vec3, Vec3) = (Vec3::ZERO, Vec3::new(3.0, 0.0, 0.0), Vec3::new(0.0, 0.0, 3.0));

    /// The middle of the cell around the origin, which is not a corner of cells.
    fn middle() -> Vec3 {
        cells().corner(cells().at(0, Vec3::ZERO)) + 0.5
    }

    /// A wall of no thickness across the cell, that stands on the floor.
    fn wall() -> (Vec3, Vec3, Vec3) {
        (Vec3::new(middle().x, 0.0, 0.0), 3.0 * Vec3::Y, 3.0 * Vec3::Z)
    }

    #[test]
    fn an_empty_cell_has_no_points() {
        assert!(points(&[(Vec3::splat(5.0), Vec3::X, Vec3::Z)]).is_empty());
    }

    /// What lies under a rug is not seen, and no point stands for it: that which faces up lies on the rug, however thin that is.
    #[test]
    fn what_lies_under_a_rug_has_no_point() {
        for height in [0.01, 0.05, 0.2] {
            let rug = (FLOOR.0 + Vec3::new(middle().x, height, middle().z), Vec3::X, Vec3::Z);
            let points = points(&[FLOOR, rug]);
            let up: Vec<f32> = points
                .iter()
                .filter(|point| point.surface.shading_normal.y > 0.5)
                .map(|point| point.surface.position.y)
                .collect();
            assert!(up.contains(&height), "{up:?} at {height}");
            assert!(height > LIFT || up.len() == 1, "{up:?} at {height}");
        }
    }

    /// Both sides of a floor have a point near the middle of the cell, and there is nothing to ask about.
    #[test]
    fn a_floor_has_a_point_on_either_side() {
        let points = points(&[FLOOR]);
        assert_eq!(points.len(), 2);
        for (point, side) in points.iter().zip([1.0, -1.0]) {
            let offset = (point.surface.position - middle()) * Vec3::new(1.0, 0.0, 1.0);
            assert!(offset.abs().max_element() <= 0.25, "{offset}");
            assert!(!point.divided);
            assert!(points.iter().any(|point| point.surface.shading_normal == side * Vec3::Y));
        }
    }

    /// A wall divides the floor: each side of it has a point of its own, which surface points have to ask whether they see it.
    #[test]
    fn a_wall_divides_the_floor() {
        let points = points(&[FLOOR, wall()]);
        let upper: Vec<&CellPoint> =
            points.iter().filter(|point| point.surface.shading_normal == Vec3::Y).collect();
        let sides: Vec<f32> =
            upper.iter().map(|point| (point.surface.position.x - middle().x).signum()).collect();
        assert!(sides.contains(&1.0) && sides.contains(&-1.0), "{sides:?}");
        assert!(upper.iter().all(|point| point.divided));
    }

    /// A block covers all of the floor that lines meet: what else there is of the floor has to ask.
    #[test]
    fn a_sliver_beside_a_block_asks() {
        let side = (Vec3::new(middle().x + 0.4, 0.3, 0.0), 0.3 * Vec3::Y, 3.0 * Vec3::Z);
        let points = points(&[FLOOR, side]);
        let mut upper = points.iter().filter(|point| point.surface.shading_normal == Vec3::Y);
        assert!(upper.all(|point| point.divided));
        let below = points.iter().find(|point| point.surface.shading_normal == Vec3::NEG_Y);
        assert!(below.is_some_and(|point| !point.divided), "nothing stands on the underside");
    }

    /// Two floors above each other need no question: the plane tells.
    #[test]
    fn storeys_are_told_apart_by_their_planes() {
        let upper = (Vec3::Y * 0.2, FLOOR.1, FLOOR.2);
        let points = points(&[FLOOR, upper]);
        assert_eq!(points.len(), 4);
        assert!(points.iter().all(|point| !point.divided));
    }
}
