//! Polygons to triangles, concave ones rightly.

use earcut::Earcut;
use glam::{DVec2, DVec3};

/// Splits polygons into triangles; keeps its buffers from one polygon to the next.
#[derive(Default)]
pub struct Triangulator {
    earcut: Option<Earcut<f64>>,
    flat: Vec<DVec2>,
    indices: Vec<u32>,
}

impl Triangulator {
    /// Calls `emit` with the corners' numbers of every triangle, in the polygon's winding.
    ///
    /// A fan is taken where it covers the polygon without overlap (every convex polygon), else ears
    /// are clipped in the plane that the polygon's area vector is normal to.
    pub fn split(&mut self, corners: &[[f32; 3]], mut emit: impl FnMut([usize; 3])) {
        let count = corners.len();
        if count == 3 {
            return emit([0, 1, 2]);
        }
        self.project(corners);
        let fan =
            |from: usize| (1..count - 1).map(move |i| [from, (from + i) % count, (from + i + 1) % count]);
        let covers = |from: usize| fan(from).all(|triangle| area(&self.flat, triangle) >= 0.0);
        if count < 3 || covers(0) {
            return fan(0).for_each(emit);
        }
        if count == 4 {
            // A quad that neither diagonal divides crosses itself; any choice is as good.
            return fan(usize::from(covers(1))).for_each(emit);
        }
        let earcut = self.earcut.get_or_insert_with(Earcut::new);
        let points = self.flat.iter().map(|p| p.to_array());
        earcut.earcut(points, &[], &mut self.indices);
        if self.indices.is_empty() {
            return fan(0).for_each(emit);
        }
        for ear in self.indices.chunks_exact(3) {
            let triangle = [ear[0] as usize, ear[1] as usize, ear[2] as usize];
            let [a, b, c] = triangle;
            emit(if area(&self.flat, triangle) < 0.0 { [a, c, b] } else { triangle });
        }
    }

    /// Corners in a plane in which the polygon runs counter-clockwise.
    fn project(&mut self, corners: &[[f32; 3]]) {
        let points = || corners.iter().map(|&[x, y, z]| DVec3::new(f64::from(x), f64::from(y), f64::from(z)));
        self.flat.clear();
        let Some(origin) = points().next() else { return };
        // Newell's area vector, from the first corner so that far polygons lose no digits.
        let mut normal = DVec3::ZERO;
        for (a, b) in points().zip(points().skip(1)) {
            normal += (a - origin).cross(b - origin);
        }
        let u = normal.try_normalize().unwrap_or(DVec3::Z).any_orthonormal_vector();
        let v = normal.try_normalize().unwrap_or(DVec3::Z).cross(u);
        self.flat.extend(points().map(|p| DVec2::new((p - origin).dot(u), (p - origin).dot(v))));
    }
}

/// Twice the signed area.
fn area(flat: &[DVec2], [a, b, c]: [usize; 3]) -> f64 {
    (flat[b] - flat[a]).perp_dot(flat[c] - flat[a])
}

/// Whether a triangle has exactly no area: no ray can be said to hit it, and it has no normal.
pub fn has_no_area([a, b, c]: [[f32; 3]; 3]) -> bool {
    let point = |p: [f32; 3]| DVec3::from_array(p.map(f64::from));
    let (a, b, c) = (point(a), point(b), point(c));
    (b - a).cross(c - a) == DVec3::ZERO
}
