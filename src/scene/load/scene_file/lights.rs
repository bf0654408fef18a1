//! `[[light]]`, `[[light_box]]`, `[[light_grid]]`, and the falloff.

use std::f32::consts::PI;

use glam::Vec3;
use serde::Deserialize;
use toml::Spanned;

use super::place::Places;
use super::values::{Color, Count, Direction, Finite, Fraction, NonNegative, Point, Positive};
use crate::sampling::SplitMix64;
use crate::scene::load::LoadError;
use crate::scene::{Falloff, Light, Scene};
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
    radius: Option<Positive>,
    size: Option<[Positive; 2]>,
    up: Option<Direction>,
    visible: Option<bool>,
    intensity: Color,
    group: Option<String>,
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
    radius: Option<Positive>,
    visible: Option<bool>,
    group: Option<String>,
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
    radius: Option<Positive>,
    visible: Option<bool>,
    group: Option<String>,
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
    /// Adds the light: a position makes a point light, a direction a directional one, both together a spot; a radius makes a ball of the first and a
    /// disc of the last, and a size a rectangle.
    pub fn add(
        table: &Spanned<Self>,
        index: usize,
        places: &Places,
        scene: &mut Scene,
    ) -> Result<(), LoadError> {
        let error = |problem: &str| places.error(&table.span(), &format!("light[{index}]"), problem);
        let Self { position, direction, cone, radius, size, up, visible, intensity, group } = table.get_ref();
        let first = scene.lights.len();
        let is_placed = position.is_some() && direction.is_some();
        let problem = if cone.is_some() && !is_placed {
            Some("cone needs position and direction")
        } else if size.is_some() && !is_placed {
            Some("size needs position and direction")
        } else if [cone.is_some(), size.is_some(), radius.is_some()]
            .into_iter()
            .filter(|given| *given)
            .count()
            > 1
        {
            Some("radius, size and cone exclude each other")
        } else if radius.is_some() && position.is_none() {
            Some("radius needs a position")
        } else if up.is_some() && size.is_none() {
            Some("up belongs to a size")
        } else if visible.is_some() && direction.is_some() {
            Some("visible belongs to balls, which have no direction")
        } else if group.is_some() && direction.is_some() && (radius.is_some() || size.is_some()) {
            Some("group: discs and rectangles are emissive surfaces, whose light has no group")
        } else {
            None
        };
        if let Some(problem) = problem {
            return Err(error(problem));
        }
        let [inner, outer] = cone.map_or([0.0, 45.0], |cone| cone.map(|angle| angle.0));
        if !(0.0 <= inner && inner <= outer && outer <= 90.0) {
            return Err(error("cone takes two angles with 0 ≤ inner ≤ outer ≤ 90"));
        }
        let intensity = intensity.0;
        match (position.map(|position| position.0), direction.map(|direction| direction.0)) {
            (None, None) => return Err(error("needs a position or a direction")),
            (None, Some(direction)) => scene.lights.push(Light::directional(direction, intensity)),
            (Some(position), None) => {
                let lamp = PointOrBall::new(radius.as_ref(), *visible, intensity, error)?;
                lamp.add(scene, position, intensity);
            }
            (Some(position), Some(direction)) => match (radius, size) {
                (Some(radius), _) => {
                    check_radiance(intensity, PI * radius.0 * radius.0, error)?;
                    scene.add_disc(position, direction, radius.0, intensity);
                }
                (_, Some([width, height])) => {
                    check_radiance(intensity, width.0 * height.0, error)?;
                    let up = up.as_ref().map_or(Vec3::Y, |up| up.0);
                    let (u, v) = edges(direction.normalize_or(Vec3::NEG_Y), up);
                    scene.add_rectangle(position, u * width.0, v * height.0, intensity);
                }
                _ => scene.lights.push(Light::spot(position, direction, [inner, outer], intensity)),
            },
        }
        assign(group.as_deref(), first, scene, error)
    }
}

/// Puts the lights of a table, from the given one on, into its group.
fn assign(
    group: Option<&str>,
    first: usize,
    scene: &mut Scene,
    error: impl Fn(&str) -> LoadError,
) -> Result<(), LoadError> {
    let Some(group) = group else { return Ok(()) };
    let lights = first..scene.lights.len();
    scene
        .light_groups
        .assign(lights, group)
        .map_err(|problem| error(&format!("group = \"{group}\": {problem}")))
}

/// Unit vectors along width and height of a rectangle that shines along `direction`, of unit length; its height is as much along `up` as can
/// be.
fn edges(direction: Vec3, up: Vec3) -> (Vec3, Vec3) {
    match up.cross(direction).try_normalize() {
        Some(width) => (width, direction.cross(width)),
        None => direction.any_orthonormal_pair(),
    }
}

/// A point light, or a ball if it has a radius.
struct PointOrBall {
    radius: Option<f32>,
    visible: bool,
}

impl PointOrBall {
    /// With the keys of a table; `intensity` is that of its brightest light.
    fn new(
        radius: Option<&Positive>,
        visible: Option<bool>,
        intensity: Vec3,
        error: impl Fn(&str) -> LoadError,
    ) -> Result<Self, LoadError> {
        if visible.is_some() && radius.is_none() {
            return Err(error("visible needs a radius"));
        }
        let radius = radius.map(|radius| radius.0);
        if let Some(radius) = radius {
            check_radiance(intensity, PI * radius * radius, error)?;
        }
        Ok(Self { radius, visible: visible.unwrap_or(true) })
    }

    fn add(&self, scene: &mut Scene, position: Vec3, intensity: Vec3) {
        let Some(radius) = self.radius else {
            scene.lights.push(Light::point(position, intensity));
            return;
        };
        scene.lights.push(Light::ball(position, radius, intensity));
        if self.visible {
            scene.add_ball(position, radius, intensity);
        }
    }
}

/// A lamp shows the radiance that its intensity comes to.
fn check_radiance(intensity: Vec3, area: f32, error: impl Fn(&str) -> LoadError) -> Result<(), LoadError> {
    if (intensity / area).is_finite() && area.is_finite() {
        Ok(())
    } else {
        Err(error("the radiance, which is the intensity over the area, is beyond what a number holds"))
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
    /// Adds lights at random positions: per light, x, y and z are drawn, then three factors of the colour
    /// if that varies.
    pub fn add(
        table: &Spanned<Self>,
        index: usize,
        places: &Places,
        scene: &mut Scene,
    ) -> Result<(), LoadError> {
        let error = |problem: &str| places.error(&table.span(), &format!("light_box[{index}]"), problem);
        let table = table.get_ref();
        let (min, max) = (table.min.0, table.max.0);
        check_box(min, max, error)?;
        let each = each(table.intensity, table.total_intensity, table.count.0, error)?;
        let variation = table.color_variation.map(|fraction| fraction.0).filter(|&fraction| fraction > 0.0);
        let mut random = SplitMix64::new(u64::from(table.seed));
        let brightest = each * (1.0 + variation.unwrap_or(0.0));
        let lamp = PointOrBall::new(table.radius.as_ref(), table.visible, brightest, error)?;
        let first = scene.lights.len();
        for _ in 0..table.count.0 {
            let position = random.in_box(min, max);
            let tint =
                variation.map_or(Vec3::ONE, |v| random.in_box(Vec3::splat(1.0 - v), Vec3::splat(1.0 + v)));
            lamp.add(scene, position, each * tint);
        }
        assign(table.group.as_deref(), first, scene, error)
    }
}

impl LightGridTable {
    /// Adds lights at the centres of the cells that the box is divided into; x runs fastest, z slowest.
    pub fn add(
        table: &Spanned<Self>,
        index: usize,
        places: &Places,
        scene: &mut Scene,
    ) -> Result<(), LoadError> {
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
        let lamp = PointOrBall::new(table.radius.as_ref(), table.visible, each, error)?;
        let first = scene.lights.len();
        for i in 0..count {
            let cell = Vec3::new((i % nx) as f32, (i / nx % ny) as f32, (i / nx / ny) as f32);
            let position = min + (max - min) * ((cell + 0.5) / cells);
            lamp.add(scene, position, each);
        }
        assign(table.group.as_deref(), first, scene, error)
    }
}
