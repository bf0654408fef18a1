//! A set of mesh points together with what a surface point takes from it.

use glam::Vec3;

use super::lattice::Lattice;
use super::neighbours::{Ball, Neighbours};
use super::store::{PointMask, SlotTable, UNKNOWN};
use crate::scene::{Bounds, SurfacePoint};
use crate::settings::{Neighbourhood, PointSettings, Radius, Spacing};

/// How often the points of a light mesh were asked for and evaluated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct PointCounters {
    /// Points of the whole set.
    pub total: u64,
    /// Points that lay in the neighbourhood of some surface point, summed over image blocks.
    pub needed: u64,
    /// Points that got a value; never more than once each.
    pub evaluated: u64,
    /// Surface points whose neighbourhood was empty and fell back to the nearest point.
    pub nearest_fallback: u64,
}

/// Mesh points, their slots, and the shape of D_y.
pub struct MeshPoints {
    lattice: Lattice,
    table: SlotTable,
    radius: f32,
    neighbourhood: Neighbourhood,
    hemisphere: bool,
    /// Counters since creation.
    pub counters: PointCounters,
}

/// With `spacing = "auto"` the scene's diagonal is this many spacings long.
const AUTO_SPACINGS: f32 = 120.0;

/// Why a light mesh can't be set up.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// Spacing below what coordinates can express.
    #[error("light_mesh.spacing: {0} is too fine for a scene of this size")]
    TooFine(Vec3),
}

impl MeshPoints {
    /// The points that `settings` ask for over a scene of the given bounds, all unknown.
    pub fn new(bounds: Bounds, settings: &PointSettings) -> Result<Self, MeshError> {
        let spacing = match settings.spacing {
            Spacing::Units(spacing) => spacing,
            Spacing::Auto => {
                let diagonal = bounds.extent().length();
                Vec3::splat(if diagonal > 0.0 { diagonal / AUTO_SPACINGS } else { 1.0 })
            }
        };
        let radius = match settings.radius {
            Radius::Units(radius) => radius,
            Radius::Spacings(factor) => factor * spacing.max_element(),
        };
        if Lattice::too_fine(bounds, spacing) {
            return Err(MeshError::TooFine(spacing));
        }
        let lattice = Lattice::new(bounds, spacing, radius);
        let table = SlotTable::new(lattice.brick_count());
        let counters = PointCounters { total: lattice.len(), ..PointCounters::default() };
        Ok(Self {
            lattice,
            table,
            radius,
            neighbourhood: settings.neighbourhood,
            hemisphere: settings.hemisphere,
            counters,
        })
    }

    /// D_y of a surface point with weights, in a fixed order; returns whether it was empty and the nearest
    /// point took its place. Never empty afterwards.
    #[inline(always)]
    pub fn neighbours(&self, surface: &SurfacePoint, out: &mut Neighbours) -> bool {
        out.clear();
        let normal = self.hemisphere.then_some(surface.geometric_normal);
        let smooth = self.neighbourhood == Neighbourhood::SmoothSphere;
        let ball = Ball::new(surface.position, normal, self.radius, smooth);
        if self.neighbourhood != Neighbourhood::Nearest {
            self.lattice.gather(&ball, out);
        }
        let fallback = out.is_empty();
        if fallback {
            out.push(self.lattice.nearest(&ball), 1.0);
        }
        fallback && self.neighbourhood != Neighbourhood::Nearest
    }

    /// Makes the needed points known; returns the positions of those that were not, in slot order.
    pub fn claim(&mut self, needed: &PointMask) -> Vec<Vec3> {
        let new = self.table.claim(needed);
        self.counters.needed += needed.len();
        self.counters.evaluated += new.len() as u64;
        new.into_iter().map(|id| self.lattice.position(id)).collect()
    }

    /// Slot of a known point.
    #[inline(always)]
    pub fn slot(&self, id: u64) -> u32 {
        let slot = self.table.slot(id);
        debug_assert_ne!(slot, UNKNOWN, "a point that is used was never claimed");
        slot
    }

    /// Number of known points.
    pub fn known(&self) -> usize {
        self.table.used()
    }

    /// R, scene units.
    pub fn radius(&self) -> f32 {
        self.radius
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        self.table.memory_bytes()
    }
}
