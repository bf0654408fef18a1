//! Polygon files (PLY) in all three encodings.
//!
//! Vertices may have normals, texture coordinates and colours; faces are polygons of any size, and Stanford's
//! triangle strips. Other elements and properties are passed over.

mod data;
mod header;
mod vertices;

use std::path::Path;
use std::sync::Arc;

use glam::DVec3;

use self::data::Data;
use self::header::{Element, Header};
use self::vertices::Vertices;
use super::compact::drop_unused_vertices;
use super::triangulate::{Triangulator, has_no_area};
use super::{LoadError, Model, Part, Skipped, Warning, source};
use crate::color::linear_from_srgb;
use crate::scene::{Instance, Material, Positions, TriangleMaterials, TriangleMesh};

/// Corners that a face may have: far more than any real one, far fewer than triangulation can take.
const MAX_CORNERS: u32 = 1 << 20;

/// Reads a PLY file.
///
/// # Errors
/// [`LoadError::Read`], [`LoadError::Line`] for the header, [`LoadError::Invalid`] with the element's row for the
/// data, and [`LoadError::Empty`].
pub fn load_ply(path: &Path) -> Result<Model, LoadError> {
    read_ply(&source::read_all(path)?, path)
}

/// Reads a file's bytes; `path` names it in messages.
///
/// # Errors
/// As [`load_ply`].
pub fn read_ply(bytes: &[u8], path: &Path) -> Result<Model, LoadError> {
    let header = Header::parse(bytes).map_err(|(line, problem)| LoadError::Line {
        file: path.to_owned(),
        line,
        problem,
    })?;
    let mut data = Data::new(bytes.get(header.length..).unwrap_or_default(), header.encoding);
    let mut vertices = Vertices::default();
    let mut faces = Faces::default();
    let mut warnings = Vec::new();
    for element in header.elements.iter().filter(|element| !element.properties.is_empty()) {
        let read = match element.name.as_str() {
            "vertex" => Vertices::read(element, &mut data).map(|read| vertices = read),
            "face" => faces.read(element, &mut data, false),
            "tristrips" => faces.read(element, &mut data, true),
            _ => pass_over(element, &mut data),
        };
        read.map_err(|(row, problem)| {
            invalid(path, format!("{} {row}", element.name.escape_debug()), problem)
        })?;
        let colored = |element: &Element| element.properties.iter().any(|property| property.name == "red");
        if element.name == "face" && colored(element) {
            let message = "colours of faces are left out".to_owned();
            warnings.push(Warning { file: path.to_owned(), line: None, message });
        }
    }
    let mut model = assemble(vertices, &faces, path)?;
    model.warnings.extend(warnings);
    Ok(model)
}

fn invalid(path: &Path, place: String, problem: String) -> LoadError {
    LoadError::Invalid { file: path.to_owned(), place, problem }
}

/// Polygons by their corners.
#[derive(Default)]
struct Faces {
    corners: Vec<u32>,
    ends: Vec<usize>,
    /// Whether the corners of a polygon are a strip of triangles.
    strips: Vec<bool>,
}

impl Faces {
    /// Reads the rows of `face` or `tristrips`.
    fn read(&mut self, element: &Element, data: &mut Data<'_>, strips: bool) -> Result<(), (u64, String)> {
        let is_indices = |name: &str| matches!(name, "vertex_indices" | "vertex_index");
        let indices = element.properties.iter().position(|p| p.count.is_some() && is_indices(&p.name));
        let Some(indices) = indices else {
            return Err((0, "has no list of vertex_indices".to_owned()));
        };
        for row in 0..element.count {
            for (column, property) in element.properties.iter().enumerate() {
                let fail = |problem| (row, format!("{}: {problem}", property.name.escape_debug()));
                let length = property.count.map_or(Ok(1), |count| data.length(count)).map_err(fail)?;
                if column == indices && length > MAX_CORNERS && !strips {
                    return Err(fail(format!("a face of more than {MAX_CORNERS} corners")));
                }
                for _ in 0..length {
                    let value = data.number(property.scalar).map_err(fail)?;
                    if column != indices {
                        continue;
                    }
                    if strips && value == -1.0 {
                        self.close(true);
                    } else if (0.0..f64::from(u32::MAX)).contains(&value) && value.fract() == 0.0 {
                        self.corners.push(value as u32);
                    } else {
                        return Err(fail(format!("{value} is not an index")));
                    }
                }
            }
            self.close(strips);
        }
        Ok(())
    }

    fn close(&mut self, strip: bool) {
        if strip && self.ends.last().copied().unwrap_or(0) == self.corners.len() {
            return;
        }
        self.ends.push(self.corners.len());
        self.strips.push(strip);
    }

    fn iter(&self) -> impl Iterator<Item = (&[u32], bool)> {
        let starts = std::iter::once(0).chain(self.ends.iter().copied());
        starts
            .zip(&self.ends)
            .zip(&self.strips)
            .map(|((start, &end), &strip)| (&self.corners[start..end], strip))
    }
}

/// Reads an element of no use.
fn pass_over(element: &Element, data: &mut Data<'_>) -> Result<(), (u64, String)> {
    for row in 0..element.count {
        for property in &element.properties {
            let fail = |problem| (row, format!("{}: {problem}", property.name.escape_debug()));
            let length = property.count.map_or(Ok(1), |count| data.length(count)).map_err(fail)?;
            for _ in 0..length {
                data.number(property.scalar).map_err(fail)?;
            }
        }
    }
    Ok(())
}

fn assemble(vertices: Vertices, faces: &Faces, path: &Path) -> Result<Model, LoadError> {
    let Vertices { positions, mut normals, mut uvs, colors } = vertices;
    let mut skipped = Skipped::default();
    let mut triangles: Vec<[u32; 3]> = Vec::with_capacity(faces.ends.len());
    let mut triangulator = Triangulator::default();
    let mut polygon = Vec::new();
    for (number, (corners, strip)) in faces.iter().enumerate() {
        polygon.clear();
        for &corner in corners {
            let place = || format!("face {number}");
            let Some(position) = positions.get(corner as usize) else {
                let problem = format!("index {corner} is out of range ({} vertices)", positions.len());
                return Err(invalid(path, place(), problem));
            };
            if !position.iter().all(|x| x.is_finite()) {
                return Err(invalid(path, place(), format!("its vertex {corner} is not finite")));
            }
            polygon.push(*position);
        }
        if corners.len() < 3 {
            skipped.short_faces += 1;
            continue;
        }
        let mut push = |triangle: [usize; 3]| {
            if has_no_area(triangle.map(|i| polygon[i])) {
                skipped.zero_area_triangles += 1;
            } else {
                triangles.push(triangle.map(|i| corners[i]));
            }
        };
        if strip {
            (0..corners.len() - 2)
                .for_each(|i| push(if i % 2 == 0 { [i, i + 1, i + 2] } else { [i, i + 2, i + 1] }));
        } else {
            triangulator.split(&polygon, push);
        }
    }
    if faces.ends.is_empty() {
        skipped.points = positions.len() as u64;
    }
    if triangles.is_empty() {
        return Err(LoadError::Empty { file: path.to_owned(), skipped });
    }
    for normal in &mut normals {
        let direction = DVec3::from_array(normal.map(f64::from)).try_normalize();
        skipped.bad_normals += u64::from(direction.is_none());
        *normal = direction.map_or([0.0; 3], |d| d.as_vec3().to_array());
    }
    for uv in &mut uvs {
        let finite = uv.iter().all(|x| x.is_finite());
        skipped.bad_uvs += u64::from(!finite);
        // The files count from the lower left corner of the image.
        *uv = if finite { [uv[0], 1.0 - uv[1]] } else { [0.0; 2] };
    }
    let linear = |c: f32| linear_from_srgb(if c.is_finite() { c.clamp(0.0, 1.0) } else { 0.0 });
    let colors: Vec<_> = colors.into_iter().map(|color| color.map(linear)).collect();
    let name = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    fn given<T>(list: Vec<T>) -> Option<Vec<T>> {
        (!list.is_empty()).then_some(list)
    }
    let mut mesh = TriangleMesh {
        name: name.clone(),
        positions: Positions::new(positions),
        triangles: Arc::new(triangles),
        normals: given(normals),
        uvs: given(uvs),
        colors: given(colors),
        materials: TriangleMaterials::Uniform(0),
    };
    drop_unused_vertices(&mut mesh);
    let part =
        Part { mesh: 0, object: name, group: String::new(), triangles: 0..mesh.triangles.len() as u32 };
    Ok(Model {
        meshes: vec![mesh],
        instances: vec![Instance { mesh: 0, to_world: None }],
        materials: vec![Material::default()],
        parts: vec![part],
        skipped,
        ..Model::default()
    })
}
