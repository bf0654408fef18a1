//! The surface mesh in files: its cells, and the light that is known at their points.

use std::borrow::Cow;

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::cell_light::CellLight;
use super::cells::CellPoint;
use super::mesh::{State, SurfaceMesh};
use super::points::FINEST;
use crate::light_mesh::file::MeshFileError;
use crate::lights::PackedLights;
use crate::settings::IndirectSettings;

/// A surface mesh as files hold it. Points have the numbers that the order of the cells gives them.
#[derive(Serialize, Deserialize)]
pub struct SavedSurfaceMesh<'a> {
    /// Of cells of level 0.
    width: f32,
    cells: Vec<SavedCell<'a>>,
    /// By point: see `SurfacePoints::parent`.
    parents: Cow<'a, [u32]>,
    /// By point.
    states: Cow<'a, [State]>,
    /// By point: what falls on it from surfaces, as a source and as a record.
    indirect: Cow<'a, [Vec3]>,
    received: Cow<'a, [Vec3]>,
}

/// A cell that was surveyed, or a point that stands for itself alone.
#[derive(Serialize, Deserialize)]
pub struct SavedCell<'a> {
    pub key: u64,
    pub level: u8,
    pub points: Cow<'a, [CellPoint]>,
    /// Light of lights at the points, in cells of level 0.
    pub lights: Cow<'a, [CellLight]>,
}

impl SurfaceMesh {
    /// What a file holds of the mesh.
    pub(crate) fn saved(&self) -> SavedSurfaceMesh<'_> {
        SavedSurfaceMesh {
            width: self.points.cells.width(0),
            cells: self.points.saved_cells(),
            parents: self.points.parents().into(),
            states: (&self.states[..]).into(),
            indirect: (&self.indirect[..]).into(),
            received: (&self.received[..]).into(),
        }
    }

    /// The mesh of a file, for these settings and lights; `scale` is that of direct light.
    ///
    /// # Errors
    /// [`MeshFileError::Damaged`].
    pub(crate) fn restore(
        saved: SavedSurfaceMesh,
        settings: &IndirectSettings,
        scale: f32,
        lights: &PackedLights,
    ) -> Result<Self, MeshFileError> {
        let damaged = |what: &str| MeshFileError::damaged("surface", what);
        let SavedSurfaceMesh { width, cells, parents, states, indirect, received } = saved;
        if !(width > 0.0 && width.is_finite()) {
            return Err(damaged("its cells have no width"));
        }
        let mut mesh = Self::new(settings, width, scale);
        for SavedCell { key, level, points, lights: lit } in cells {
            let fits = level <= FINEST + 1
                && (lit.is_empty() || (level == 0 && lit.len() == points.len()))
                && lit.iter().all(|light| light.is_among(lights));
            if !fits || !mesh.points.add_cell(key, level, &points, lit.into_owned()) {
                return Err(damaged("a cell contradicts the others"));
            }
        }
        let count = mesh.points.len();
        if [states.len(), indirect.len(), received.len()] != [count; 3] || !mesh.points.set_parents(&parents)
        {
            return Err(damaged("not one value for each point"));
        }
        mesh.extend();
        mesh.states = states.into_owned();
        mesh.states.iter_mut().for_each(State::leave_view);
        (mesh.indirect, mesh.received) = (indirect.into_owned(), received.into_owned());
        Ok(mesh)
    }

    /// Takes over what is known at points of another mesh, of the same scene and settings, and unknown here. Returns the numbers that its points have
    /// here.
    pub(crate) fn absorb(&mut self, other: &Self) -> Vec<u32> {
        let numbers = self.points.absorb(&other.points);
        self.extend();
        for ((&number, theirs), (&indirect, &received)) in
            numbers.iter().zip(&other.states).zip(other.indirect.iter().zip(&other.received))
        {
            let index = number as usize;
            let Some(own) = self.states.get_mut(index) else { continue };
            if own.distance == 0.0 {
                own.distance = theirs.distance;
            }
            if theirs.solved && !own.solved {
                own.solved = true;
                self.indirect[index] = indirect;
            }
            if theirs.received && !own.received {
                own.received = true;
                self.received[index] = received;
            }
        }
        numbers
    }

    /// The records of the view, and how many surface points each is the nearest of.
    pub(crate) fn view_records(&self) -> Vec<(u32, u32)> {
        let stands_for = |number: &u32| self.states.get(*number as usize).map_or(0, |state| state.stands_for);
        self.records.iter().map(|number| (*number, stands_for(number))).collect()
    }

    /// Takes [records](Self::view_records) of the view from when it was needed before.
    pub(crate) fn need_again(&mut self, records: &[(u32, u32)]) {
        for &(number, stands_for) in records {
            if let Some(state) = self.states.get_mut(number as usize).filter(|state| state.stands_for == 0) {
                state.stands_for = stands_for.max(1);
                self.records.push(number);
            }
        }
    }
}
