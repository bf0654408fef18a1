//! Pictures as good as they were asked for: what is wrong is measured at parts that are held out (method §10).

use glam::Vec3;

use super::accuracy::{Accuracy, Ending, ErrorEstimate, Measure, PartError};
use super::error::RenderError;
use super::fixed::View;
use super::held_out::{HeldOut, Pixels};
use super::integrators::{ConventionalIntegrator, LightMeshIntegrator, ReferenceIntegrator};
use super::meshes::{LightMeshes, MeshInterpolation};
use super::need::needed_points;
use super::stats::{RenderStats, timed};
use super::surface_light::{SurfaceLight, WithSurfaceLight};
use crate::accel::Accel;
use crate::image::Image;
use crate::settings::{
    Estimator, IndirectForm, Integrator, Neighbourhood, PointLayout, Radius, Resolve, Settings, Spacing,
};

/// Where the points of the other mesh lie, in spacings: far from all points of a regular mesh and from the centres of its cells.
const SHIFT: Vec3 = Vec3::new(0.27, 0.72, 0.23);

/// Rays that measuring the error may take where shadows are averaged, as a share of the camera rays, since those of the mesh aren't known yet, and
/// what is always spent, with which a frame of a tenth of a second says something about itself: they cost four times as much as camera rays.
const MEASURED_BY_CAMERA: f64 = 0.02;
const FEWEST_RAYS: f64 = 5e4;

/// The same where shadows are traced, as a share of all rays.
const MEASURED: f64 = 0.08;

/// Parts that are held out at least, and at most: pixels where shadows are soft, and blocks where they are traced, whose pixels share
/// what is found at edges of shadows.
const PIXELS: (usize, usize) = (96, 2048);
const BLOCKS: (usize, usize) = (32, 1024);
const BLOCK: u32 = 8;
/// Blocks that are shaded before the rays are counted.
const BATCH: usize = 16;

/// Spacings that are tried are R times powers of 2, this many to an octave, down to R/4: already there a surface point has some 130 points to weigh, which
/// takes longer than conventional tracing unless lights are many, and memory for the points grows eightfold with each further octave. Who wants a finer
/// mesh than that can name its spacing.
const STEPS_PER_OCTAVE: f32 = 3.0;
const FINEST: u32 = 6;

/// The error falls with about this power of the spacing, by what `lightmesh bench` finds on the forest; the first guess leaves some room for the
/// uncertainty of what is measured.
const ORDER: f32 = 1.9;
const HEADROOM: f32 = 1.25;

/// Pictures that are made at most, should the brightest pixels be worse than those all over the picture.
const MOST_PICTURES: u32 = 2;

/// Mesh points by which the error is halved: 2^(3/[`ORDER`]).
const POINTS_FOR_HALF: u64 = 3;

/// What the tolerance of hybrid shadows is multiplied by, and how often, before all rays are traced.
const STRICTER: f32 = 0.25;
const STRICTER_TIMES: u32 = 2;

impl<A: Accel> View<'_, A> {
    /// Renders with an error of at most `asked`, if it is above 0 and can be measured.
    pub(super) fn render_measured(
        &self,
        settings: &Settings,
        asked: f32,
        meshes: &mut LightMeshes,
    ) -> Result<(Image, RenderStats), RenderError> {
        let shading = &settings.shading;
        let is_linear = matches!(shading.estimator, Estimator::PerLight | Estimator::Directional);
        let is_mesh = matches!(shading.integrator, Integrator::Auto | Integrator::LightMesh);
        if asked <= 0.0 || self.world.lights.is_empty() || !is_linear || !is_mesh {
            let (image, mut stats) = self.render_fixed(settings, meshes)?;
            if asked > 0.0 {
                let exact = shading.integrator == Integrator::Conventional || self.world.lights.is_empty();
                let ending = if exact { Ending::Exact } else { Ending::Settings };
                stats.accuracy = Some(Accuracy { asked, found: None, ending, rays_for_half: None });
            }
            return Ok((image, stats));
        }
        if shading.resolve == Resolve::Trace && shading.estimator == Estimator::PerLight {
            self.render_traced(settings.clone(), asked, meshes)
        } else {
            self.render_averaged(settings.clone(), asked, meshes)
        }
    }

    /// Averaged shadows: the coarsest mesh that is good enough at pixels that are held out makes the picture.
    fn render_averaged(
        &self,
        mut settings: Settings,
        asked: f32,
        meshes: &mut LightMeshes,
    ) -> Result<(Image, RenderStats), RenderError> {
        let mut open = self.open_spacing(&mut settings, meshes)?;
        let mut before: Option<(Image, RenderStats)> = None;
        for pictures in 1.. {
            let mut trial = RenderStats::default();
            let mut seconds = 0.0;
            let chosen = timed(&mut seconds, || {
                self.choose_points(&mut settings, asked, &mut open, meshes, &mut trial)
            });
            let rendered = chosen.and_then(|()| self.render_fixed(&settings, meshes));
            let (image, mut stats) = match self.or_before(rendered, before.take())? {
                ended @ (_, RenderStats { accuracy: Some(_), .. }) => return Ok(ended),
                rendered => rendered,
            };
            let found = timed(&mut seconds, || {
                let count = self
                    .pixels_for(&meshes.interpolation(self.world.scene, self.camera, &settings)?, &settings);
                let mut held_out = HeldOut::by_brightness(&self.frame(&settings), &image, count)?;
                let errors = self.errors_of(&settings, &mut held_out, meshes, &mut trial)?;
                Ok::<_, RenderError>(errors.estimate(Some(mean(&image))))
            })?;
            stats.rays.add(&trial.rays);
            stats.mesh_points.direct.evaluated += trial.mesh_points.direct.evaluated;
            stats.seconds.check += seconds;
            // That the error is small enough was said with confidence before; brighter pixels would have to contradict it.
            let missed = found.filter(|found| found.error > asked);
            let ending = match (&mut open, missed) {
                (_, None) => Ending::Error,
                (None, _) => Ending::Settings,
                (Some(open), Some(missed)) => {
                    open.refine(missed.error / asked);
                    Ending::Finest
                }
            };
            let rays_for_half = Some(POINTS_FOR_HALF * stats.rays.shadow);
            stats.accuracy = Some(Accuracy { asked, found, ending, rays_for_half });
            let is_last = pictures >= MOST_PICTURES || open.as_ref().is_none_or(|open| open.step > FINEST);
            if ending != Ending::Finest || is_last {
                return Ok((image, stats));
            }
            before = Some((image, stats));
        }
        Err(RenderError::Stopped)
    }

    /// What was rendered, with what a picture before it took; or that picture, with how wrong it is, if there was no time for another one.
    fn or_before(
        &self,
        rendered: Result<(Image, RenderStats), RenderError>,
        before: Option<(Image, RenderStats)>,
    ) -> Result<(Image, RenderStats), RenderError> {
        match (rendered, before) {
            (Ok((image, mut stats)), Some((_, before))) => {
                stats.add_earlier(&before);
                Ok((image, stats))
            }
            (Err(RenderError::Stopped), Some((image, mut stats))) if self.stop.is_late() => {
                stats.accuracy.iter_mut().for_each(|accuracy| accuracy.ending = Ending::Time);
                Ok((image, stats))
            }
            (rendered, _) => rendered,
        }
    }

    /// What is to be found of a spacing that the settings leave open: R is what it would be for the automatic spacing.
    fn open_spacing(
        &self,
        settings: &mut Settings,
        meshes: &mut LightMeshes,
    ) -> Result<Option<OpenSpacing>, RenderError> {
        let points = &settings.mesh.direct;
        let by_direct = |form| form == IndirectForm::Scalar;
        let is_open = points.spacing == Spacing::Auto
            && points.layout == PointLayout::Regular
            && points.regions.is_empty()
            && settings.shading.kernel.neighbourhood != Neighbourhood::Nearest
            && !settings.mesh.indirect.as_ref().is_some_and(|indirect| by_direct(indirect.form));
        if !is_open {
            return Ok(None);
        }
        let radius =
            meshes.interpolation(self.world.scene, self.camera, settings)?.direct.neighbourhoods.radius();
        settings.shading.kernel.radius = Radius::Units(radius);
        let held_out = HeldOut::new(&self.frame(settings), 1, PIXELS.1);
        Ok(Some(OpenSpacing { radius, step: 0, held_out }))
    }

    /// Puts the coarsest points into the settings whose error at pixels all over the picture is within the limit, if their spacing is open. What is
    /// evaluated for that is part of the mesh.
    fn choose_points(
        &self,
        settings: &mut Settings,
        asked: f32,
        open: &mut Option<OpenSpacing>,
        meshes: &mut LightMeshes,
        stats: &mut RenderStats,
    ) -> Result<(), RenderError> {
        let Some(open) = open else { return Ok(()) };
        while open.step <= FINEST {
            let before = std::mem::replace(&mut settings.mesh.direct.spacing, open.spacing());
            let errors = match self.errors_of(settings, &mut open.held_out, meshes, stats) {
                Err(RenderError::Mesh(_)) if open.step > 0 => {
                    settings.mesh.direct.spacing = before;
                    open.step = FINEST;
                    return Ok(());
                }
                errors => errors?,
            };
            match errors.estimate(None).filter(|estimate| !estimate.is_within(asked)) {
                Some(estimate) => open.refine(estimate.error / asked),
                None => return Ok(()),
            }
        }
        Ok(())
    }

    /// What is wrong with direct light at the held-out pixels.
    ///
    /// They are compared with what another mesh of the same density gives, whose points lie elsewhere. Both miss the mean over D_y by as much,
    /// independently of each other, so that the mean of the squared difference is twice that of the error. The other one traces all lights: where a
    /// mesh has levels it may be the better one by far, and the whole difference is taken for the error, which is then too large rather than too small.
    fn errors_of(
        &self,
        settings: &Settings,
        held_out: &mut HeldOut,
        meshes: &mut LightMeshes,
        stats: &mut RenderStats,
    ) -> Result<Errors, RenderError> {
        let world = self.world;
        let interpolation = meshes.interpolation(world.scene, self.camera, settings)?;
        let count = self.pixels_for(&interpolation, settings);
        held_out.trace(&self.frame(settings), count.saturating_sub(held_out.paths.len()))?;
        let paths = held_out.paths.get(..count).unwrap_or(&held_out.paths);
        let lookup = meshes.direct.view(world.lights, &interpolation.direct).lookup;
        let needed = needed_points(paths, lookup);
        stats.add_direct(meshes.direct.evaluate(world, &interpolation.direct, &needed));
        let direct = LightMeshIntegrator {
            world,
            direct: &mut meshes.direct,
            indirect: None,
            interpolation: &interpolation,
        };
        let other = ReferenceIntegrator::of_shifted_mesh(world, settings, SHIFT)?;
        let (shown, _) = held_out.shaded(&direct, 0..count);
        let (other, rays) = held_out.shaded(&other, 0..count);
        let share = if settings.mesh.direct.levels == 0 { 0.5 } else { 1.0 };
        let parts = held_out.errors(&shown, &other, |difference| share * difference.length_squared());
        Ok(Errors { parts, rays })
    }

    /// Pixels that are held out to judge a mesh: the denser it is, the more rays each takes.
    fn pixels_for(&self, interpolation: &MeshInterpolation, settings: &Settings) -> usize {
        let (width, height) = settings.view.resolution;
        let camera_rays = f64::from(width) * f64::from(height) * f64::from(settings.view.samples_per_pixel);
        let per_pixel = interpolation.direct.neighbourhoods.points_around() * self.world.lights.len() as f32;
        let affordable = (MEASURED_BY_CAMERA * camera_rays).max(FEWEST_RAYS) / f64::from(per_pixel.max(1.0));
        (affordable as usize).clamp(PIXELS.0, PIXELS.1)
    }

    /// Traced shadow edges: what a picture got wrong is found at blocks that are held out; one that is not good enough is made again with more
    /// rays, at last with all.
    fn render_traced(
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
            })?;
            stats.seconds.check += seconds;
            let within = found.is_none_or(|found| found.is_within(asked));
            let (width, height) = settings.view.resolution;
            let pixels = f64::from(width) * f64::from(height);
            let per_pixel = |found: ErrorEstimate| found.rays as f64 / found.pixels.max(1) as f64;
            let rays_for_half = found.map(|found| (per_pixel(found) * pixels) as u64);
            let ending = if within { Ending::Error } else { Ending::Settings };
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

/// A spacing that is to be found.
struct OpenSpacing {
    /// R.
    radius: f32,
    /// What is tried next, see [`OpenSpacing::spacing`].
    step: u32,
    /// Pixels at which it is tried.
    held_out: HeldOut,
}

impl OpenSpacing {
    fn spacing(&self) -> Spacing {
        Spacing::Units(Vec3::splat(self.radius * (-(self.step as f32) / STEPS_PER_OCTAVE).exp2()))
    }

    /// Goes on to a mesh as fine as it probably has to be, so that few are tried, after one whose error was so many `times` too large.
    fn refine(&mut self, times: f32) {
        let octaves = (HEADROOM * times).log2() / ORDER;
        let next = self.step.saturating_add(((octaves * STEPS_PER_OCTAVE).round() as u32).max(1));
        // The finest one is tried, unless it was.
        self.step = if self.step < FINEST { next.min(FINEST) } else { next };
    }
}

/// What is wrong with parts of a picture.
struct Errors {
    parts: Vec<PartError>,
    /// Rays that it took to find out.
    rays: u64,
}

impl Errors {
    /// The error they make; `mean_shown` is the mean of the picture, if there is one yet.
    fn estimate(&self, mean_shown: Option<f64>) -> Option<ErrorEstimate> {
        ErrorEstimate::of(&self.parts, Measure::Rmse, mean_shown, self.rays)
    }
}

/// Parts of a picture, and how they should look.
struct Truth {
    held_out: HeldOut,
    /// Of the first parts.
    pixels: Pixels,
    rays: u64,
}

/// Mean of all channels of a picture.
fn mean(image: &Image) -> f64 {
    let finite = image.pixels().iter().filter(|pixel| pixel.iter().all(|value| value.is_finite()));
    let (sum, count) = finite.fold((0.0, 0.0), |(sum, count), pixel| {
        (sum + pixel.iter().map(|&value| f64::from(value)).sum::<f64>(), count + 3.0)
    });
    if count > 0.0 { sum / count } else { 0.0 }
}
