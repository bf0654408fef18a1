//! Measuring: what probes receive from lights and from surfaces.

use std::f32::consts::PI;

use glam::Vec3;
use rayon::prelude::*;

use super::direct::MeasureDirect;
use super::gather::Gather;
use super::harmonics::COEFFICIENTS;
use super::probes::Probe;
use super::sensor::{Sensor, Values};
use super::station::Station;
use crate::render::{RenderError, Session};
use crate::scene::Scene;
use crate::settings::Settings;
use crate::simd::vectorize;

/// How probes measure, beside a render's settings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProbeSettings {
    /// Rays from each probe that gather light of surfaces, 1 to [`ProbeSettings::MOST_DIRECTIONS`].
    pub directions: u32,
}

/// About how often it is said how many probes are measured, unless they are so many that threads would wait for each other's last ones.
const REPORTS: usize = 1000;
/// Probes that a thread measures before it says so, at most.
const MOST_TOGETHER: usize = 64;

impl ProbeSettings {
    /// More make no difference in single precision.
    pub const MOST_DIRECTIONS: u32 = 1 << 20;
}

impl Default for ProbeSettings {
    fn default() -> Self {
        Self { directions: 1024 }
    }
}

/// What probes measure, linear RGB: irradiance for a probe with a normal, fluence for one without. The direct part of fluence is DirectLight(x) of
/// eq. (1).
///
/// Light of surfaces and of the background is added where the settings have indirect light, whatever its form: it is gathered at each probe.
/// Under the preset `physical` values are in W/m² if lengths are metres and intensities W/sr. Otherwise they are what the renderer multiplies by
/// k_d: light from surfaces is an integral over directions, divided by π.
///
/// `done` is called with the numbers of probes that are measured, some at a time, in any order and from any thread.
///
/// # Errors
/// [`RenderError::Settings`] and [`RenderError::Mesh`].
pub fn measure(
    session: &Session,
    probes: &[Probe],
    settings: &Settings,
    how: &ProbeSettings,
    done: &(dyn Fn(usize) + Sync),
) -> Result<Vec<Vec3>, RenderError> {
    let size = size_of_scene(session.scene());
    let station = |probe: &Probe| Station::new(probe.position, Sensor::of(probe), size);
    run(session, probes.iter().map(station).collect(), settings, how, done, |[value, ..]| value)
}

/// Coefficients of the radiance that arrives at positions from all directions, in the basis of [`basis`](super::basis). `done` is called as by
/// [`measure`].
///
/// # Errors
/// As [`measure`].
pub fn measure_harmonics(
    session: &Session,
    positions: &[Vec3],
    settings: &Settings,
    how: &ProbeSettings,
    done: &(dyn Fn(usize) + Sync),
) -> Result<Vec<[Vec3; COEFFICIENTS]>, RenderError> {
    let station = |position: &Vec3| Station::new(*position, Sensor::Harmonics, 0.0);
    run(session, positions.iter().map(station).collect(), settings, how, done, |values| values)
}

fn size_of_scene(scene: &Scene) -> f32 {
    let bounds = scene.bounds();
    if scene.triangle_count() == 0 {
        return 0.0;
    }
    bounds.min.abs().max(bounds.max.abs()).max_element() + bounds.extent().max_element()
}

/// Measures at all stations; `take` says what of it is kept.
fn run<T: Send>(
    session: &Session,
    stations: Vec<Station>,
    settings: &Settings,
    how: &ProbeSettings,
    done: &(dyn Fn(usize) + Sync),
    take: impl Fn(Values) -> T + Sync,
) -> Result<Vec<T>, RenderError> {
    settings.check()?;
    let world = session.world(settings);
    let directions = how.directions.clamp(1, ProbeSettings::MOST_DIRECTIONS);
    let gather = match &settings.mesh.indirect {
        Some(indirect) => Some(Gather::new(world, settings, indirect, directions, &stations)?),
        None => None,
    };
    // What k_d is multiplied by has radiance in it over π, direct light over what its scale says.
    let scale = 1.0 / (PI * settings.shading.direct_scale());
    let measure = |station: &Station| {
        let mut values = Values::default();
        if let Some(gather) = &gather {
            gather.add(station, &mut values);
            values.iter_mut().for_each(|value| *value *= scale);
        }
        let &Station { position, origin, sensor } = station;
        vectorize(MeasureDirect { world, sensor, position, origin, values: &mut values });
        take(values)
    };
    // Some at a time, where there are many: a report may wait for another one.
    let together = (stations.len() / REPORTS).clamp(1, MOST_TOGETHER);
    let measure_some = |stations: &[Station]| {
        let values: Vec<T> = stations.iter().map(measure).collect();
        done(values.len());
        values
    };
    Ok(stations.par_chunks(together).flat_map_iter(measure_some).collect())
}
