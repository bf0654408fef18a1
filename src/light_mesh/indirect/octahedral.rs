//! Irradiance tabulated by normal: what indirect mesh points keep in their directional form (method §5).
//!
//! The normals are the vertices of an octahedron whose faces are divided into triangles, laid out as a square by the
//! octahedral map (Cigolle et al., "A survey of efficient representations for independent unit vectors", 2014). Between
//! three of them irradiance is interpolated so that light that is constant or linear in the direction comes out exactly,
//! and so does every normal along an axis. Second-order spherical harmonics, which the direct mesh uses for many lights,
//! would be off by a tenth of the light of a single lamp.

use glam::Vec3;
use pulp::NullaryFnOnce;

use crate::simd::vectorize;

/// Edges that each edge of the octahedron is divided into.
const DIVISIONS: usize = 4;

/// Nodes along an edge of the square.
const SIDE: usize = 2 * DIVISIONS + 1;

/// Nodes of the square; those on its border appear twice.
const NODES: usize = SIDE * SIDE;

/// Numbers of RGB per mesh point: the mean over all normals, then the nodes.
pub const ENTRIES: usize = 1 + NODES;

/// Nodes, padded to whole vector registers.
const PADDED: usize = NODES.next_multiple_of(16);

/// Point of the octahedron |x| + |y| + |z| = 1 at a node.
fn octahedron_node(column: usize, row: usize) -> Vec3 {
    let x = column as f32 / DIVISIONS as f32 - 1.0;
    let y = row as f32 / DIVISIONS as f32 - 1.0;
    let z = 1.0 - x.abs() - y.abs();
    if z >= 0.0 {
        Vec3::new(x, y, z)
    } else {
        Vec3::new((1.0 - y.abs()).copysign(x), (1.0 - x.abs()).copysign(y), z)
    }
}

/// Sums of light over directions, for every node.
#[derive(Clone)]
pub struct IrradianceSums {
    /// Unit normals by axis.
    normals: [[f32; PADDED]; 3],
    sums: [[f32; PADDED]; 3],
    total: Vec3,
}

impl Default for IrradianceSums {
    fn default() -> Self {
        let mut normals = [[0.0; PADDED]; 3];
        for node in 0..NODES {
            let normal = octahedron_node(node % SIDE, node / SIDE).normalize();
            (0..3).for_each(|axis| normals[axis][node] = normal[axis]);
        }
        Self { normals, sums: [[0.0; PADDED]; 3], total: Vec3::ZERO }
    }
}

impl IrradianceSums {
    /// Forgets all light.
    pub fn clear(&mut self) {
        self.sums = [[0.0; PADDED]; 3];
        self.total = Vec3::ZERO;
    }

    /// Adds light from a direction (unit length); `by_normal` for more than the total.
    #[inline(always)]
    pub fn add(&mut self, direction: Vec3, light: Vec3, by_normal: bool) {
        self.total += light;
        // Later bounces bring no light from most directions into most corners.
        if by_normal && light != Vec3::ZERO {
            vectorize(AddByNormal { normals: &self.normals, sums: &mut self.sums, direction, light });
        }
    }

    /// Writes the means over `directions` directions: the mean of the light, then, if `values` has room for them, for each
    /// node irradiance over π, which is 4 times the mean of light times cosine.
    pub fn write_means(&self, directions: f32, values: &mut [[f32; 3]]) {
        let Some((mean, nodes)) = values.split_first_mut() else { return };
        *mean = (self.total / directions).to_array();
        let scale = 4.0 / directions;
        for (node, value) in nodes.iter_mut().enumerate().take(NODES) {
            *value = [0, 1, 2].map(|channel| self.sums[channel][node] * scale);
        }
    }
}

/// Light from one direction for every node, as work for the best instruction set.
struct AddByNormal<'a> {
    normals: &'a [[f32; PADDED]; 3],
    sums: &'a mut [[f32; PADDED]; 3],
    direction: Vec3,
    light: Vec3,
}

impl NullaryFnOnce for AddByNormal<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { normals: [nx, ny, nz], sums: [r, g, b], direction, light } = self;
        for node in 0..PADDED {
            let cosine = nx[node] * direction.x + ny[node] * direction.y + nz[node] * direction.z;
            let lobe = if cosine > 0.0 { cosine } else { 0.0 };
            r[node] += lobe * light.x;
            g[node] += lobe * light.y;
            b[node] += lobe * light.z;
        }
    }
}

/// How irradiance for a normal follows from a mesh point's entries.
#[derive(Clone, Copy, Debug)]
pub struct OctahedralWeights {
    entries: [usize; 3],
    weights: [f32; 3],
    /// Weight of the mean.
    rest: f32,
}

impl OctahedralWeights {
    /// Weights for a normal (unit length).
    #[inline(always)]
    pub fn of(normal: Vec3) -> Self {
        let size = normal.x.abs() + normal.y.abs() + normal.z.abs();
        let q = normal / size;
        let (x, y) = if q.z >= 0.0 {
            (q.x, q.y)
        } else {
            ((1.0 - q.y.abs()).copysign(q.x), (1.0 - q.x.abs()).copysign(q.y))
        };
        let half = DIVISIONS as f32;
        let (u, v) = ((x + 1.0) * half, (y + 1.0) * half);
        let last = SIDE - 2;
        let (i, j) = ((u as usize).min(last), (v as usize).min(last));
        let (fu, fv) = (u - i as f32, v - j as f32);
        // The faces' triangles have their long edges along x + y or x − y, whichever joins the axes.
        let (nodes, shares) = if (i >= DIVISIONS) == (j >= DIVISIONS) {
            if fu + fv < 1.0 {
                ([(i, j), (i + 1, j), (i, j + 1)], [1.0 - fu - fv, fu, fv])
            } else {
                ([(i + 1, j + 1), (i, j + 1), (i + 1, j)], [fu + fv - 1.0, 1.0 - fu, 1.0 - fv])
            }
        } else if fu > fv {
            ([(i, j), (i + 1, j), (i + 1, j + 1)], [1.0 - fu, fu - fv, fv])
        } else {
            ([(i, j), (i, j + 1), (i + 1, j + 1)], [1.0 - fv, fv - fu, fu])
        };
        // Σ share · node is the normal's point on the octahedron, 1/size of the normal: weights for unit nodes that sum to
        // the normal itself make light that is linear in the direction exact.
        let mut weights = [0.0; 3];
        for ((weight, share), (column, row)) in weights.iter_mut().zip(shares).zip(nodes) {
            *weight = share * octahedron_node(column, row).length() * size;
        }
        let rest = 1.0 - weights[0] - weights[1] - weights[2];
        Self { entries: nodes.map(|(column, row)| 1 + row * SIDE + column), weights, rest }
    }

    /// Irradiance over π.
    #[inline(always)]
    pub fn apply(&self, entries: &[[f32; 3]]) -> Vec3 {
        let [a, b, c] = self.entries.map(|entry| Vec3::from_array(entries[entry]));
        let [wa, wb, wc] = self.weights;
        Vec3::from_array(entries[0]) * self.rest + a * wa + b * wb + c * wc
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn some_directions() -> impl Iterator<Item = Vec3> {
        (0..500).map(|i| {
            let (z, turn) = (1.0 - 2.0 * (i as f32 + 0.5) / 500.0, i as f32 * 2.399_963);
            let r = (1.0 - z * z).sqrt();
            Vec3::new(r * turn.cos(), r * turn.sin(), z)
        })
    }

    fn table(light: impl Fn(Vec3) -> f32, directions: &[Vec3]) -> Vec<[f32; 3]> {
        let mut sums = IrradianceSums::default();
        for &direction in directions {
            sums.add(direction, Vec3::splat(light(direction)), true);
        }
        let mut entries = vec![[0.0; 3]; ENTRIES];
        sums.write_means(directions.len() as f32, &mut entries);
        entries
    }

    /// Weights are those of a triangle around the normal, on either side of the map's folds.
    #[test]
    fn weights_reproduce_the_normal() {
        for normal in some_directions().chain(Vec3::AXES).chain(Vec3::AXES.map(|axis| -axis)) {
            let weights = OctahedralWeights::of(normal);
            let mut sum = Vec3::ZERO;
            for (entry, weight) in weights.entries.into_iter().zip(weights.weights) {
                let node = entry - 1;
                let node = octahedron_node(node % SIDE, node / SIDE).normalize();
                // No triangle of the table reaches further than 37 degrees.
                assert!(weight > -1e-5 && node.dot(normal) > 0.8, "{normal}: {weight} of {node}");
                sum += node * weight;
            }
            assert!(sum.abs_diff_eq(normal, 1e-5), "{sum} for {normal}");
        }
    }

    /// Irradiance is exact for all normals where light comes from all sides alike, and for light from one direction it is
    /// the cosine wherever all the nodes around the normal see it or none does.
    #[test]
    fn constant_light_and_single_lights_have_their_irradiance() {
        let sphere: Vec<Vec3> = some_directions().collect();
        let constant = table(|_| 2.0, &sphere);
        for normal in some_directions() {
            let found = OctahedralWeights::of(normal).apply(&constant);
            // 500 directions are 1 % from the integral.
            assert!(found.abs_diff_eq(Vec3::splat(2.0), 0.02), "{found}");
        }
        let lamp = Vec3::new(0.48, 0.6, 0.64);
        let single = table(|_| 0.25, &[lamp]);
        let mut largest = 0.0f32;
        for normal in some_directions() {
            // Without the mean, which is what light from one direction is far from.
            let weights = OctahedralWeights { rest: 0.0, ..OctahedralWeights::of(normal) };
            let (found, exact) = (weights.apply(&single).x, normal.dot(lamp).max(0.0));
            if normal.dot(lamp).abs() > 0.6 {
                assert!((found - exact).abs() < 1e-4, "{normal}: {found} for {exact}");
            }
            largest = largest.max((found - exact).abs());
        }
        // Elsewhere the kink of the cosine lies between nodes: the error is at most half the sine of their distance, and that at most 26.6 degrees.
        assert!(largest < 0.2, "{largest}");
    }
}
