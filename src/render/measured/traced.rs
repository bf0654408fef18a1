//! Traced shadow edges as good as they were asked for: blocks that are held out tell whether more rays are needed.

use super::mean;
use crate::accel::Accel;
use crate::image::Image;
use crate::render::accuracy::{Accuracy, Ending, ErrorEstimate, Measure};
use crate::render::error::RenderError;
use crate::render::fixed::View;
use crate::render::held_out::{HeldOut, Pixels};
use crate::render::integrators::ConventionalIntegrator;
use crate::render::meshes::LightMeshes;
use crate::render::stats::{RenderStats, timed};
use crate::render::surface_light::{SurfaceLight, WithSurfaceLight};
use crate::settings::{Integrator, Settings};

/// Rays that measuring the error may take, as a share of all rays.
const MEASURED: f64 = 0.08;

/// Blocks that are held out at least, and at most, and their side: their pixels share what is found at edges of shadows.
const BLOCKS: (usize, usize) = (32, 1024);
const BLOCK: u32 = 8;
/// Blocks that are shaded before the rays are counted.
const BATCH: usize = 16;

/// What the tolerance of hybrid shadows is multiplied by, and how often, before all rays are traced.
const STRICTER: f32 = 0.25;
const STRICTER_TIMES: u32 = 2;

impl<A: Accel> View<'_, A> {
    /// Traced shadow edges: what a picture got wrong is found at blocks that are held out; one that is not good enough is made again with more
    /// rays, at last with all.
    pub(super) fn render_traced(
        &self,
        mut settings: Settings,
        asked: f32,
        meshes: &mut LightMeshes,
    ) -> Result<(Image, RenderStats), RenderError> {
        let mut truth: Option<Truth> = None;
        let mut before: Option<(Image, RenderStats)> = None;
        let may_change = settings.shading.integrator == Integrator::Auto;
        for attempt in 0.. {
            let rendered = self.render_fixed(&settings, meshes);
            let (image, mut stats) = match self.or_before(rendered, before.take())? {
                ended @ (_, RenderStats { accuracy: Some(_), .. }) => return Ok(ended),
                rendered => rendered,
            };
            if stats.integrator == Some(Integrator::Conventional) {
                stats.accuracy =
                    Some(Accuracy { asked, found: None, ending: Ending::Exact, rays_for_half: None });
                return Ok((image, stats));
            }
            let mut seconds = 0.0;
            let found = timed(&mut seconds, || {
                let truth = match &mut truth {
                    Some(truth) => truth,
                    None => truth.insert(self.find_truth(&settings, meshes, &stats)?),
                };
                let shown = truth.held_out.of_image(&image);
                let errors =
                    truth.held_out.errors(&shown, &truth.pixels, |difference| difference.abs().element_sum());
                Ok::<_, RenderError>(ErrorEstimate::of(
                    &errors,
                    Measure::Absolute,
                    Some(mean(&image)),
                    truth.rays,
                ))
            });
            let (found, ended) = self.or_unmeasured(found)?;
            // The checks of hybrid shadows lie all over the picture, between the blocks as well.
            let found = found.map(|found| found.if_nothing_is_found(stats.hybrid_error.share()));
            stats.seconds.check += seconds;
            let within = found.is_none_or(|found| found.is_within(asked));
            let (width, height) = settings.view.resolution;
            let pixels = f64::from(width) * f64::from(height);
            let per_pixel = |found: ErrorEstimate| found.rays as f64 / found.pixels.max(1) as f64;
            let rays_for_half = found.map(|found| (per_pixel(found) * pixels) as u64);
            let ending = ended.unwrap_or(if within { Ending::Error } else { Ending::Settings });
            stats.accuracy = Some(Accuracy { asked, found, ending, rays_for_half });
            if within || attempt > STRICTER_TIMES || (attempt == STRICTER_TIMES && !may_change) {
                return Ok((image, stats));
            }
            if attempt == STRICTER_TIMES {
                settings.shading.integrator = Integrator::Conventional;
            } else {
                settings.shading.tolerance *= STRICTER;
            }
            before = Some((image, stats));
        }
        Err(RenderError::Stopped)
    }

    /// Blocks as `conventional` shades them, with the indirect light of the picture.
    fn find_truth(
        &self,
        settings: &Settings,
        meshes: &mut LightMeshes,
        stats: &RenderStats,
    ) -> Result<Truth, RenderError> {
        let world = self.world;
        let interpolation = meshes.interpolation(world.scene, self.camera, settings)?;
        let indirect = meshes.indirect.as_ref().zip(interpolation.indirect.as_ref());
        let indirect = indirect.map(|(mesh, interpolation)| mesh.view(interpolation));
        let direct = ConventionalIntegrator { world, scale: settings.shading.direct_scale(), indirect };
        let surface = meshes.surface.as_ref().map(|mesh| SurfaceLight::new(world.accel, mesh, settings));
        let integrator = WithSurfaceLight { direct, surface };
        let budget = MEASURED * (stats.rays.camera + stats.rays.shadow + stats.rays.indirect) as f64;
        let frame = self.frame(settings);
        let mut truth =
            Truth { held_out: HeldOut::new(&frame, BLOCK, BLOCKS.1), pixels: Vec::new(), rays: 0 };
        while !truth.held_out.is_traced() && (truth.pixels.len() < BLOCKS.0 || (truth.rays as f64) < budget) {
            truth.held_out.trace(&frame, BATCH)?;
            let (mut pixels, rays) = truth.held_out.shaded(&integrator, truth.pixels.len()..usize::MAX);
            truth.pixels.append(&mut pixels);
            truth.rays += rays;
        }
        Ok(truth)
    }
}

/// Parts of a picture, and how they should look.
struct Truth {
    held_out: HeldOut,
    /// Of the first parts.
    pixels: Pixels,
    rays: u64,
}
