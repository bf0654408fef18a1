//! A layer of known mesh points as a regular grid, in which those that nobody evaluated are hidden.

use glam::{DVec3, IVec3, UVec3, Vec3};

use super::field::{PointField, Values};
use super::vtk::ImageGrid;
use crate::light_mesh::direct::{KnownPoints, LayerGrid};

/// Places that a grid may have: values at so many take a gigabyte.
const MOST_PLACES: u64 = 1 << 25;

/// How far a spacing may be from the one that is asked for, as a share of it: numbers are typed with few digits.
const SPACING_TOLERANCE: f32 = 1e-3;

/// What VTK marks hidden points by: `vtkDataSetAttributes::HIDDENPOINT` in an array of this name.
const HIDDEN_POINT: u8 = 2;
const GHOSTS: &str = "vtkGhostType";

/// Values on a regular grid of mesh points.
#[derive(Clone, Debug, PartialEq)]
pub struct GridField {
    /// The places.
    pub grid: ImageGrid,
    /// Names, and a value for each place.
    pub arrays: Vec<(String, Values)>,
    /// Places whose values are known.
    pub known: usize,
}

/// Why known points make no regular grid.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GridError {
    /// No layer of theirs lies on a grid.
    #[error(
        "holds no mesh points of the layouts `regular` and `body-centred`, which a .vti needs; a .vtu takes those of any layout"
    )]
    NotRegular,
    /// None has the spacing that is asked for.
    #[error("no grid of mesh points has the spacing {asked}; there are: {spacings}")]
    NoSuchSpacing {
        /// What is asked for.
        asked: f32,
        /// Those that exist.
        spacings: String,
    },
    /// The grid around the points would be too large.
    #[error(
        "a grid around the mesh points of spacing {spacing} has {count} places, more than {MOST_PLACES}; a .vtu takes the points alone"
    )]
    TooLarge {
        /// Spacing of the layer.
        spacing: String,
        /// Number of places.
        count: u64,
    },
}

impl GridField {
    /// The known points that lie on the regular grid of one layer: the one of a spacing, or the one with most points of its own. The grid reaches as far as its points do.
    ///
    /// Arrays are those of [`PointField::of_known`], 0 where nothing is known, and two more: `Known`, 1 or 0, and `vtkGhostType`, by which VTK hides
    /// the places where nothing is known.
    ///
    /// # Errors
    /// See [`GridError`].
    pub fn of_known(known: &KnownPoints, spacing: Option<f32>) -> Result<Self, GridError> {
        let layer = layer(known, spacing)?;
        let own = |number: usize| known.layers.get(number).is_some_and(|of| *of as usize == layer.number);
        let cells: Vec<Option<IVec3>> =
            known.positions.iter().map(|position| cell_at(layer.grid, *position)).collect();
        let on_grid = || cells.iter().enumerate().filter_map(|(number, cell)| Some((number, (*cell)?)));
        // Points of other layers may lie on this grid too, and far away: the grid ends where its own do. Those of a coarse layer are all in a finer one, perhaps.
        let extent = extent(on_grid().filter(|(number, _)| own(*number)).map(|(_, cell)| cell));
        let Some((first, last)) = extent.or_else(|| self::extent(on_grid().map(|(_, cell)| cell))) else {
            return Err(GridError::NotRegular);
        };
        let counts = (last - first + 1).as_uvec3();
        let count = counts.to_array().map(u64::from).iter().product();
        if count > MOST_PLACES {
            return Err(GridError::TooLarge { spacing: in_words(layer.grid.spacing), count });
        }
        let place = |cell: IVec3| {
            let inside = cell.cmpge(first).all() && cell.cmple(last).all();
            let UVec3 { x, y, z } = (cell - first).as_uvec3();
            inside.then(|| ((z * counts.y + y) * counts.x + x) as usize)
        };
        let places: Vec<Option<usize>> = cells.iter().map(|cell| place((*cell)?)).collect();
        let mut is_known = vec![false; count as usize];
        for place in places.iter().flatten() {
            is_known.get_mut(*place).into_iter().for_each(|known| *known = true);
        }
        let spread = |(name, values): (String, Values)| (name, spread(&values, &places, count as usize));
        let mut arrays: Vec<_> = PointField::of_known(known.clone()).arrays.into_iter().map(spread).collect();
        let marks = |mark: fn(bool) -> u8| Values::Bytes(is_known.iter().map(|known| mark(*known)).collect());
        arrays.push(("Known".to_owned(), marks(u8::from)));
        arrays.push((GHOSTS.to_owned(), marks(|known| if known { 0 } else { HIDDEN_POINT })));
        let grid = ImageGrid { origin: position_of(layer.grid, first), step: layer.grid.spacing, counts };
        Ok(Self { grid, arrays, known: is_known.iter().filter(|known| **known).count() })
    }
}

/// A layer that is a regular grid.
#[derive(Clone, Copy)]
struct RegularLayer {
    number: usize,
    grid: LayerGrid,
    /// Points that are its own.
    points: usize,
}

/// The layer of a spacing, or of all, with most points; the first of several.
fn layer(known: &KnownPoints, spacing: Option<f32>) -> Result<RegularLayer, GridError> {
    let points = |number: usize| known.layers.iter().filter(|layer| **layer as usize == number).count();
    let numbered = known.grids.iter().enumerate();
    let layers: Vec<RegularLayer> = numbered
        .filter_map(|(number, grid)| Some(RegularLayer { number, grid: (*grid)?, points: points(number) }))
        .collect();
    let is_asked = |layer: &&RegularLayer| {
        spacing.is_none_or(|asked| {
            (layer.grid.spacing.max_element() - asked).abs() <= SPACING_TOLERANCE * asked.abs()
        })
    };
    let best = layers.iter().filter(is_asked).rev().max_by_key(|layer| layer.points);
    match (best, spacing) {
        (Some(best), _) => Ok(*best),
        (None, Some(asked)) if !layers.is_empty() => {
            let mut spacings: Vec<Vec3> = layers.iter().map(|layer| layer.grid.spacing).collect();
            spacings.sort_by(|a, b| a.max_element().total_cmp(&b.max_element()));
            // Layers that build on different levels may have one spacing.
            spacings.dedup();
            let spacings: Vec<String> = spacings.into_iter().map(in_words).collect();
            Err(GridError::NoSuchSpacing { asked, spacings: spacings.join(", ") })
        }
        _ => Err(GridError::NotRegular),
    }
}

/// A spacing as it is written: one number where it is the same along all axes.
fn in_words(spacing: Vec3) -> String {
    let Vec3 { x, y, z } = spacing;
    if x == y && y == z { x.to_string() } else { format!("{x}×{y}×{z}") }
}

/// The cell of a grid whose corner lies exactly at a position.
fn cell_at(grid: LayerGrid, position: Vec3) -> Option<IVec3> {
    let cell = ((position - grid.origin).as_dvec3() / grid.spacing.as_dvec3()).round();
    // Far beyond all ids of points; what is not finite isn't within either.
    let cell = cell.abs().cmplt(DVec3::splat(f64::from(1 << 24))).all().then(|| cell.as_ivec3())?;
    (position_of(grid, cell) == position).then_some(cell)
}

fn position_of(grid: LayerGrid, cell: IVec3) -> Vec3 {
    grid.origin + cell.as_vec3() * grid.spacing
}

/// The lowest and the highest cell.
fn extent(cells: impl Iterator<Item = IVec3>) -> Option<(IVec3, IVec3)> {
    cells.fold(None, |extent, cell| {
        let (first, last) = extent.unwrap_or((cell, cell));
        Some((first.min(cell), last.max(cell)))
    })
}

/// Values of points at their places among `count`, 0 elsewhere.
fn spread(values: &Values, places: &[Option<usize>], count: usize) -> Values {
    fn put<T: Copy + Default>(values: &[T], places: &[Option<usize>], count: usize) -> Vec<T> {
        let mut spread = vec![T::default(); count];
        for (value, place) in values.iter().zip(places) {
            let at = place.and_then(|place| spread.get_mut(place));
            at.into_iter().for_each(|at| *at = *value);
        }
        spread
    }
    match values {
        Values::Scalars(values) => Values::Scalars(put(values, places, count)),
        Values::Vectors(values) => Values::Vectors(put(values, places, count)),
        Values::Bytes(values) => Values::Bytes(put(values, places, count)),
    }
}
