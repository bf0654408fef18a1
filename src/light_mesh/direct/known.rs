//! The known points of a direct mesh, as a list.

use glam::Vec3;

use super::derived::Basis;
use super::mesh::DirectMesh;
use crate::light_mesh::points::LayerGrid;
use crate::lights::PackedLights;

/// What a direct light mesh knows, by point in the order of evaluation.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct KnownPoints {
    /// Positions, scene units.
    pub positions: Vec<Vec3>,
    /// DirectLight of eq. (1), linear RGB.
    pub light: Vec<Vec3>,
    /// The same if nothing hid a light.
    pub unoccluded: Vec<Vec3>,
    /// Number of lights seen; of lamps with a size each part counts (method §4).
    pub visible: Vec<u32>,
    /// Number of the layer, a layout and spacing; of points in several, the first.
    pub layers: Vec<u32>,
    /// The grids that the layers' points lie on, by number; `None` for layouts that lie on none.
    pub grids: Vec<Option<LayerGrid>>,
}

impl DirectMesh {
    /// All known points; `lights` are those that it was evaluated with.
    pub(crate) fn known(&mut self, lights: &PackedLights) -> KnownPoints {
        let Self { store, field } = self;
        field.derive(lights, Basis::Light, store.positions());
        let positions = store.positions().to_vec();
        let chunks = lights.chunks().len();
        let slots = 0..positions.len() as u32;
        let light: Vec<[Vec3; 2]> = slots
            .clone()
            .map(|slot| {
                let [r, g, b, all_r, all_g, all_b] = *field.light(slot);
                [Vec3::new(r, g, b), Vec3::new(all_r, all_g, all_b)]
            })
            .collect();
        let bits = field.bits();
        let seen = |slot: u32| bits.get(slot as usize * chunks..).and_then(|bits| bits.get(..chunks));
        let count = |slot| seen(slot).into_iter().flatten().map(|bits| bits.count_ones()).sum();
        let visible = slots.map(count);
        KnownPoints {
            light: light.iter().map(|[seen, _]| *seen).collect(),
            unoccluded: light.iter().map(|[_, all]| *all).collect(),
            visible: visible.collect(),
            layers: store.layers(),
            grids: store.points.grids().collect(),
            positions,
        }
    }
}
