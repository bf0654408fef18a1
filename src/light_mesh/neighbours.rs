//! The neighbourhood D_y of a surface point, eq. (3) and spec §3.

use glam::Vec3;

/// Share of R over which smooth weights rise from 0 at the plane of the hemisphere: without it points would enter and
/// leave with a step wherever the normal turns.
const RAMP: f32 = 0.25;

/// Region of space whose mesh points make up D_y: a ball, or the half of it in front of a surface.
#[derive(Clone, Copy, Debug)]
pub struct Ball {
    /// y.
    pub center: Vec3,
    /// R.
    pub radius: f32,
    normal: Option<Vec3>,
    smooth: bool,
    inverse_radius_squared: f32,
    inverse_ramp: f32,
}

impl Ball {
    /// Ball of radius `radius` (> 0) around `center`; with `normal` (unit length), the half of it in
    /// front of the plane through its centre; `smooth` for weights that fall to 0 at R.
    #[inline(always)]
    pub fn new(center: Vec3, normal: Option<Vec3>, radius: f32, smooth: bool) -> Self {
        let inverse_radius_squared = 1.0 / (radius * radius);
        let inverse_ramp = 1.0 / (RAMP * radius);
        Self { center, radius, normal, smooth, inverse_radius_squared, inverse_ramp }
    }

    /// Whether a point is on the admitted side of the plane.
    #[inline(always)]
    pub fn admits(&self, point: Vec3) -> bool {
        self.normal.is_none_or(|n| n.dot(point - self.center) >= 0.0)
    }

    /// Weight of a point: 1, or if smooth (1 − r²/R²)² times a ramp that starts at the plane; `None` outside.
    #[inline(always)]
    pub fn weight(&self, point: Vec3) -> Option<f32> {
        let d = point - self.center;
        let falloff = 1.0 - d.length_squared() * self.inverse_radius_squared;
        let height = self.normal.map_or(f32::INFINITY, |n| n.dot(d));
        if falloff <= 0.0 || height < 0.0 {
            return None;
        }
        if !self.smooth {
            return Some(1.0);
        }
        let weight = falloff * falloff * (height * self.inverse_ramp).min(1.0);
        (weight > 0.0).then_some(weight)
    }
}

/// Mesh points with weights; the order is fixed by the point set, so that sums never depend on timing.
#[derive(Clone, Debug, Default)]
pub struct Neighbours {
    ids: Vec<u64>,
    weights: Vec<f32>,
}

impl Neighbours {
    /// Forgets all points.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.ids.clear();
        self.weights.clear();
    }

    /// Adds a point.
    #[inline(always)]
    pub fn push(&mut self, id: u64, weight: f32) {
        self.ids.push(id);
        self.weights.push(weight);
    }

    /// Adds `first` to all ids.
    pub fn offset_ids(&mut self, first: u64) {
        self.ids.iter_mut().for_each(|id| *id += first);
    }

    /// Whether there are none.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.ids.is_empty()
    }

    /// Points and weights.
    #[inline(always)]
    pub fn iter(&self) -> impl Iterator<Item = (u64, f32)> + '_ {
        self.ids.iter().copied().zip(self.weights.iter().copied())
    }
}
