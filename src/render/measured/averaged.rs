//! Averaged shadows as good as they were asked for: pixels that are held out choose the mesh.

use glam::Vec3;

use super::errors::PIXELS;
use super::mean;
use crate::accel::Accel;
use crate::image::Image;
use crate::render::accuracy::{Accuracy, Ending};
use crate::render::error::RenderError;
use crate::render::fixed::View;
use crate::render::held_out::HeldOut;
use crate::render::memory::NeededMemory;
use crate::render::meshes::LightMeshes;
use crate::render::settled::Settled;
use crate::render::stats::{RenderStats, timed};
use crate::settings::{Estimator, IndirectForm, Neighbourhood, PointLayout, Radius, Settings, Spacing};

/// Spacings that are tried are R times powers of 2, this many to an octave, down to R/4: already there a surface point has some 130 points to weigh, which
/// takes longer than conventional tracing unless lights are many, and memory for the points grows eightfold with each further octave. Who wants a finer
/// mesh than that can name its spacing.
const STEPS_PER_OCTAVE: f32 = 3.0;
const FINEST: u32 = 6;

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
            None => self.open_spacing(&mut settings, meshes)?,
        };
        let mut before: Option<(Image, RenderStats)> = None;
        for pictures in 1.. {
            let mut trial = RenderStats::default();
            let mut seconds = 0.0;
            let chosen = timed(&mut seconds, || {
                self.choose_points(&mut settings, asked, &mut open, meshes, &mut trial)
            });
            let rendered = chosen.and_then(|()| self.render_fixed(&settings, meshes));
            if matches!(rendered, Err(RenderError::Memory { .. }))
                && pictures == 1
                && open.as_mut().is_some_and(OpenSpacing::begin_again)
            {
                // Light from surfaces has taken its part by now: with what is left, a coarser mesh may do.
                continue;
            }
            let (image, mut stats) = match self.or_before(rendered, before.take())? {
                ended @ (_, RenderStats { accuracy: Some(_), .. }) => return Ok(ended),
                rendered => rendered,
            };
            let found = timed(&mut seconds, || {
                let count = self
                    .pixels_for(&meshes.interpolation(self.world.scene, self.camera, &settings)?, &settings);
                let mut held_out = HeldOut::by_brightness(&self.frame(&settings), &image, count)?;
                let errors = self.errors_of(&settings, meant, &mut held_out, meshes, &mut trial)?;
                Ok::<_, RenderError>(errors.estimate(Some(mean(&image))))
            });
            let (found, ended) = self.or_unmeasured(found)?;
            stats.rays.add(&trial.rays);
            stats.mesh_points.direct.evaluated += trial.mesh_points.direct.evaluated;
            stats.seconds.check += seconds;
            // That the error is small enough was said with confidence before; brighter pixels would have to contradict it.
            let missed = found.filter(|found| found.error > asked);
            let ending = match (&mut open, missed) {
                (_, None) => ended.unwrap_or(Ending::Error),
                (Some(open), _) if open.by_memory => Ending::Memory,
                (None, _) if self.settled.is_some() => Ending::Settled,
                (None, _) => Ending::Settings,
                (Some(open), Some(missed)) => {
                    open.shown = open.fitting;
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
            let mut open = self.open_spacing(&mut settings, meshes)?;
            if let (Some(open), Some(before)) = (&mut open, before) {
                open.begin_at(before.spacing());
                settings.limits.estimator_open &= before.estimator() == Estimator::Directional;
            }
            self.choose_points(&mut settings, asked, &mut open, meshes, &mut stats)?;
            Ok::<_, RenderError>(open.map(|_| Settled::of(settings.shading.integrator, &settings)))
        })?;
        stats.seconds.check += seconds;
        Ok((settled, stats))
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
        Ok(Some(OpenSpacing { radius, step: 0, held_out, fitting: None, shown: None, by_memory: false }))
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
            let meant = settings.shading.estimator;
            let errors = self
                .check_memory(settings, meshes)
                .and_then(|()| self.errors_of(settings, meant, &mut open.held_out, meshes, stats));
            let errors = match errors {
                Err(RenderError::Mesh(_)) if open.step > 0 => {
                    settings.mesh.direct.spacing = before;
                    open.step = FINEST;
                    return Ok(());
                }
                Err(error @ RenderError::Memory { .. }) => {
                    return self.take_what_fits(settings, open, meshes, error);
                }
                errors => errors?,
            };
            open.fitting = Some(open.step);
            match errors.estimate(None).filter(|estimate| !estimate.is_within(asked)) {
                Some(estimate) => open.refine(estimate.error / asked),
                None => return self.choose_estimator(settings, asked, open, meshes, stats),
            }
        }
        Ok(())
    }

    /// Puts the finest points into the settings that memory allows, of those between what was tried before and what it doesn't allow.
    ///
    /// # Errors
    /// The one that is given, if there are none, or none but those of a picture that is finished.
    fn take_what_fits(
        &self,
        settings: &mut Settings,
        open: &mut OpenSpacing,
        meshes: &mut LightMeshes,
        error: RenderError,
    ) -> Result<(), RenderError> {
        let first = open.fitting.map_or(0, |step| step + 1);
        let beyond = open.step;
        open.by_memory = true;
        for step in (first..beyond).rev() {
            open.step = step;
            settings.mesh.direct.spacing = open.spacing();
            match self.check_memory(settings, meshes) {
                Err(RenderError::Memory { .. }) => {}
                fits => return fits,
            }
        }
        let fitting = open.fitting.filter(|_| open.fitting != open.shown).ok_or(error)?;
        open.step = fitting;
        settings.mesh.direct.spacing = open.spacing();
        Ok(())
    }

    /// Checks that memory allows the mesh of these settings for the whole picture.
    ///
    /// # Errors
    /// [`RenderError::Memory`], and those of [`View::render`].
    fn check_memory(&self, settings: &Settings, meshes: &mut LightMeshes) -> Result<(), RenderError> {
        if settings.limits.memory.is_none() {
            return Ok(());
        }
        let interpolation = meshes.interpolation(self.world.scene, self.camera, settings)?;
        let (mut frame, mut stats) = (self.frame(settings), RenderStats::default());
        let needed = NeededMemory::of(&mut frame, settings, meshes, &interpolation, &mut stats)?;
        needed.iter().try_for_each(|needed| needed.check(self.world.lights, meshes, &interpolation))
    }

    /// Takes `directional` where it may take the place of `per-light`, costs less and is good enough.
    fn choose_estimator(
        &self,
        settings: &mut Settings,
        asked: f32,
        open: &mut OpenSpacing,
        meshes: &mut LightMeshes,
        stats: &mut RenderStats,
    ) -> Result<(), RenderError> {
        let meant = settings.shading.estimator;
        let may = settings.limits.estimator_open && meant == Estimator::PerLight;
        if may && self.world.lights.len() >= MANY_LIGHTS {
            settings.shading.estimator = Estimator::Directional;
            let errors = self
                .check_memory(settings, meshes)
                .and_then(|()| self.errors_of(settings, meant, &mut open.held_out, meshes, stats));
            let is_good = match errors {
                Err(RenderError::Memory { .. }) => false,
                errors => errors?.estimate(None).is_none_or(|estimate| estimate.is_within(asked)),
            };
            if !is_good {
                settings.shading.estimator = meant;
            }
        }
        Ok(())
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
    /// The finest that was tried, and for which there is memory.
    fitting: Option<u32>,
    /// That of a picture that is finished.
    shown: Option<u32>,
    /// Whether memory allows no finer one.
    by_memory: bool,
}

impl OpenSpacing {
    /// Begins with the coarsest again; whether that was not tried alone.
    fn begin_again(&mut self) -> bool {
        let is_finer = self.step > 0;
        (self.step, self.fitting) = (0, None);
        is_finer
    }

    fn spacing(&self) -> Spacing {
        Spacing::Units(Vec3::splat(self.radius * (-(self.step as f32) / STEPS_PER_OCTAVE).exp2()))
    }

    /// Tries no coarser mesh than one of a spacing that was tried before.
    fn begin_at(&mut self, spacing: Option<Vec3>) {
        while self.step < FINEST && spacing.is_some_and(|spacing| self.spacing() != Spacing::Units(spacing)) {
            self.step += 1;
        }
    }

    /// Goes on to a mesh as fine as it probably has to be, so that few are tried, after one whose error was so many `times` too large.
    fn refine(&mut self, times: f32) {
        let octaves = (HEADROOM * times).log2() / ORDER;
        let next = self.step.saturating_add(((octaves * STEPS_PER_OCTAVE).round() as u32).max(1));
        // The finest one is tried, unless it was.
        self.step = if self.step < FINEST { next.min(FINEST) } else { next };
    }
}
