//! The convex hull of points in the plane.

use glam::Vec2;

/// Twice the area by which a corner has to stand out from its neighbours: rounding makes corners of points in a row.
const FLAT: f64 = 1e-6;

/// The numbers of the points that are corners of the convex hull of all, around it (Andrew's monotone chain, 1979).
pub fn convex_hull(points: &[Vec2]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|&a, &b| points[a].x.total_cmp(&points[b].x).then(points[a].y.total_cmp(&points[b].y)));
    let half = |order: &mut dyn Iterator<Item = usize>| {
        let mut corners: Vec<usize> = Vec::new();
        for point in order {
            while let &[.., before, last] = &corners[..] {
                let [from, to, next] = [before, last, point].map(|index| points[index].as_dvec2());
                if (to - from).perp_dot(next - from) > FLAT {
                    break;
                }
                corners.pop();
            }
            corners.push(point);
        }
        // The last is the first of the other half.
        corners.pop();
        corners
    };
    let mut hull = half(&mut order.iter().copied());
    hull.extend(half(&mut order.iter().rev().copied()));
    if hull.is_empty() { order } else { hull }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of a square with points on its sides and inside, the corners are left.
    #[test]
    fn the_hull_of_a_grid_is_its_corners() {
        let grid: Vec<Vec2> = (0..25).map(|n| Vec2::new((n % 5) as f32, (n / 5) as f32)).collect();
        let mut hull = convex_hull(&grid);
        hull.sort_unstable();
        assert_eq!(hull, [0, 4, 20, 24]);
    }

    /// One point is its own hull, and of none there is none.
    #[test]
    fn few_points_are_their_own_hull() {
        assert_eq!(convex_hull(&[]), [0usize; 0]);
        assert_eq!(convex_hull(&[Vec2::ONE]), [0]);
        assert_eq!(convex_hull(&[Vec2::ONE, Vec2::ZERO]), [1, 0]);
    }
}
