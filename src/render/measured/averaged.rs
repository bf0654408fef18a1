//! Averaged shadows as good as they were asked for: pixels that are held out choose the mesh.

use glam::Vec3;

use super::mean;
use crate::accel::Accel;
use crate::image::Image;
use crate::light_mesh::direct::{DirectEvaluation, DirectMesh};
use crate::render::accuracy::{Accuracy, Ending, ErrorEstimate, Measure, PartError};
use crate::render::error::RenderError;
use crate::render::fixed::View;
use crate::render::held_out::{HeldOut, Pixels};
use crate::render::integrators::LightMeshIntegrator;
use crate::render::meshes::{LightMeshes, MeshInterpolation};
use crate::render::need::needed_points;
use crate::render::settled::Settled;
use crate::render::stats::{RenderStats, timed};
use crate::settings::{
    Estimator, IndirectForm, Neighbourhood, PointLayout, PointSettings, Radius, Settings, Spacing,
};

/// Rays that measuring the error may take where shadows are averaged, as a share of the camera rays, since those of the mesh aren't known yet, and
/// what is always spent, with which a frame of a tenth of a second says something about itself: they cost four times as much as camera rays.
const MEASURED_BY_CAMERA: f64 = 0.02;
const FEWEST_RAYS: f64 = 5e4;

/// Pixels that are held out at least, and at most.
const PIXELS: (usize, usize) = (96, 2048);

/// How often they are doubled where they leave it open whether a mesh is good enough.
const DOUBLINGS: u32 = 2;

/// Spacings that are tried are R times powers of 2, this many to an octave, down to R/4: already there a surface point has some 130 points to weigh, which
/// takes longer than conventional tracing unless lights are many, and memory for the points grows eightfold with each further octave. Who wants a finer
/// mesh than that can name its spacing.
///
/// With few points in D_y a regular grid is wrong by a fifth where it happens to lie badly; a body-centred one of as many points is not, and from a spacing of R/1.26 on
/// both are wrong by the same. So the coarsest meshes are body-centred, unless settings name a layout.
const STEPS_PER_OCTAVE: f32 = 3.0;
const FINEST: i32 = 6;
const COARSEST_REGULAR: i32 = 0;
const FINEST_BODY_CENTRED: i32 = 0;
const COARSEST_BODY_CENTRED: i32 = -1;

/// The error falls with about this power of the spacing, by what `lightmesh bench` finds on the forest; the first guess leaves some room for the
/// uncertainty of what is measured.
const ORDER: f32 = 1.9;
const HEADROOM: f32 = 1.25;

/// From so many lights on `directional`, whose cost per pixel doesn't depend on them, is faster than `per-light`.
const MANY_LIGHTS: usize = 32;

/// Pictures that are made at most, should the brightest pixels be worse than those all over the picture.
const MOST_PICTURES: u32 = 2;

/// Mesh points by which the error is halved: 2^(3/[`ORDER`]).
const POINTS_FOR_HALF: u64 = 3;

impl<A: Accel> View<'_, A> {
    /// Averaged shadows: the coarsest mesh that is good enough at pixels that are held out makes the picture.
    pub(super) fn render_averaged(
        &self,
        mut settings: Settings,
        asked: f32,
        meshes: &mut LightMeshes,
    ) -> Result<(Image, RenderStats), RenderError> {
        let meant = settings.shading.estimator;
        let mut open = match self.settled {
            Some(settled) => {
                settled.choose_mesh(&mut settings);
                None
            }
            None => self.open_points(&mut settings, meshes)?,
        };
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
                let count = self.pixels_for(&settings, meshes)?;
                let mut held_out = HeldOut::by_brightness(&self.frame(&settings), &image, count)?;
                let errors = self.errors_of(&settings, meant, (&mut held_out, count), meshes, &mut trial)?;
                Ok::<_, RenderError>(errors.estimate(Some(mean(&image))))
            });
            let (found, is_late) = self.or_unmeasured(found)?;
            stats.rays.add(&trial.rays);
            stats.mesh_points.direct.evaluated += trial.mesh_points.direct.evaluated;
            stats.seconds.check += seconds;
            // That the error is small enough was said with confidence before; brighter pixels would have to contradict it.
            let missed = found.filter(|found| found.error > asked);
            let ending = match (&mut open, missed) {
                _ if is_late => Ending::Time,
                (_, None) => Ending::Error,
                (None, _) if self.settled.is_some() => Ending::Settled,
                (None, _) => Ending::Settings,
                (Some(open), Some(missed)) => {
                    open.refine(missed.error / asked);
                    Ending::Finest
                }
            };
            let rays_for_half = Some(POINTS_FOR_HALF * stats.rays.shadow);
            stats.accuracy = Some(Accuracy { asked, found, ending, rays_for_half });
            let is_last = pictures >= MOST_PICTURES || open.as_ref().is_none_or(OpenPoints::is_over);
            if ending != Ending::Finest || is_last {
                return Ok((image, stats));
            }
            before = Some((image, stats));
        }
        Err(RenderError::Stopped)
    }

    /// Mesh points, R and estimator that are good enough for this view and for those that they were chosen for `before`, as far as settings leave them
    /// open; `None` if they don't. What is evaluated for that is part of the mesh.
    pub(in crate::render) fn settle(
        &self,
        settings: &Settings,
        before: Option<Settled>,
        meshes: &mut LightMeshes,
    ) -> Result<(Option<Settled>, RenderStats), RenderError> {
        let mut stats = RenderStats::default();
        let mut settings = settings.clone();
        let asked = settings.limits.max_error.unwrap_or(0.0);
        if settings.shading.is_hybrid() || !self.is_measured(&settings, asked) {
            return Ok((None, stats));
        }
        meshes.renew_lights(self.world.lights);
        let mut seconds = 0.0;
        let settled = timed(&mut seconds, || {
            let mut open = self.open_points(&mut settings, meshes)?;
            if let (Some(open), Some(before)) = (&mut open, before) {
                open.begin_at(&before, &settings);
                settings.limits.estimator_open &= before.estimator() == Estimator::Directional;
            }
            self.choose_points(&mut settings, asked, &mut open, meshes, &mut stats)?;
            Ok::<_, RenderError>(open.map(|_| Settled::of(settings.shading.integrator, &settings)))
        })?;
        stats.seconds.check += seconds;
        Ok((settled, stats))
    }

    /// What is to be found of mesh points that the settings leave open: R is what it would be for the automatic spacing.
    fn open_points(
        &self,
        settings: &mut Settings,
        meshes: &mut LightMeshes,
    ) -> Result<Option<OpenPoints>, RenderError> {
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
        let body_centred = settings.limits.layout_open && points.levels == 0;
        let radius =
            meshes.interpolation(self.world.scene, self.camera, settings)?.direct.neighbourhoods.radius();
        settings.shading.kernel.radius = Radius::Units(radius);
        let held_out = HeldOut::new(&self.frame(settings), 1, PIXELS.1);
        let step = if body_centred { COARSEST_BODY_CENTRED } else { COARSEST_REGULAR };
        Ok(Some(OpenPoints { radius, body_centred, step, held_out }))
    }

    /// Puts the coarsest points into the settings whose error at pixels all over the picture is within the limit, if they are open. What is
    /// evaluated for that is part of the mesh.
    fn choose_points(
        &self,
        settings: &mut Settings,
        asked: f32,
        open: &mut Option<OpenPoints>,
        meshes: &mut LightMeshes,
        stats: &mut RenderStats,
    ) -> Result<(), RenderError> {
        let Some(open) = open else { return Ok(()) };
        let (mut is_first, mut doublings) = (true, 0);
        while !open.is_over() {
            let points = open.points(&settings.mesh.direct);
            let before = std::mem::replace(&mut settings.mesh.direct, points);
            let meant = settings.shading.estimator;
            let errors = self.pixels_for(settings, meshes).map(|count| (count << doublings).min(PIXELS.1));
            let errors = errors.and_then(|count| {
                self.errors_of(settings, meant, (&mut open.held_out, count), meshes, stats)
            });
            let errors = match errors {
                Err(RenderError::Mesh(_)) if !is_first => {
                    settings.mesh.direct = before;
                    open.step = FINEST;
                    return Ok(());
                }
                errors => errors?,
            };
            is_first = false;
            match errors.estimate(None).filter(|estimate| !estimate.is_within(asked)) {
                // More pixels cost less than a finer mesh that isn't needed.
                Some(estimate) if doublings < DOUBLINGS && !estimate.is_above(asked) => doublings += 1,
                Some(estimate) => {
                    doublings = 0;
                    open.refine(estimate.error / asked);
                }
                None => return self.choose_estimator(settings, asked, open, meshes, stats),
            }
        }
        Ok(())
    }

    /// Takes `directional` where it may take the place of `per-light`, costs less and is good enough.
    fn choose_estimator(
        &self,
        settings: &mut Settings,
        asked: f32,
        open: &mut OpenPoints,
        meshes: &mut LightMeshes,
        stats: &mut RenderStats,
    ) -> Result<(), RenderError> {
        let meant = settings.shading.estimator;
        let may = settings.limits.estimator_open && meant == Estimator::PerLight;
        if may && self.world.lights.len() >= MANY_LIGHTS {
            settings.shading.estimator = Estimator::Directional;
            let count = self.pixels_for(settings, meshes)?;
            let errors = self.errors_of(settings, meant, (&mut open.held_out, count), meshes, stats)?;
            if errors.estimate(None).is_some_and(|estimate| !estimate.is_within(asked)) {
                settings.shading.estimator = meant;
            }
        }
        Ok(())
    }

    /// What is wrong with direct light at the held-out pixels, in a picture that is `meant` to be by an estimator, perhaps another than that of the
    /// settings.
    ///
    /// They are compared with what another mesh of the same density gives, whose points lie elsewhere. Both miss the mean over D_y by as much,
    /// independently of each other, so that the mean of the squared difference is twice that of the error. The other one traces all lights: where a
    /// mesh has levels it may be the better one by far, and the whole difference is taken for the error, which is then too large rather than too small.
    fn errors_of(
        &self,
        settings: &Settings,
        meant: Estimator,
        (held_out, count): (&mut HeldOut, usize),
        meshes: &mut LightMeshes,
        stats: &mut RenderStats,
    ) -> Result<Errors, RenderError> {
        let mut as_meant = settings.clone();
        as_meant.shading.estimator = meant;
        let interpolation = meshes.interpolation(self.world.scene, self.camera, &as_meant)?;
        held_out.trace(&self.frame(settings), count.saturating_sub(held_out.paths.len()))?;
        let right = self.shaded_by(&mut meshes.direct, &interpolation, held_out, count);
        stats.add_direct(right.evaluation);
        let elsewhere = meshes.other_interpolation(&as_meant)?;
        let other = self.shaded_by(&mut meshes.other, &elsewhere, held_out, count);
        let rays = other.rays();
        let errors = |shown: &Pixels, share: f32| {
            held_out.errors(shown, &other.pixels, |difference| share * difference.length_squared())
        };
        if settings.shading.estimator == meant {
            let share = if settings.mesh.direct.levels == 0 { 0.5 } else { 1.0 };
            return Ok(Errors { parts: errors(&right.pixels, share), rays });
        }
        // Of another estimator, what it differs by from the other mesh, without what is that mesh's own error.
        let own = errors(&right.pixels, 0.5);
        let interpolation = meshes.interpolation(self.world.scene, self.camera, settings)?;
        let shown = self.shaded_by(&mut meshes.direct, &interpolation, held_out, count);
        stats.add_direct(shown.evaluation);
        let mut parts = errors(&shown.pixels, 1.0);
        parts.iter_mut().zip(&own).for_each(|(part, own)| part.wrong -= own.wrong);
        Ok(Errors { parts, rays })
    }

    /// Direct light of the first `count` held-out pixels by a mesh.
    fn shaded_by(
        &self,
        mesh: &mut DirectMesh,
        interpolation: &MeshInterpolation,
        held_out: &HeldOut,
        count: usize,
    ) -> ShadedPixels {
        let world = self.world;
        let paths = held_out.paths.get(..count).unwrap_or(&held_out.paths);
        let lookup = mesh.view(world.lights, &interpolation.direct).lookup;
        let needed = needed_points(paths, lookup);
        let evaluation = mesh.evaluate(world, &interpolation.direct, &needed);
        let integrator = LightMeshIntegrator { world, direct: mesh, indirect: None, interpolation };
        let (pixels, leak_rays) = held_out.shaded(&integrator, 0..count);
        ShadedPixels { pixels, evaluation, leak_rays }
    }

    /// Pixels that are held out to judge a mesh: the denser it is, the more rays each takes.
    fn pixels_for(&self, settings: &Settings, meshes: &mut LightMeshes) -> Result<usize, RenderError> {
        let interpolation = meshes.interpolation(self.world.scene, self.camera, settings)?;
        let (width, height) = settings.view.resolution;
        let camera_rays = f64::from(width) * f64::from(height) * f64::from(settings.view.samples_per_pixel);
        let per_pixel = interpolation.direct.neighbourhoods.points_around() * self.world.lights.len() as f32;
        let affordable = (MEASURED_BY_CAMERA * camera_rays).max(FEWEST_RAYS) / f64::from(per_pixel.max(1.0));
        Ok((affordable as usize).clamp(PIXELS.0, PIXELS.1))
    }
}

/// Held-out pixels by a mesh, and what they took.
struct ShadedPixels {
    pixels: Pixels,
    evaluation: DirectEvaluation,
    /// Rays by which surface points looked which mesh points they see.
    leak_rays: u64,
}

impl ShadedPixels {
    fn rays(&self) -> u64 {
        self.evaluation.shadow + self.evaluation.inside + self.leak_rays
    }
}

/// Mesh points that are to be found.
struct OpenPoints {
    /// R.
    radius: f32,
    /// Whether coarse ones are body-centred.
    body_centred: bool,
    /// What is tried next, see [`OpenPoints::points`].
    step: i32,
    /// Pixels at which it is tried.
    held_out: HeldOut,
}

impl OpenPoints {
    /// The points of settings as they are tried: those of a step are twice as many as those of the step before.
    fn points(&self, settings: &PointSettings) -> PointSettings {
        // A body-centred mesh has two points per cell.
        let (layout, octaves) = if self.body_centred && self.step <= FINEST_BODY_CENTRED {
            (PointLayout::BodyCentred, 1 - self.step)
        } else {
            (PointLayout::Regular, -self.step)
        };
        let spacing = self.radius * (octaves as f32 / STEPS_PER_OCTAVE).exp2();
        PointSettings { layout, spacing: Spacing::Units(Vec3::splat(spacing)), ..settings.clone() }
    }

    /// Whether all that is tried was.
    fn is_over(&self) -> bool {
        self.step > FINEST
    }

    /// Tries no coarser mesh than that of a choice that was made before.
    fn begin_at(&mut self, before: &Settled, settings: &Settings) {
        let mut wanted = settings.clone();
        before.choose_mesh(&mut wanted);
        while self.step < FINEST && self.points(&settings.mesh.direct) != wanted.mesh.direct {
            self.step += 1;
        }
    }

    /// Goes on to a mesh as fine as it probably has to be, so that few are tried, after one whose error was so many `times` too large.
    fn refine(&mut self, times: f32) {
        let octaves = (HEADROOM * times).log2() / ORDER;
        let next = self.step.saturating_add(((octaves * STEPS_PER_OCTAVE).round() as i32).max(1));
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
