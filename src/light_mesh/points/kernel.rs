//! The interpolation kernel: R, the half-ball, and weights (method §3).

use glam::Vec3;

/// Share of R over which smooth weights rise from 0 at the plane of the hemisphere: without it points would enter and
/// leave with a step wherever the normal turns.
const RAMP: f32 = 0.25;

/// The interpolation kernel around y: a ball of radius R, or the half of it in front of a surface, with a weight for each
/// position. Mesh points of weight above 0 make up D_y.
#[derive(Clone, Copy, Debug)]
pub struct Kernel {
    /// y.
    pub center: Vec3,
    /// R.
    pub radius: f32,
    /// Normal of the plane that cuts the ball; 0 for the whole ball.
    normal: Vec3,
    /// Height of y over that plane: 0, or huge for the whole ball.
    height: f32,
    smooth: bool,
    inverse_radius_squared: f32,
    inverse_ramp: f32,
}

impl Kernel {
    /// Ball of radius `radius` (> 0) around `center`; with `normal` (unit length), the half of it in
    /// front of the plane through its centre; `smooth` for weights that fall to 0 at R.
    #[inline(always)]
    pub fn new(center: Vec3, normal: Option<Vec3>, radius: f32, smooth: bool) -> Self {
        Self {
            center,
            radius,
            normal: normal.unwrap_or(Vec3::ZERO),
            height: if normal.is_some() { 0.0 } else { f32::MAX },
            smooth,
            inverse_radius_squared: 1.0 / (radius * radius),
            inverse_ramp: 1.0 / (RAMP * radius),
        }
    }

    /// The same ball around another centre, whole or cut.
    #[inline(always)]
    pub fn around(&self, center: Vec3, normal: Option<Vec3>) -> Self {
        let height = if normal.is_some() { 0.0 } else { f32::MAX };
        Self { center, normal: normal.unwrap_or(Vec3::ZERO), height, ..*self }
    }

    /// Whether a point is on the admitted side of the plane.
    #[inline(always)]
    pub fn admits(&self, point: Vec3) -> bool {
        self.normal.dot(point - self.center) + self.height >= 0.0
    }

    /// Weight of a point; `None` outside. See [`Kernel::weigh`].
    #[inline(always)]
    pub fn weight(&self, point: Vec3) -> Option<f32> {
        let d = point - self.center;
        let weight = self.weigh(d.x, self.row(d.y, d.z));
        (weight > 0.0).then_some(weight)
    }

    /// What the points of a row along x have in common, at offsets `dy` and `dz` from the centre: the squared distance
    /// and the height over the plane that y and z contribute.
    #[inline(always)]
    pub fn row(&self, dy: f32, dz: f32) -> (f32, f32) {
        (dy * dy + dz * dz, self.normal.y * dy + self.normal.z * dz + self.height)
    }

    /// Whether a row comes near enough to have points in the ball.
    #[inline(always)]
    pub fn reaches(&self, (distance_squared, _): (f32, f32)) -> bool {
        distance_squared * self.inverse_radius_squared < 1.0
    }

    /// Weight of the point at offset `dx` in a row: 1, or if smooth (1 − r²/R²)² times a ramp that starts at the plane;
    /// 0 outside.
    #[inline(always)]
    pub fn weigh(&self, dx: f32, (distance_squared, height): (f32, f32)) -> f32 {
        let falloff = 1.0 - (dx * dx + distance_squared) * self.inverse_radius_squared;
        let height = self.normal.x * dx + height;
        let ramp = height * self.inverse_ramp;
        let smooth = falloff * falloff * if ramp < 1.0 { ramp } else { 1.0 };
        let weight = if self.smooth { smooth } else { 1.0 };
        if falloff > 0.0 && height >= 0.0 { weight } else { 0.0 }
    }
}
