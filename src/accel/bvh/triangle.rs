//! Watertight ray-triangle test of Woop, Benthin and Wald (2013), one ray against many triangles or
//! many rays against one.
//!
//! The products of an edge function are rounded separately, never fused: then the function of an
//! edge and that of the same edge in its other triangle are exact negatives, and no ray slips
//! between. Where one comes out as 0, or overflows, the lane is computed again in double precision, in
//! which products of two floats are exact.

use super::lanes::{Lanes, map3};

/// Edge functions of a set of ray-triangle pairs.
pub struct EdgeTest<F> {
    /// Corners in the sheared space of the ray: `sheared[corner]` is x, y and unscaled z.
    sheared: [[F; 3]; 3],
    /// U, V, W.
    edges: [F; 3],
    /// Lanes that may hit. Lanes with NaN are among them.
    pub candidates: u32,
}

/// A hit of one lane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LaneHit {
    pub t: f32,
    pub u: f32,
    pub v: f32,
}

/// Hits that the single-precision test settles, and lanes that need [`EdgeTest::exact`].
pub struct Distances<const W: usize> {
    pub t: [f32; W],
    edges: [[f32; W]; 3],
    determinant: [f32; W],
    /// Lanes that hit within the interval.
    pub hits: u32,
    /// Lanes that are undecided.
    pub undecided: u32,
}

impl<const W: usize> Distances<W> {
    /// The hit of one of the lanes of `hits`.
    #[inline(always)]
    pub fn hit(&self, lane: usize) -> LaneHit {
        let determinant = self.determinant[lane];
        LaneHit {
            t: self.t[lane],
            u: self.edges[1][lane] / determinant,
            v: self.edges[2][lane] / determinant,
        }
    }
}

/// Edge function of the edge between two sheared corners.
#[inline(always)]
fn edge<S: Lanes<W>, const W: usize>(simd: S, p: [S::F; 3], q: [S::F; 3]) -> S::F {
    simd.sub(simd.mul(p[0], q[1]), simd.mul(p[1], q[0]))
}

/// Tests edges. `corners[c]` and `origin` are components along kx, ky and kz of the rays.
#[inline(always)]
pub fn test_edges<S: Lanes<W>, const W: usize>(
    simd: S,
    corners: [[S::F; 3]; 3],
    origin: [S::F; 3],
    shear: [S::F; 3],
) -> EdgeTest<S::F> {
    let [ox, oy, oz] = origin;
    let [shear_x, shear_y, _] = shear;
    let sheared = map3(
        corners,
        #[inline(always)]
        |[x, y, z]| {
            let z = simd.sub(z, oz);
            [
                simd.sub(simd.sub(x, ox), simd.mul(shear_x, z)),
                simd.sub(simd.sub(y, oy), simd.mul(shear_y, z)),
                z,
            ]
        },
    );
    let [a, b, c] = sheared;
    let edges = [edge::<S, W>(simd, c, b), edge(simd, a, c), edge(simd, b, a)];
    let [u, v, w] = edges;
    let zero = simd.splat(0.0);
    let least = simd.min(simd.min(u, v), w);
    let most = simd.max(simd.max(u, v), w);
    let candidates = !(simd.lt(least, zero) & simd.lt(zero, most));
    EdgeTest { sheared, edges, candidates }
}

impl<F: Copy> EdgeTest<F> {
    /// Distances of candidate lanes; `lanes` are those that hold a pair at all.
    #[inline(always)]
    pub fn distances<S: Lanes<W, F = F>, const W: usize>(
        &self,
        simd: S,
        lanes: u32,
        shear_z: F,
        t_near: F,
        t_far: F,
    ) -> Distances<W> {
        let [u, v, w] = self.edges;
        let [a, b, c] = map3(
            self.sheared,
            #[inline(always)]
            |p| simd.mul(shear_z, p[2]),
        );
        let determinant = simd.add(simd.add(u, v), w);
        let scaled = simd.add(simd.add(simd.mul(u, a), simd.mul(v, b)), simd.mul(w, c));
        let t = simd.div(scaled, determinant);
        let zero = simd.splat(0.0);
        // x − x is 0 exactly where x is finite.
        let finite = simd.eq(simd.sub(determinant, determinant), simd.sub(scaled, scaled));
        let on_edge = simd.eq(u, zero) | simd.eq(v, zero) | simd.eq(w, zero);
        let candidates = self.candidates & lanes;
        let undecided = candidates & (on_edge | !finite);
        let inside = simd.le(t_near, t) & simd.le(t, t_far);
        Distances {
            t: simd.store(t),
            edges: map3(
                self.edges,
                #[inline(always)]
                |e| simd.store(e),
            ),
            determinant: simd.store(determinant),
            hits: candidates & !undecided & inside,
            undecided,
        }
    }

    /// The hit of a lane that [`EdgeTest::distances`] found to hit, or left undecided: then of the test in double
    /// precision, if that hits.
    #[inline(always)]
    pub fn decide<S: Lanes<W, F = F>, const W: usize>(
        &self,
        simd: S,
        distances: &Distances<W>,
        lane: usize,
        shear_z: f32,
        [t_near, t_far]: [f32; 2],
    ) -> Option<LaneHit> {
        if distances.undecided >> lane & 1 != 0 {
            self.exact(simd, lane, shear_z, t_near, t_far)
        } else {
            Some(distances.hit(lane))
        }
    }

    /// The test of one lane in double precision.
    #[inline(always)]
    pub fn exact<S: Lanes<W, F = F>, const W: usize>(
        &self,
        simd: S,
        lane: usize,
        shear_z: f32,
        t_near: f32,
        t_far: f32,
    ) -> Option<LaneHit> {
        let corners = map3(
            self.sheared,
            #[inline(always)]
            |p| {
                map3(
                    p,
                    #[inline(always)]
                    |f| simd.store(f)[lane],
                )
            },
        );
        exact_hit(corners, shear_z, t_near, t_far)
    }
}

/// Edge functions, distance and interval in double precision, from sheared corners.
#[cold]
#[inline(never)]
fn exact_hit(corners: [[f32; 3]; 3], shear_z: f32, t_near: f32, t_far: f32) -> Option<LaneHit> {
    let [a, b, c] = corners.map(|p| p.map(f64::from));
    let edge = |p: [f64; 3], q: [f64; 3]| p[0] * q[1] - p[1] * q[0];
    let (u, v, w) = (edge(c, b), edge(a, c), edge(b, a));
    if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
        return None;
    }
    let determinant = u + v + w;
    let t = f64::from(shear_z) * (u * a[2] + v * b[2] + w * c[2]) / determinant;
    // NaN fails both: a triangle seen edge-on or of no area, or an overflow.
    let t = t as f32;
    (determinant != 0.0 && t_near <= t && t <= t_far).then(|| LaneHit {
        t,
        u: (v / determinant) as f32,
        v: (w / determinant) as f32,
    })
}
