//! `[[light]]`, `[[light_box]]`, `[[light_grid]]`, and the falloff.

use glam::Vec3;
use serde::Deserialize;
use toml::Spanned;

use super::place::Places;
use super::values::{Color, Count, Direction, Finite, Fraction, NonNegative, Point};
use crate::sampling::SplitMix64;
use crate::scene::load::LoadError;
use crate::scene::{Falloff, Light};
use crate::settings::named_enum;

/// Lights that one table may lay out.
const MAX_LIGHTS: u32 = 1_000_000;

/// `[[light]]`
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LightTable {
    position: Option<Point>,
    direction: Option<Direction>,
    cone: Option<[Finite; 2]>,
    intensity: Color,
}

/// `[[light_box]]`
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LightBoxTable {
    min: Point,
    max: Point,
    count: Count<MAX_LIGHTS>,
    #[serde(default)]
    seed: u32,
    intensity: Option<Color>,
    total_intensity: Option<Color>,
    color_variation: Option<Fraction>,
}

/// `[[light_grid]]`
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LightGridTable {
    min: Point,
    max: Point,
    counts: [Count<MAX_LIGHTS>; 3],
    intensity: Option<Color>,
    total_intensity: Option<Color>,
}

named_enum! {
    /// `falloff`
    pub enum FalloffName {
        /// c + t, the paper's
        Linear = "linear",
        /// t²
        InverseSquare = "inverse-square",
        /// 1
        None = "none",
    }
}

/// φ1: `default` unless `falloff` or its constant are given; `None` where the two do not go together.
pub fn falloff(
    default: Falloff,
    name: Option<FalloffName>,
    constant: Option<NonNegative>,
) -> Option<Falloff> {
    let falloff = match name {
        None => default,
        Some(FalloffName::Linear) => Falloff::default(),
        Some(FalloffName::InverseSquare) => Falloff::InverseSquare,
        Some(FalloffName::None) => Falloff::None,
    };
    match (falloff, constant) {
        (falloff, None) => Some(falloff),
        (Falloff::Linear { .. }, Some(constant)) => Some(Falloff::Linear { constant: constant.0 }),
        _ => None,
    }
}

impl LightTable {
    /// The light: a position makes a point light, a direction a directional one, both together a spot.
    pub fn light(table: &Spanned<Self>, index: usize, places: &Places) -> Result<Light, LoadError> {
        let error = |problem: &str| Err(places.error(&table.span(), &format!("light[{index}]"), problem));
        let Self { position, direction, cone, intensity } = table.get_ref();
        if cone.is_some() && (position.is_none() || direction.is_none()) {
            return error("cone needs position and direction");
        }
        let [inner, outer] = cone.map_or([0.0, 45.0], |cone| cone.map(|angle| angle.0));
        let intensity = intensity.0;
        match (position.map(|position| position.0), direction.map(|direction| direction.0)) {
            _ if !(0.0 <= inner && inner <= outer && outer <= 90.0) => {
                error("cone takes two angles with 0 ≤ inner ≤ outer ≤ 90")
            }
            (None, None) => error("needs a position or a direction"),
            (Some(position), None) => Ok(Light::point(position, intensity)),
            (Some(position), Some(direction)) => {
                Ok(Light::spot(position, direction, [inner, outer], intensity))
            }
            (None, Some(direction)) => Ok(Light::directional(direction, intensity)),
        }
    }
}

/// E_i of one of `count` lights.
fn each(
    intensity: Option<Color>,
    total: Option<Color>,
    count: u32,
    error: impl Fn(&str) -> LoadError,
) -> Result<Vec3, LoadError> {
    match (intensity, total) {
        (Some(each), None) => Ok(each.0),
        (None, Some(total)) => Ok(total.0 / count as f32),
        _ => Err(error("exactly one of intensity and total_intensity is required")),
    }
}

fn check_box(min: Vec3, max: Vec3, error: impl Fn(&str) -> LoadError) -> Result<(), LoadError> {
    if !(max - min).is_finite() {
        return Err(error("the box from min to max is too large"));
    }
    if min.cmple(max).all() { Ok(()) } else { Err(error("min must not exceed max in any component")) }
}

impl LightBoxTable {
    /// Lights at random positions: per light, x, y and z are drawn, then three factors of the colour
    /// if that varies.
    pub fn lights(
        table: &Spanned<Self>,
        index: usize,
        places: &Places,
    ) -> Result<impl Iterator<Item = Light> + use<>, LoadError> {
        let error = |problem: &str| places.error(&table.span(), &format!("light_box[{index}]"), problem);
        let table = table.get_ref();
        let (min, max) = (table.min.0, table.max.0);
        check_box(min, max, error)?;
        let each = each(table.intensity, table.total_intensity, table.count.0, error)?;
        let variation = table.color_variation.map(|fraction| fraction.0).filter(|&fraction| fraction > 0.0);
        let mut random = SplitMix64::new(u64::from(table.seed));
        Ok((0..table.count.0).map(move |_| {
            let position = random.in_box(min, max);
            let tint =
                variation.map_or(Vec3::ONE, |v| random.in_box(Vec3::splat(1.0 - v), Vec3::splat(1.0 + v)));
            Light::point(position, each * tint)
        }))
    }
}

impl LightGridTable {
    /// Lights at the centres of the cells that the box is divided into; x runs fastest, z slowest.
    pub fn lights(
        table: &Spanned<Self>,
        index: usize,
        places: &Places,
    ) -> Result<impl Iterator<Item = Light> + use<>, LoadError> {
        let error = |problem: &str| places.error(&table.span(), &format!("light_grid[{index}]"), problem);
        let table = table.get_ref();
        let (min, max) = (table.min.0, table.max.0);
        check_box(min, max, error)?;
        let [nx, ny, nz] = table.counts.map(|count| count.0);
        let count = u64::from(nx) * u64::from(ny) * u64::from(nz);
        let Some(count) = u32::try_from(count).ok().filter(|&count| count <= MAX_LIGHTS) else {
            return Err(error(&format!("counts make more than {MAX_LIGHTS} lights")));
        };
        let each = each(table.intensity, table.total_intensity, count, error)?;
        let cells = Vec3::new(nx as f32, ny as f32, nz as f32);
        Ok((0..count).map(move |i| {
            let cell = Vec3::new((i % nx) as f32, (i / nx % ny) as f32, (i / nx / ny) as f32);
            let position = min + (max - min) * ((cell + 0.5) / cells);
            Light::point(position, each)
        }))
    }
}
