//! Light sources and their falloff.

use glam::{Affine3A, DMat3, Vec3};
use serde::{Deserialize, Serialize};

/// Light i of eq. (1): a point light, or one of the two other kinds that models bring.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// lp_i; without meaning for directional lights.
    pub position: Vec3,
    /// E_i, linear RGB, ≥ 0.
    pub intensity: Vec3,
    /// Where the light goes.
    pub kind: LightKind,
}

/// Where the light of a [`Light`] goes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum LightKind {
    /// Everywhere alike: the paper's.
    #[default]
    Point,
    /// The same from a ball around the position: V_i is the part of it that is seen.
    Ball {
        /// Its radius, > 0.
        radius: f32,
    },
    /// Into a cone: E_i is multiplied by [`LightKind::cone_factor`], V_i and φ1 are a point light's.
    Spot {
        /// Axis of the cone, unit length.
        direction: Vec3,
        /// Cosine of the angle from the axis up to which the light is full.
        inner_cosine: f32,
        /// Cosine of the angle beyond which there is none; at most `inner_cosine`.
        outer_cosine: f32,
    },
    /// From infinitely far away: V_i is 0 where anything lies in the opposite of `direction`, however far, and φ1 is 1.
    Directional {
        /// The way the light travels, unit length.
        direction: Vec3,
    },
}

impl LightKind {
    /// Slope and offset such that clamp(slope · c + offset, 0, 1)² is the share of E_i at the angle of cosine c from
    /// the axis, as KHR_lights_punctual recommends.
    pub(crate) fn cone_terms(self) -> (f32, f32) {
        match self {
            Self::Spot { inner_cosine, outer_cosine, .. } => {
                // A cone without a soft rim still needs a finite slope.
                let slope = 1.0 / (inner_cosine - outer_cosine).max(1e-3);
                (slope, -outer_cosine * slope)
            }
            Self::Point | Self::Ball { .. } | Self::Directional { .. } => (0.0, 1.0),
        }
    }

    /// Share of E_i that goes along `direction` (unit length, away from the light).
    pub fn cone_factor(self, direction: Vec3) -> f32 {
        let Self::Spot { direction: axis, .. } = self else { return 1.0 };
        let (slope, offset) = self.cone_terms();
        let share = (slope * axis.dot(direction) + offset).clamp(0.0, 1.0);
        share * share
    }
}

impl Light {
    /// A light that shines everywhere alike.
    pub fn point(position: Vec3, intensity: Vec3) -> Self {
        Self { position, intensity, kind: LightKind::Point }
    }

    /// A ball that shines everywhere alike: `intensity` is its radiant intensity I, its radiance I/(π r²). It is seen and casts shadows if a
    /// mesh in its place is (see [`super::Scene::add_ball`]).
    pub fn ball(position: Vec3, radius: f32, intensity: Vec3) -> Self {
        Self { position, intensity, kind: LightKind::Ball { radius } }
    }

    /// A light that shines along `direction` (any length but 0): full up to the first of the angles of `cone` from there,
    /// none beyond the second; degrees.
    pub fn spot(position: Vec3, direction: Vec3, cone: [f32; 2], intensity: Vec3) -> Self {
        let [inner_cosine, outer_cosine] = cone.map(|angle| angle.to_radians().cos());
        let direction = unit(direction);
        Self { position, intensity, kind: LightKind::Spot { direction, inner_cosine, outer_cosine } }
    }

    /// The light in another place; its intensity stays whatever the scale.
    pub fn moved(&self, to_world: &Affine3A) -> Self {
        let turned = |direction: Vec3| to_world.transform_vector3(direction).normalize_or(direction);
        let kind = match self.kind {
            LightKind::Point => LightKind::Point,
            LightKind::Ball { radius } => {
                let Affine3A { matrix3, .. } = to_world;
                let columns = [matrix3.x_axis, matrix3.y_axis, matrix3.z_axis].map(|axis| axis.as_dvec3());
                let [x, y, z] = columns;
                let scale = DMat3::from_cols(x, y, z).determinant().abs().cbrt() as f32;
                LightKind::Ball { radius: radius * scale }
            }
            LightKind::Spot { direction, inner_cosine, outer_cosine } => {
                LightKind::Spot { direction: turned(direction), inner_cosine, outer_cosine }
            }
            LightKind::Directional { direction } => LightKind::Directional { direction: turned(direction) },
        };
        Self { position: to_world.transform_point3(self.position), kind, ..*self }
    }

    /// A light from infinitely far away that travels along `direction` (any length but 0).
    pub fn directional(direction: Vec3, intensity: Vec3) -> Self {
        let kind = LightKind::Directional { direction: unit(direction) };
        Self { position: Vec3::ZERO, intensity, kind }
    }
}

/// The direction of a vector, in double precision since squares of single ones may be 0 or infinite; 0 for 0.
fn unit(vector: Vec3) -> Vec3 {
    vector.as_dvec3().normalize_or_zero().as_vec3()
}

/// φ1(t), what intensities are divided by at distance t.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Falloff {
    /// c + t, the paper's.
    Linear {
        /// c ≥ 0.
        constant: f32,
    },
    /// t², clamped below at t = [`Falloff::MIN_DISTANCE`].
    InverseSquare,
    /// 1: no falloff.
    None,
}

impl Default for Falloff {
    fn default() -> Self {
        Self::Linear { constant: 1.0 }
    }
}

impl Falloff {
    /// Below this distance, in scene units, `inverse-square` grows no further: a mesh point that
    /// happens to sit on a light must stay finite.
    pub const MIN_DISTANCE: f32 = 1e-3;

    /// 1/φ1 at distance `t`.
    #[inline(always)]
    pub fn reciprocal(self, t: f32) -> f32 {
        match self {
            // A light with c = 0 at t = 0 is clamped as in the inverse-square case.
            Self::Linear { constant } => 1.0 / (constant + t).max(Self::MIN_DISTANCE),
            Self::InverseSquare => {
                let t = t.max(Self::MIN_DISTANCE);
                1.0 / (t * t)
            }
            Self::None => 1.0,
        }
    }
}
