//! One ray and one triangle in double precision, within the error bound of single precision.

use glam::DVec3;

use super::local_ray::{BOUND, LocalRay};

/// What single precision may add to a product of three lengths by rounding to denormals.
const UNDERFLOW: f64 = 1e-40;

/// Products beyond this may overflow in single precision.
const OVERFLOW: f64 = 1e37;

/// A ray and a triangle that don't miss each other for certain.
pub struct Crossing {
    /// Distance, in units of the direction's length.
    pub t: f64,
    /// By how much a distance in single precision may differ from `t`.
    pub error: f64,
    /// Whether the ray passes so far inside all edges that there is no doubt.
    pub certain: bool,
    /// Whether the ray runs in the triangle's plane within the bound.
    pub in_plane: bool,
    u: f64,
    v: f64,
    /// By how much u and v may be off.
    weight_error: f64,
}

impl Crossing {
    /// The crossing of a ray and a triangle whose `corners` are relative to the ray's origin; `None` where the ray misses
    /// for certain.
    pub fn new(ray: &LocalRay, corners: [DVec3; 3]) -> Option<Self> {
        let (length, along, across) = (ray.length, ray.along, ray.across);
        let reach = corners.iter().map(|corner| corner.length_squared()).fold(0.0, f64::max).sqrt();
        // δ: how far a corner seems moved.
        let moved = BOUND * reach + ray.origin_error + ray.spread() * reach;
        let flat = corners.map(|corner| [corner.dot(across.0), corner.dot(across.1)]);
        let [a, b, c] = corners;
        let sides = [(1, 2), (2, 0), (0, 1)];
        let lengths = sides.map(|(p, q)| (corners[q] - corners[p]).length_squared());
        let longest = lengths.into_iter().fold(0.0, f64::max).sqrt();
        let distances = flat.map(|[x, y]| x * x + y * y);
        let (lengths, distances) = (lengths.map(f64::sqrt), distances.map(f64::sqrt));
        let edges = sides.map(|(p, q)| flat[p][0] * flat[q][1] - flat[p][1] * flat[q][0]);
        let overflow = reach * longest * reach.max(longest) * length.max(1.0) > OVERFLOW;
        let doubts: [f64; 3] = std::array::from_fn(|i| {
            let (p, q) = sides[i];
            // A moved corner turns its edge about the other one.
            let widened = moved * (lengths[i] + distances[p] + distances[q]);
            if overflow { f64::INFINITY } else { widened + UNDERFLOW / length.min(1.0) }
        });
        let sign = |i: usize| {
            if edges[i] > doubts[i] {
                1
            } else if edges[i] < -doubts[i] {
                -1
            } else {
                0
            }
        };
        let signs = [sign(0), sign(1), sign(2)];
        if signs.contains(&1) && signs.contains(&-1) {
            return None;
        }
        let inside = signs == [1; 3] || signs == [-1; 3];

        let normal = (b - a).cross(c - a);
        let area = normal.length();
        let cosine = (normal.dot(along) / area).abs();
        // By how much the normal seems turned: by its own rounding, and by the corners'.
        let tilt = BOUND * longest * longest / area;
        let turned = BOUND + tilt + moved * longest / area;
        // NaN, of a triangle without area, is parallel to everything.
        let crosses = cosine > 2.0 * turned;
        let parallel = !crosses || overflow || area * length < UNDERFLOW / BOUND;
        // Whatever becomes of the division, a hit is about where the triangle is.
        let depths = corners.map(|corner| corner.dot(along) / length);
        let (nearest, farthest) =
            (depths[0].min(depths[1]).min(depths[2]), depths[0].max(depths[1]).max(depths[2]));
        let rough = 0.5 * (farthest - nearest) + (moved + longest) / length;
        let (t, error) = if overflow {
            (0.0, f64::INFINITY)
        } else if parallel {
            (0.5 * (nearest + farthest), rough)
        } else {
            (
                a.dot(normal) / ray.direction.dot(normal),
                (moved + tilt * longest) / (length * (cosine - turned)),
            )
        };
        let weight_error = if parallel { 1.0 } else { turned / (cosine - turned) };
        let total = edges[0] + edges[1] + edges[2];
        // Of a triangle that is seen edge-on it is no number.
        let weight = |part: f64| if part.is_finite() { part } else { 1.0 / 3.0 };
        Some(Self {
            t,
            error,
            certain: inside && !parallel,
            in_plane: parallel,
            u: weight(edges[1] / total),
            v: weight(edges[2] / total),
            weight_error: weight_error.min(1.0),
        })
    }

    /// Barycentric coordinates all around the hit, within the doubt and the triangle.
    pub fn surroundings(&self) -> [(f32, f32); 9] {
        let e = self.weight_error;
        let mut around = [(0.0, 0.0); 9];
        for (slot, (i, j)) in around.iter_mut().zip((-1..=1).flat_map(|i| (-1..=1).map(move |j| (i, j)))) {
            let u = (self.u + f64::from(i) * e).clamp(0.0, 1.0);
            let v = (self.v + f64::from(j) * e).clamp(0.0, 1.0 - u);
            *slot = (u as f32, v as f32);
        }
        around
    }
}
