//! Probes, and where they lie: in a file, along a line, on a plane, in a grid.

use std::fs;
use std::path::Path;

use glam::{UVec3, Vec3};

use crate::Bounds;
use crate::scene::load::{LoadError, finite_number, number_rows};

/// A point at which light is measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Probe {
    /// Where, scene units.
    pub position: Vec3,
    /// What it faces (unit length), for irradiance; `None` for light from all directions.
    pub normal: Option<Vec3>,
}

/// Names of the numbers of a probe.
const FIELDS: [&str; 6] = ["x", "y", "z", "nx", "ny", "nz"];

/// Reads probes from a text file: one per line, a position or a position and a normal of any length but 0, three or six numbers separated by commas,
/// semicolons or spaces; all lines have as many. A heading in the first line, empty lines, and what follows a `#` are passed over.
///
/// # Errors
/// [`LoadError::Read`]; [`LoadError::Line`], which names line and field, for what is none of this, and if there is no probe.
pub fn load_probes(path: &Path) -> Result<Vec<Probe>, LoadError> {
    let text = fs::read(path).map_err(|source| LoadError::Read { file: path.to_owned(), source })?;
    let mut probes = Vec::new();
    let mut columns = None;
    for (line, row) in number_rows(&text) {
        let fail = |problem: String| LoadError::Line { file: path.to_owned(), line, problem };
        let words = row.len();
        if words != 3 && words != 6 {
            return Err(fail(format!("three numbers or six expected ({}), found {words}", FIELDS.join(" "))));
        }
        let columns = *columns.get_or_insert(words);
        if words != columns {
            return Err(fail(format!("{columns} numbers expected as in the lines before, found {words}")));
        }
        let mut numbers = [0.0f32; 6];
        for ((number, name), word) in numbers.iter_mut().zip(FIELDS).zip(row) {
            *number = finite_number(word).map_err(|problem| fail(format!("{name}: {problem}")))?;
        }
        let [x, y, z, nx, ny, nz] = numbers;
        let normal = if words == 6 {
            let normal = direction(Vec3::new(nx, ny, nz));
            Some(normal.ok_or_else(|| fail("nx ny nz: a normal has a length above 0".to_owned()))?)
        } else {
            None
        };
        probes.push(Probe { position: Vec3::new(x, y, z), normal });
    }
    if probes.is_empty() {
        let problem = "holds no points".to_owned();
        return Err(LoadError::Line { file: path.to_owned(), line: 1, problem });
    }
    Ok(probes)
}

/// A vector of any length but 0 as one of unit length.
fn direction(vector: Vec3) -> Option<Vec3> {
    // Squares of very large and very small numbers leave single precision.
    vector.as_dvec3().try_normalize().map(|unit| unit.as_vec3())
}

/// So many probes (at least 2) from one point to another, both included, at equal distances.
pub fn line(from: Vec3, to: Vec3, count: u32, normal: Option<Vec3>) -> Vec<Probe> {
    let last = count.max(2) - 1;
    let at = |index: u32| from.lerp(to, index as f32 / last as f32);
    (0..=last).map(|index| Probe { position: at(index), normal }).collect()
}

/// A parallelogram that is measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// A corner.
    origin: Vec3,
    edges: [Vec3; 2],
    normal: Vec3,
    resolution: (u32, u32),
}

impl Plane {
    /// The plane from a corner along two edges; it faces where their cross product points. `None` if they enclose no area. The resolution is that along the
    /// first edge and along the second, each at least 1.
    pub fn new(origin: Vec3, edges: [Vec3; 2], resolution: (u32, u32)) -> Option<Self> {
        let [u, v] = edges.map(|edge| edge.as_dvec3());
        let normal = u.cross(v).try_normalize()?.as_vec3();
        Some(Self { origin, edges, normal, resolution })
    }

    /// Measuring points along the first edge and along the second.
    pub fn resolution(&self) -> (u32, u32) {
        self.resolution
    }

    /// The probes, in the middle of the parts that the resolution cuts the plane into: rows along the first edge, from the origin on.
    pub fn probes(&self) -> Vec<Probe> {
        let (columns, rows) = self.resolution;
        let share = |index: u32, count: u32| (index as f32 + 0.5) / count as f32;
        let rows = (0..rows).flat_map(|row| {
            (0..columns).map(move |column| {
                let [along, across] = [share(column, columns), share(row, rows)];
                self.origin + self.edges[0] * along + self.edges[1] * across
            })
        });
        rows.map(|position| Probe { position, normal: Some(self.normal) }).collect()
    }

    /// Values in the order of the probes in the order of an image's pixels: as the plane looks from where its normal points, the first edge to the
    /// right and the second one upwards.
    pub fn image_order<T: Copy>(&self, values: &[T]) -> Vec<T> {
        values.chunks(self.resolution.0 as usize).rev().flatten().copied().collect()
    }
}

/// Probes in the middles of the cells that a box is divided into.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProbeGrid {
    /// Position of the first.
    pub origin: Vec3,
    /// From one to the next along each axis.
    pub step: Vec3,
    /// How many there are along each axis.
    pub counts: UVec3,
}

impl ProbeGrid {
    /// A grid of so many cells along each axis, at least 1, in a box.
    pub fn in_box(bounds: Bounds, counts: UVec3) -> Self {
        let step = bounds.extent() / counts.max(UVec3::ONE).as_vec3();
        Self { origin: bounds.min + 0.5 * step, step, counts }
    }

    /// The positions: x changes fastest, z slowest.
    pub fn positions(&self) -> Vec<Vec3> {
        let Self { origin, step, counts } = *self;
        let slices = (0..counts.z).flat_map(|z| (0..counts.y).map(move |y| (y, z)));
        slices
            .flat_map(|(y, z)| (0..counts.x).map(move |x| origin + step * UVec3::new(x, y, z).as_vec3()))
            .collect()
    }
}
