//! Shading with few lights against shading with many.

use super::configuration::Configuration;
use super::report::{Aim, Goal, Report, Table};
use super::setup::{Setup, forest};
use super::{BenchError, BenchOptions};
use crate::accel::Backend;
use crate::render::{LightMeshes, render_light_mesh};
use crate::settings::Settings;

/// What shading with many lights may take at most, over shading with few.
const GOAL: f64 = 1.2;

/// A forest with light meshes whose points are all known.
struct Warm {
    setup: Setup,
    settings: Settings,
    backend: Backend,
    meshes: LightMeshes,
}

impl Warm {
    fn new(
        triangles: u32,
        lights: u32,
        configuration: &Configuration,
        side: u32,
        options: &BenchOptions,
    ) -> Result<Self, BenchError> {
        let setup = forest(triangles, lights)?;
        let settings = configuration.settings(&setup.settings, (side, side));
        let backend = Backend::build(options.backend, &setup.scene)?.backend;
        let meshes = LightMeshes::new(&setup.scene, &settings)?;
        let mut warm = Self { setup, settings, backend, meshes };
        warm.shade();
        Ok(warm)
    }

    /// Seconds that shading takes in one frame.
    fn shade(&mut self) -> f64 {
        let Self { setup: Setup { scene, camera, .. }, settings, backend, meshes } = self;
        let (_, stats) = render_light_mesh(backend, scene, camera, settings, meshes, &());
        stats.seconds.shade
    }
}

/// Times shading with `few` and with `many` lights in turn. The meshes are kept from frame to frame: to evaluate them
/// takes a hundred times as long with many lights.
pub fn measure(
    triangles: u32,
    [few, many]: [u32; 2],
    configuration: &Configuration,
    side: u32,
    options: &BenchOptions,
    report: &mut Report,
) -> Result<(), BenchError> {
    let warm = |lights| Warm::new(triangles, lights, configuration, side, options);
    let mut forests = [warm(few)?, warm(many)?];
    let times =
        options.budget().often().alternate(2, |variant| Ok::<_, BenchError>(forests[variant].shade()))?;
    let mut table = Table::new(
        format!("Shading with lights that are known at the mesh points, {side}×{side}"),
        &["lights", "seconds"],
    );
    let mut medians = [0.0; 2];
    for ((median, times), lights) in medians.iter_mut().zip(times).zip([few, many]) {
        *median = report.record(format!("directional shading: {lights} lights"), times);
        table.rows.push(vec![lights.to_string(), format!("{median:.4}")]);
    }
    report.tables.push(table);
    let [one, other] = medians;
    let name = format!("directional shading, {many} lights over {few}");
    report.goals.push(Goal::new(name, other / one, Aim::AtMost, GOAL));
    Ok(())
}
