//! Shading with few lights against shading with many.

use super::configuration::Configuration;
use super::report::{Aim, Goal, Report, Table};
use super::setup::{Setup, forest};
use super::{BenchError, BenchOptions};
use crate::render::Session;
use crate::scene::Camera;
use crate::settings::Settings;

/// What shading with many lights may take at most, over shading with few.
const GOAL: f64 = 1.2;

/// A forest with light meshes whose points are all known.
struct Warm {
    session: Session,
    camera: Camera,
    settings: Settings,
}

impl Warm {
    fn new(
        triangles: u32,
        lights: u32,
        configuration: &Configuration,
        side: u32,
        options: &BenchOptions,
    ) -> Result<Self, BenchError> {
        let Setup { scene, camera, settings, .. } = forest(triangles, lights)?;
        let settings = configuration.settings(&settings, (side, side));
        let mut warm = Self { session: Session::new(scene, options.backend)?, camera, settings };
        warm.shade()?;
        Ok(warm)
    }

    /// Seconds that shading takes in one frame.
    fn shade(&mut self) -> Result<f64, BenchError> {
        let (_, stats) = self.session.render(&self.camera, &self.settings)?;
        Ok(stats.seconds.shade)
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
    let times = options.budget().often().alternate(2, |variant| forests[variant].shade())?;
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
