//! What surface points take from the points of a surface mesh around them.

use glam::{Vec2, Vec3};

use super::points::SurfacePoints;
use crate::accel::{Accel, Coherence, LaneMask, PacketLanes, RayPacket};
use crate::scene::SurfacePoint;

use super::survey::line_between;

/// Radius of the kernel in widths of a cell.
const RADIUS: f32 = 2.0;
/// Cells between a surface point and those of its kernel.
const REACH: i32 = 2;
/// Cosine between normals from which points count.
const ALIKE: f32 = 0.5;
/// Part of the kernel's squared radius that is added to the points' spread, so that few points, or points in a row, don't make a slope of
/// their noise.
const STIFFNESS: f32 = 0.006;

/// How far beyond the points' light that of the plane may lie, as a part of the range of theirs: on a ledge a few points have a steep plane.
const BEYOND: f32 = 0.5;

/// Those of some points around a point that it sees and that face about the same way, itself first. Returns the number of rays.
pub fn neighbours<A: Accel>(
    accel: &A,
    points: &SurfacePoints,
    number: u32,
    counts: impl Fn(u32) -> bool,
    out: &mut Vec<u32>,
) -> u64 {
    const WIDTH: usize = 16;
    let (surface, level) = (points.surface(number), points.level(number));
    let width = points.cells.width(level);
    out.push(number);
    let first = out.len();
    let cell = points.cells.at(level, surface.position);
    let near = |other: &u32| {
        let point = points.surface(*other);
        *other != number
            && counts(*other)
            && point.shading_normal.dot(surface.shading_normal) > ALIKE
            && point.position.distance(surface.position) < (RADIUS + 1.0) * width
    };
    for cell in points.cells.around(cell, surface, REACH) {
        out.extend(points.of_cell(cell).into_iter().flatten().filter(near));
    }
    let mut seen = first;
    let mut rays = 0;
    for begin in (first..out.len()).step_by(WIDTH) {
        let end = (begin + WIDTH).min(out.len());
        let mut packet = RayPacket::<WIDTH>::empty();
        let mut active: LaneMask = 0;
        for (lane, &other) in out[begin..end].iter().enumerate() {
            packet.set_lane(lane, &line_between(surface, points.surface(other), width));
            active |= 1 << lane;
        }
        rays += u64::from(active.count_ones());
        let blocked = accel.occluded_packet(active, &mut packet, Coherence::Incoherent);
        for index in begin..end {
            if blocked >> (index - begin) & 1 == 0 {
                out[seen] = out[index];
                seen += 1;
            }
        }
    }
    out.truncate(seen);
    rays
}

/// Light at a surface point from some points, given by number, that are around the first of them.
#[inline(always)]
pub fn interpolate(points: &SurfacePoints, surface: &SurfacePoint, numbers: &[u32], light: &[Vec3]) -> Vec3 {
    let Some(&own) = numbers.first() else { return Vec3::ZERO };
    let known = |number: u32| (points.surface(number), light[number as usize]);
    fit(surface, RADIUS * points.width(own), numbers.iter().map(|&number| known(number)))
        .unwrap_or(light[own as usize])
}

/// The value at a surface point of the plane that fits the light of points around it best, near ones counting more; `None` if none
/// of them is within the radius and faces about the same way.
#[inline(always)]
fn fit<'s>(
    surface: &SurfacePoint,
    radius: f32,
    points: impl Iterator<Item = (&'s SurfacePoint, Vec3)>,
) -> Option<Vec3> {
    let (normal, scale) = (surface.shading_normal, 1.0 / (radius * radius));
    let (u, v) = normal.any_orthonormal_pair();
    let mut total = 0.0;
    let mut place = Vec2::ZERO;
    let (mut uu, mut uv, mut vv) = (0.0, 0.0, 0.0);
    let (mut sum, mut along_u, mut along_v) = (Vec3::ZERO, Vec3::ZERO, Vec3::ZERO);
    let (mut least, mut most) = (Vec3::INFINITY, Vec3::ZERO);
    for (point, value) in points {
        let way = point.position - surface.position;
        let height = way.dot(normal);
        let near = 1.0 - (way.length_squared() + 8.0 * height * height) * scale;
        let alike = (point.shading_normal.dot(normal) - ALIKE) * (1.0 / (1.0 - ALIKE));
        if near <= 0.0 || alike <= 0.0 {
            continue;
        }
        let weight = near * near * alike * alike;
        let at = Vec2::new(way.dot(u), way.dot(v));
        total += weight;
        place += weight * at;
        uu += weight * at.x * at.x;
        uv += weight * at.x * at.y;
        vv += weight * at.y * at.y;
        sum += weight * value;
        along_u += weight * at.x * value;
        along_v += weight * at.y * value;
        (least, most) = (least.min(value), most.max(value));
    }
    if total <= 1e-6 {
        return None;
    }
    // Covariances about the mean place.
    let share = 1.0 / total;
    let (mean, place) = (sum * share, place * share);
    let stiff = STIFFNESS * radius * radius;
    let uu = uu * share - place.x * place.x + stiff;
    let vv = vv * share - place.y * place.y + stiff;
    let uv = uv * share - place.x * place.y;
    let along_u = along_u * share - place.x * mean;
    let along_v = along_v * share - place.y * mean;
    let determinant = uu * vv - uv * uv;
    let slope_u = (along_u * vv - along_v * uv) / determinant;
    let slope_v = (along_v * uu - along_u * uv) / determinant;
    let beyond = BEYOND * (most - least);
    let value = mean - slope_u * place.x - slope_v * place.y;
    // The order of the bounds holds for any numbers.
    Some(value.max((least - beyond).max(Vec3::ZERO)).min(most + beyond))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points of a lattice of width 1 in the half plane x < 0 of a floor, with the light there.
    fn floor(light: impl Fn(Vec3) -> Vec3) -> Vec<(SurfacePoint, Vec3)> {
        let place = |i: i32| Vec3::new((i % 6) as f32 - 5.5, 0.0, (i / 6) as f32 - 3.0);
        (0..36).map(|i| (SurfacePoint::flat(place(i), Vec3::Y), light(place(i)))).collect()
    }

    fn at(points: &[(SurfacePoint, Vec3)], x: f32) -> Vec3 {
        let surface = SurfacePoint::flat(Vec3::new(x, 0.0, 0.2), Vec3::Y);
        fit(&surface, RADIUS, points.iter().map(|(point, light)| (point, *light))).expect("points are near")
    }

    /// Light that is the same everywhere comes out as it is, inside and at the edge where points are on one side only; light that grows steadily
    /// does but for the tenth of its slope that points in a row are kept from making up.
    #[test]
    fn a_plane_of_light_is_found() {
        let (even, steady) = (floor(|_| Vec3::splat(0.3)), floor(|p| Vec3::splat(8.0 + p.x)));
        for x in [-3.2, -1.0, -0.5, -0.1] {
            assert!(at(&even, x).abs_diff_eq(Vec3::splat(0.3), 1e-5));
            assert!((at(&steady, x).x - 8.0 - x).abs() < 0.12, "{} at {x}", at(&steady, x));
        }
    }

    /// Three points on a narrow ledge, of which one is dark, make no plane that is black a step further on.
    #[test]
    fn few_points_make_no_steep_plane() {
        let light = [0.5, 0.45, 0.2];
        let points: Vec<(SurfacePoint, Vec3)> = (0..3)
            .map(|i| {
                let place = Vec3::new(0.5 * i as f32, 0.0, 0.03 * i as f32);
                (SurfacePoint::flat(place, Vec3::Y), Vec3::splat(light[i]))
            })
            .collect();
        for x in [-1.0, 1.5, 1.9] {
            let found = at(&points, x).x;
            assert!((0.04..=0.66).contains(&found), "{found} at {x}");
        }
    }

    /// The light of a wall beside the floor, and of its underside, doesn't count, and light is never negative.
    #[test]
    fn other_surfaces_do_not_count() {
        let mut points = floor(|p| Vec3::splat((-p.x - 1.0).max(0.0)));
        for normal in [Vec3::NEG_X, Vec3::NEG_Y] {
            points.push((SurfacePoint::flat(Vec3::ZERO, normal), Vec3::splat(100.0)));
        }
        let edge = at(&points, -0.01);
        assert!(edge.cmpge(Vec3::ZERO).all() && edge.x < 0.1, "{edge}");
        let far = SurfacePoint::flat(Vec3::X * 50.0, Vec3::Y);
        assert!(fit(&far, RADIUS, points.iter().map(|(point, light)| (point, *light))).is_none());
    }
}
