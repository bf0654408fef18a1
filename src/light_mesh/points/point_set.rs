//! Sets of mesh points: one interface over all layouts and spacings.

use glam::Vec3;

use super::ids::{LAYER_SHIFT, MOST_LAYERS, anchor, too_fine};
use super::kernel::Kernel;
use super::lattice::{Lattice, LayerGrid};
use super::list::PointList;
use super::neighbours::Neighbours;
use super::periodic::{PeriodicLayout, PeriodicPoints};
use super::rounded_box::RoundedBox;
use crate::Bounds;
use crate::settings::PointLayout;

/// Why a light mesh can't be set up.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// Spacing below what coordinates or ids of points can express.
    #[error("spacing {0} of the light mesh is too fine for a scene of this size")]
    TooFine(Vec3),
    /// More different spacings than the ids of points can distinguish.
    #[error("a light mesh has points of at most {MOST_LAYERS} different spacings")]
    TooManySpacings,
}

/// The positions of the mesh points of one layer: one interface over all layouts.
enum Positions {
    Lattice(Lattice),
    Periodic(PeriodicPoints),
    List(PointList),
}

/// Runs `$body` with `$positions` bound to the layout's own type.
macro_rules! with_positions {
    ($layer:expr, $positions:ident => $body:expr) => {
        match &$layer.positions {
            Positions::Lattice($positions) => $body,
            Positions::Periodic($positions) => $body,
            Positions::List($positions) => $body,
        }
    };
}

/// All points of one layout and spacing.
struct Layer {
    layout: PointLayout,
    spacing: Vec3,
    positions: Positions,
    /// Id of its first point.
    first_id: u64,
    /// Coarser layers that its points build on, one on the other, and the first of them.
    levels: u32,
    parent: Option<usize>,
}

/// Mesh points of one or several layouts and spacings, their *layers*, over a scene.
///
/// Layers are added as settings need them and never change, so that ids stay valid whatever settings follow.
pub struct PointSet {
    bounds: Bounds,
    /// How far all points but those of lists lie from where they usually do, in spacings.
    shift: Vec3,
    layers: Vec<Layer>,
}

impl PointSet {
    /// Without layers, for a scene of the given bounds.
    pub(crate) fn new(bounds: Bounds) -> Self {
        Self::shifted(bounds, Vec3::ZERO)
    }

    /// The same with all points but those of lists elsewhere, by a vector in spacings.
    pub(crate) fn shifted(bounds: Bounds, shift: Vec3) -> Self {
        Self { bounds, shift, layers: Vec::new() }
    }

    /// Bounds of the scene.
    pub(crate) fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// How far points lie from where they usually do, in spacings.
    pub(crate) fn shift(&self) -> Vec3 {
        self.shift
    }

    /// Whether points of a layer build on those of a coarser one.
    pub(crate) fn has_levels(&self) -> bool {
        self.layers.iter().any(|layer| layer.parent.is_some())
    }

    /// Number of the layer of a layout and spacing whose points build on those of so many `levels` of twice the spacing each; it is added if there
    /// is none.
    ///
    /// # Errors
    /// See [`MeshError`].
    pub(crate) fn layer(
        &mut self,
        layout: &PointLayout,
        spacing: Vec3,
        levels: u32,
    ) -> Result<usize, MeshError> {
        // A list has no spacing.
        let is_list = matches!(layout, PointLayout::List(_));
        let levels = if is_list { 0 } else { levels };
        let same = |layer: &Layer| {
            layer.layout == *layout && layer.levels == levels && (is_list || layer.spacing == spacing)
        };
        if let Some(known) = self.layers.iter().position(same) {
            return Ok(known);
        }
        let parent = match levels.checked_sub(1) {
            Some(below) => Some(self.layer(&PointLayout::Regular, spacing * 2.0, below)?),
            None => None,
        };
        let number = self.layers.len();
        if number == MOST_LAYERS {
            return Err(MeshError::TooManySpacings);
        }
        let anchor = anchor(self.bounds, spacing) + self.shift * spacing;
        let periodic = |layout, seed| Positions::Periodic(PeriodicPoints::new(anchor, spacing, layout, seed));
        let positions = match layout {
            PointLayout::List(positions) => Positions::List(PointList::new(positions)),
            _ if too_fine(self.bounds, spacing) => return Err(MeshError::TooFine(spacing)),
            PointLayout::Regular => Positions::Lattice(Lattice::new(anchor, spacing)),
            PointLayout::BodyCentred => periodic(PeriodicLayout::BodyCentred, 0),
            PointLayout::Jittered { seed } => periodic(PeriodicLayout::Jittered, *seed),
            PointLayout::BlueNoise { seed } => periodic(PeriodicLayout::BlueNoise, *seed),
        };
        let first_id = (number as u64) << LAYER_SHIFT;
        self.layers.push(Layer { layout: layout.clone(), spacing, positions, first_id, parent, levels });
        Ok(number)
    }

    /// Layout, spacing and levels of every layer, in the order of their numbers.
    pub(crate) fn layers(&self) -> impl Iterator<Item = (&PointLayout, Vec3, u32)> {
        self.layers.iter().map(|layer| (&layer.layout, layer.spacing, layer.levels))
    }

    /// Grids of the layers, in the order of their numbers; that of a body-centred one has half its spacing, and points at a quarter of its places. `None`
    /// for layouts that lie on no grid.
    pub(crate) fn grids(&self) -> impl Iterator<Item = Option<LayerGrid>> {
        self.layers.iter().map(|layer| match (&layer.positions, &layer.layout) {
            (Positions::Lattice(lattice), _) => Some(lattice.grid()),
            (Positions::Periodic(points), PointLayout::BodyCentred) => Some(points.half_grid()),
            _ => None,
        })
    }

    /// Number of the layer of a point.
    pub(crate) fn layer_of(id: u64) -> usize {
        (id >> LAYER_SHIFT) as usize
    }

    /// The id of a point whose layer has another number in another set: `layers` has the new ones by the old ones.
    pub(crate) fn in_layer(id: u64, layers: &[usize]) -> Option<u64> {
        let layer = *layers.get(Self::layer_of(id))? as u64;
        Some(layer << LAYER_SHIFT | id & ((1 << LAYER_SHIFT) - 1))
    }

    /// Whether there are points with the ids from `first` on for which `mask` has bits.
    pub(crate) fn has_points(&self, first: u64, mask: u64) -> bool {
        let last = first + u64::from(63 - mask.leading_zeros().min(63));
        let Some(layer) = self.layers.get(Self::layer_of(first)) else { return false };
        match &layer.positions {
            Positions::List(list) => last - layer.first_id < list.len(),
            // Those of all other layouts go on without an end.
            Positions::Lattice(_) | Positions::Periodic(_) => Self::layer_of(last) == Self::layer_of(first),
        }
    }

    /// Position of a point.
    pub fn position(&self, id: u64) -> Vec3 {
        let layer = &self.layers[(id >> LAYER_SHIFT) as usize];
        with_positions!(layer, positions => positions.position(id - layer.first_id))
    }

    /// Whether a point is in the second of two halves of its layer that lie among each other, so that both surround a place with several points around it.
    pub(crate) fn is_in_second_half(&self, id: u64) -> bool {
        let layer = &self.layers[Self::layer_of(id)];
        match &layer.positions {
            Positions::Lattice(_) => Lattice::is_in_second_half(id - layer.first_id),
            Positions::Periodic(points) => points.is_in_second_half(id - layer.first_id),
            // Every other one of those that follow each other in space.
            Positions::List(_) => id % 2 == 1,
        }
    }

    /// Whether points of a layer take the values of points of another one: those of coarser layers that they build on, and otherwise layers in which
    /// all lights are traced share among themselves, so that no value depends on what was rendered before.
    fn may_take(&self, own: usize, other: usize) -> bool {
        let parent = |number: usize| self.layers[number].parent;
        let coarser = || std::iter::successors(parent(own), |number| parent(*number));
        match parent(own) {
            None => other != own && parent(other).is_none(),
            Some(_) => coarser().any(|number| number == other),
        }
    }

    /// Points of other layers at exactly the position of a point, whose values are its own.
    pub(crate) fn twins(&self, id: u64) -> impl Iterator<Item = u64> + '_ {
        let own = (id >> LAYER_SHIFT) as usize;
        let position = (self.layers.len() > 1).then(|| self.position(id));
        let others = self.layers.iter().enumerate().filter(move |(number, _)| self.may_take(own, *number));
        others.filter_map(move |(_, layer)| {
            let twin = with_positions!(layer, positions => positions.id_at(position?));
            twin.map(|id| layer.first_id + id)
        })
    }

    /// The eight coarser points around a point that it builds on; `None` where every light is traced.
    pub(crate) fn corners(&self, id: u64) -> Option<[u64; 8]> {
        let own = &self.layers[(id >> LAYER_SHIFT) as usize];
        let parent = &self.layers[own.parent?];
        let Positions::Lattice(lattice) = &parent.positions else { return None };
        Some(lattice.corners(self.position(id)).map(|corner| parent.first_id + corner))
    }

    /// About how many points of a layer lie in a box.
    pub(super) fn count_in(&self, layer: usize, bounds: Bounds) -> u64 {
        with_positions!(&self.layers[layer], positions => positions.count_in(bounds))
    }

    /// The points of a layer in a kernel, in a fixed order.
    #[inline(always)]
    pub(super) fn gather(&self, layer: usize, kernel: &Kernel, out: &mut Neighbours) {
        let layer = &self.layers[layer];
        with_positions!(layer, positions => positions.gather(kernel, out));
        if layer.first_id > 0 {
            out.offset_ids(layer.first_id);
        }
    }

    /// The point of a layer that is nearest to the kernel's centre, if there is one among those that the kernel's half-space
    /// admits.
    pub(super) fn nearest(&self, layer: usize, kernel: &Kernel) -> u64 {
        let layer = &self.layers[layer];
        layer.first_id + with_positions!(layer, positions => positions.nearest(kernel))
    }

    /// Calls `each(id, position)` for all points of a layer in a box, and perhaps some beside it, in a fixed order.
    #[inline(always)]
    pub(super) fn for_each_in_box(
        &self,
        layer: usize,
        min: Vec3,
        max: Vec3,
        mut each: impl FnMut(u64, Vec3),
    ) {
        let layer = &self.layers[layer];
        with_positions!(layer, positions => {
            positions.for_each_in_box(min, max, |id, position| each(layer.first_id + id, position));
        });
    }

    /// Calls `each(id, position)` for all points of a layer in a rounded box, in the order of [`gather`](Self::gather).
    #[inline(always)]
    pub(super) fn for_each_near(&self, layer: usize, near: &RoundedBox, mut each: impl FnMut(u64, Vec3)) {
        let layer = &self.layers[layer];
        with_positions!(layer, positions => {
            positions.for_each_near(near, |id, position| each(layer.first_id + id, position));
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A layout and spacing that was there before is the same layer again: its points keep their ids.
    #[test]
    fn layers_are_kept() {
        let bounds = Bounds { min: Vec3::ZERO, max: Vec3::splat(8.0) };
        let mut points = PointSet::new(bounds);
        let coarse = points.layer(&PointLayout::Regular, Vec3::ONE, 0).unwrap();
        let fine = points.layer(&PointLayout::Regular, Vec3::splat(0.5), 0).unwrap();
        assert_ne!(coarse, fine);
        assert_eq!(points.layer(&PointLayout::Regular, Vec3::ONE, 0), Ok(coarse));
        let jittered = PointLayout::Jittered { seed: 1 };
        assert_ne!(points.layer(&jittered, Vec3::ONE, 0), Ok(coarse));
        // Every coarse point has a fine twin, and that one leads back.
        points.for_each_in_box(coarse, bounds.min, bounds.max, |id, position| {
            let twin = points.twins(id).find(|&twin| points.twins(twin).any(|back| back == id));
            assert_eq!(twin.map(|twin| points.position(twin)), Some(position));
        });
    }
}
