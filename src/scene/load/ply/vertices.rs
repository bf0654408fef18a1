//! The `vertex` element: columns by name.

use super::data::Data;
use super::header::{Element, Property};

/// Names that programs write for each column that is used.
const NAMES: [&[&str]; 11] = [
    &["x"],
    &["y"],
    &["z"],
    &["nx", "normal_x"],
    &["ny", "normal_y"],
    &["nz", "normal_z"],
    &["s", "u", "texture_u", "texture_s"],
    &["t", "v", "texture_v", "texture_t"],
    &["red", "r", "diffuse_red"],
    &["green", "g", "diffuse_green"],
    &["blue", "b", "diffuse_blue"],
];

/// The vertices of a file; lists are empty or have one entry per vertex.
#[derive(Default)]
pub struct Vertices {
    /// Positions, which need not be finite.
    pub positions: Vec<[f32; 3]>,
    /// Normals as written.
    pub normals: Vec<[f32; 3]>,
    /// Texture coordinates as written.
    pub uvs: Vec<[f32; 2]>,
    /// Colours, sRGB-encoded, 1 for full intensity.
    pub colors: Vec<[f32; 3]>,
}

impl Vertices {
    /// Reads the rows of an element.
    ///
    /// # Errors
    /// Row, and what is wrong there.
    pub fn read(element: &Element, data: &mut Data<'_>) -> Result<Self, (u64, String)> {
        let column = |property: &Property| {
            let name = property.name.to_ascii_lowercase();
            NAMES.iter().position(|names| property.count.is_none() && names.contains(&&*name))
        };
        let columns: Vec<(Option<usize>, f64)> = element
            .properties
            .iter()
            .map(|property| {
                let column = column(property);
                let is_color = column.is_some_and(|column| column >= 8);
                (column, if is_color { 1.0 / property.scalar.full_intensity() } else { 1.0 })
            })
            .collect();
        let has = |wanted: std::ops::Range<usize>| {
            wanted.into_iter().all(|column| columns.iter().any(|(found, _)| *found == Some(column)))
        };
        if !has(0..3) {
            return Err((0, "has no x, y and z".to_owned()));
        }
        let (has_normals, has_uvs, has_colors) = (has(3..6), has(6..8), has(8..11));
        let mut vertices = Self::default();
        vertices.positions.reserve(data.rows_left(element.count) / columns.len().max(1));
        for row in 0..element.count {
            let mut values = [0.0f64; NAMES.len()];
            for (property, (column, scale)) in element.properties.iter().zip(&columns) {
                let fail = |problem| (row, format!("{}: {problem}", property.name.escape_debug()));
                let length = match property.count {
                    None => 1,
                    Some(count) => data.length(count).map_err(fail)?,
                };
                for _ in 0..length {
                    let value = data.number(property.scalar).map_err(fail)?;
                    if let Some(column) = column {
                        values[*column] = value * scale;
                    }
                }
            }
            let [x, y, z, nx, ny, nz, s, t, red, green, blue] = values.map(|value| value as f32);
            vertices.positions.push([x, y, z]);
            if has_normals {
                vertices.normals.push([nx, ny, nz]);
            }
            if has_uvs {
                vertices.uvs.push([s, t]);
            }
            if has_colors {
                vertices.colors.push([red, green, blue]);
            }
        }
        Ok(vertices)
    }
}
