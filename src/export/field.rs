//! Positions with named values.

use glam::Vec3;

use crate::light_mesh::direct::KnownPoints;

/// Positions with named values at each.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PointField {
    /// Positions, scene units.
    pub positions: Vec<Vec3>,
    /// Names, and as many values as there are positions.
    pub arrays: Vec<(String, Values)>,
}

/// Values of one name.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// One number each.
    Scalars(Vec<f32>),
    /// Three, such as linear RGB.
    Vectors(Vec<Vec3>),
    /// One whole number up to 255 each, such as marks.
    Bytes(Vec<u8>),
}

impl Values {
    /// Numbers for each point.
    pub fn components(&self) -> usize {
        match self {
            Self::Scalars(_) | Self::Bytes(_) => 1,
            Self::Vectors(_) => 3,
        }
    }

    /// The numbers of the point of an index; 0 beyond the last.
    pub(super) fn of(&self, index: usize) -> impl Iterator<Item = f32> {
        let (values, count) = match self {
            Self::Scalars(values) => ([values.get(index).copied().unwrap_or_default(), 0.0, 0.0], 1),
            Self::Vectors(values) => (values.get(index).copied().unwrap_or_default().to_array(), 3),
            Self::Bytes(values) => {
                ([values.get(index).copied().map(f32::from).unwrap_or_default(), 0.0, 0.0], 1)
            }
        };
        values.into_iter().take(count)
    }
}

impl PointField {
    /// The known points of a direct light mesh: `DirectLight` of eq. (1) and `Unoccluded`, the same with all lights seen, linear RGB;
    /// `VisibleLights`, the number of lights seen; and `Layer`, the number of the point's layer.
    pub fn of_known(known: KnownPoints) -> Self {
        let KnownPoints { positions, light, unoccluded, visible, layers, grids: _ } = known;
        let scalars =
            |values: Vec<u32>| Values::Scalars(values.into_iter().map(|value| value as f32).collect());
        let named = |name: &str, values| (name.to_owned(), values);
        let arrays = vec![
            named("DirectLight", Values::Vectors(light)),
            named("Unoccluded", Values::Vectors(unoccluded)),
            named("VisibleLights", scalars(visible)),
            named("Layer", scalars(layers)),
        ];
        Self { positions, arrays }
    }
}
