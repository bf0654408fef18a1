//! PLY points: values as properties, and a colour for viewers.

use std::fmt::Write as _;

use glam::Vec3;

use super::field::{PointField, Values};
use crate::image::tone::{auto_exposure, tone_map_8_bit};

/// Points as a binary little-endian PLY file: `x`, `y`, `z`, and for each array a property of its name, or three that end in `_r`, `_g` and `_b`, all
/// floats. Properties `red`, `green` and `blue` (bytes) show the first array of three numbers with an exposure that suits it.
pub fn encode_ply(field: &PointField) -> Vec<u8> {
    let mut header = format!(
        "ply\nformat binary_little_endian 1.0\ncomment lightmesh\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n",
        field.positions.len()
    );
    for (name, values) in &field.arrays {
        // Names end at a space.
        let name = name.replace(char::is_whitespace, "_");
        let suffixes: &[&str] = if values.components() == 3 { &["_r", "_g", "_b"] } else { &[""] };
        for suffix in suffixes {
            // Writing to a string can't fail.
            let _ = writeln!(header, "property float {name}{suffix}");
        }
    }
    let colours = colours(field);
    if colours.is_some() {
        header.push_str("property uchar red\nproperty uchar green\nproperty uchar blue\n");
    }
    header.push_str("end_header\n");
    let mut bytes = header.into_bytes();
    for (index, position) in field.positions.iter().enumerate() {
        let values = field.arrays.iter().flat_map(|(_, values)| values.of(index));
        bytes.extend(position.to_array().into_iter().chain(values).flat_map(f32::to_le_bytes));
        if let Some(colours) = &colours {
            bytes.extend(colours.get(index).copied().unwrap_or_default());
        }
    }
    bytes
}

/// Colours of the first array of three numbers.
fn colours(field: &PointField) -> Option<Vec<[u8; 3]>> {
    let values = field.arrays.iter().find_map(|(_, values)| match values {
        Values::Vectors(values) => Some(values),
        Values::Scalars(_) | Values::Bytes(_) => None,
    })?;
    let pixels: Vec<[f32; 3]> = values.iter().map(Vec3::to_array).collect();
    let exposure = auto_exposure(&pixels);
    Some(pixels.into_iter().map(|pixel| tone_map_8_bit(pixel, exposure)).collect())
}
