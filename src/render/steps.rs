//! From settings that leave things open to a picture: whole pictures one after the other, each better than the one before, until one is good
//! enough or the time is over (method §10).

use std::time::Instant;

use super::accuracy::Accuracy;
use super::error::RenderError;
use super::fixed::View;
use super::frame::Purpose;
use super::meshes::LightMeshes;
use super::stats::RenderStats;
use crate::accel::Accel;
use crate::image::Image;
use crate::settings::{
    Integrator, Leaks, Neighbourhood, PointLayout, Radius, Resolve, Settings, Spacing, Step, Steps,
};

impl<A: Accel> View<'_, A> {
    /// Renders as the limits of the settings ask for.
    ///
    /// # Errors
    /// See [`RenderError`].
    pub fn render(
        &self,
        settings: &Settings,
        meshes: &mut LightMeshes,
    ) -> Result<(Image, RenderStats), RenderError> {
        // Before anything is tried: bits belong to the lights that they are of.
        meshes.renew_lights(self.world.lights);
        let limits = &settings.limits;
        let whole = (!self.is_local(settings)).then(|| self.whole(settings));
        let purpose = if whole.is_some() { Purpose::Image } else { self.purpose };
        let deadline = limits.time.and_then(|time| Instant::now().checked_add(time));
        let list = match &limits.steps {
            Steps::List(list) => &list[..],
            Steps::Count(_) => &[],
        };
        let steps = limits.steps.pictures();
        // Who is short of time needs a first picture soon.
        let steps = if deadline.is_some() { steps.max(2) } else { steps };
        let asked = limits.max_error.unwrap_or(0.0);
        let settings = whole.as_ref().unwrap_or(settings);
        let mut best: Option<(Image, RenderStats)> = None;
        for step in 1..=steps {
            let last = step == steps;
            // The first picture is finished in any case.
            let stop = self.stop.with_deadline(deadline.filter(|_| best.is_some()));
            let view = View { stop: &stop, purpose, ..*self };
            let rendered = if last {
                view.render_measured(settings, asked, meshes)
            } else {
                // Indirect light isn't shown yet; what is known of it stays for the last picture.
                let indirect = meshes.set_indirect_aside();
                let coarse = match list.get(step as usize - 1) {
                    Some(listed) => Ok(by_step(settings, listed)),
                    None => view.coarser(settings, steps - step, step == 1, meshes),
                };
                let rendered = coarse.and_then(|coarse| view.render_fixed(&coarse, meshes));
                meshes.put_indirect_back(indirect);
                rendered
            };
            match (rendered, best.take()) {
                (Ok((image, mut stats)), before) => {
                    if let Some((_, before)) = before {
                        stats.add_earlier(&before);
                    }
                    self.sink.picture(&image);
                    best = Some((image, stats));
                }
                (Err(error), Some((image, mut stats))) => {
                    let Some(ending) = view.ending_of(&error) else { return Err(error) };
                    stats.accuracy = Some(Accuracy { asked, found: None, ending, rays_for_half: None });
                    return Ok((image, stats));
                }
                (Err(error), None) => return Err(error),
            }
        }
        best.ok_or(RenderError::Stopped)
    }

    /// Whether part of a picture can be made without the rest of it: where nothing is measured, which takes all of it.
    fn is_local(&self, settings: &Settings) -> bool {
        let limits = &settings.limits;
        limits.steps.pictures() == 1
            && limits.time.is_none()
            && !self.is_measured(settings, limits.max_error.unwrap_or(0.0))
    }

    /// Settings for the whole picture.
    fn whole(&self, settings: &Settings) -> Settings {
        let mut settings = settings.clone();
        settings.view.crop = None;
        settings
    }

    /// Settings of a picture that comes some steps before the last: mesh points as often twice as far apart.
    fn coarser(
        &self,
        settings: &Settings,
        steps_left: u32,
        is_first: bool,
        meshes: &mut LightMeshes,
    ) -> Result<Settings, RenderError> {
        let mut settings = on_the_way(settings);
        if is_first {
            settings.shading.kernel.neighbourhood = Neighbourhood::Nearest;
        }
        if matches!(settings.mesh.direct.layout, PointLayout::List(_)) {
            return Ok(settings);
        }
        let neighbourhoods =
            meshes.interpolation(self.world.scene, self.camera, &settings)?.direct.neighbourhoods;
        let times = (1u32 << steps_left) as f32;
        settings.mesh.direct.spacing = Spacing::Units(times * neighbourhoods.spacing());
        settings.shading.kernel.radius = Radius::Units(times * neighbourhoods.radius());
        settings.mesh.direct.regions.clear();
        Ok(settings)
    }
}

/// Settings of any picture before the last: shadows without edges of their own, no light from surfaces.
fn on_the_way(settings: &Settings) -> Settings {
    let mut settings = settings.clone();
    settings.mesh.indirect = None;
    let shading = &mut settings.shading;
    if shading.integrator != Integrator::Reference {
        shading.integrator = Integrator::LightMesh;
    }
    shading.resolve = Resolve::Average;
    shading.kernel.leaks = Leaks::Allow;
    settings
}

/// Settings of a picture before the last that a list describes.
fn by_step(settings: &Settings, step: &Step) -> Settings {
    let mut settings = on_the_way(settings);
    let Settings { mesh, shading, .. } = &mut settings;
    if let Some(spacing) = step.spacing {
        mesh.direct.spacing = Spacing::Units(spacing);
        // Boxes with finer points of their own would make a coarse picture a slow one.
        mesh.direct.regions.clear();
    }
    if let Some(radius) = step.radius {
        shading.kernel.radius = Radius::Units(radius);
    }
    shading.kernel.neighbourhood = step.neighbourhood.unwrap_or(shading.kernel.neighbourhood);
    settings
}
