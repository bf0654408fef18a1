//! Averaged shadows as good as they were asked for: pixels that are held out choose the mesh.

use super::errors::PIXELS;
use super::mean;
use super::open_points::OpenPoints;
use crate::accel::Accel;
use crate::image::Image;
use crate::render::accuracy::{Accuracy, Ending, ErrorEstimate};
use crate::render::error::RenderError;
use crate::render::fixed::View;
use crate::render::held_out::HeldOut;
use crate::render::memory::NeededMemory;
use crate::render::meshes::LightMeshes;
use crate::render::settled::Settled;
use crate::render::stats::{RenderStats, timed};
use crate::settings::{Estimator, IndirectForm, Neighbourhood, PointLayout, Radius, Settings, Spacing};

/// How often the held-out pixels are doubled where they leave it open whether a mesh is good enough.
const DOUBLINGS: u32 = 2;

/// From so many lights on `directional`, whose cost per pixel doesn't depend on them, is faster than `per-light`.
const MANY_LIGHTS: usize = 32;

/// Pictures that are made at most, should the brightest pixels be worse than those all over the picture.
const MOST_PICTURES: u32 = 2;

/// Mesh points by which the error is halved: 2^(3/1.9), see [`OpenPoints::refine`].
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
        settings.shading.tolerate_pixels(Some(asked));
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
            if matches!(rendered, Err(RenderError::Memory { .. }))
                && pictures == 1
                && open.as_mut().is_some_and(OpenPoints::begin_again)
            {
                // Light from surfaces has taken its part by now: with what is left, a coarser mesh may do.
                continue;
            }
            let (image, mut stats) = match self.or_before(rendered, before.take())? {
                ended @ (_, RenderStats { accuracy: Some(_), .. }) => return Ok(ended),
                rendered => rendered,
            };
            let found = timed(&mut seconds, || {
                let count = self.pixels_for(&settings, meshes)?;
                let mut held_out = self.held_out_of(&image, &settings, count, meshes, &mut trial)?;
                let errors = self.errors_of(&settings, meant, (&mut held_out, count), meshes, &mut trial)?;
                Ok::<_, RenderError>(errors.estimate(Some(mean(&image))))
            });
            let (found, ended) = self.or_unmeasured(found)?;
            stats.rays.add(&trial.rays);
            stats.mesh_points.direct.evaluated += trial.mesh_points.direct.evaluated;
            stats.seconds.check += seconds;
            // That the error of a mesh that was chosen is small enough was said with confidence before: brighter pixels would have to contradict it with as much.
            let is_missed = |found: &ErrorEstimate| {
                if open.is_some() { found.is_above(asked) } else { found.error > asked }
            };
            let missed = found.filter(is_missed);
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
        Ok(Some(OpenPoints::new(radius, body_centred, held_out)))
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
        while !open.is_over() {
            let points = open.points(&settings.mesh.direct);
            let before = std::mem::replace(&mut settings.mesh.direct, points);
            let meant = settings.shading.estimator;
            let estimate = self
                .check_memory(settings, meshes)
                .and_then(|()| self.judge(settings, meant, asked, &mut open.held_out, meshes, stats));
            let estimate = match estimate {
                Err(RenderError::Mesh(_)) if open.fitting.is_some() => {
                    settings.mesh.direct = before;
                    open.end();
                    return Ok(());
                }
                Err(error @ RenderError::Memory { .. }) => {
                    return self.take_what_fits(settings, open, meshes, error);
                }
                estimate => estimate?,
            };
            open.fitting = Some(open.step);
            match estimate.filter(|estimate| !estimate.is_within(asked)) {
                Some(estimate) => open.refine(estimate.error / asked),
                None => return self.choose_estimator(settings, asked, open, meshes, stats),
            }
        }
        Ok(())
    }

    /// The error of a picture by these settings, `meant` to be by an estimator, at held-out pixels: at more of them where they leave it open whether
    /// it is what is `asked`, which costs less than a finer mesh that isn't needed.
    fn judge(
        &self,
        settings: &Settings,
        meant: Estimator,
        asked: f32,
        held_out: &mut HeldOut,
        meshes: &mut LightMeshes,
        stats: &mut RenderStats,
    ) -> Result<Option<ErrorEstimate>, RenderError> {
        let fewest = self.pixels_for(settings, meshes)?;
        let mut estimate = None;
        for doublings in 0..=DOUBLINGS {
            let count = (fewest << doublings).min(PIXELS.1);
            estimate =
                self.errors_of(settings, meant, (&mut *held_out, count), meshes, stats)?.estimate(None);
            if estimate.is_none_or(|estimate| estimate.is_within(asked) || estimate.is_above(asked)) {
                break;
            }
        }
        Ok(estimate)
    }

    /// Puts the finest points into the settings that memory allows, of those between what was tried before and what it doesn't allow.
    ///
    /// # Errors
    /// The one that is given, if there are none, or none but those of a picture that is finished.
    fn take_what_fits(
        &self,
        settings: &mut Settings,
        open: &mut OpenPoints,
        meshes: &mut LightMeshes,
        error: RenderError,
    ) -> Result<(), RenderError> {
        let first = open.fitting.map_or(open.coarsest(), |step| step + 1);
        let beyond = open.step;
        open.by_memory = true;
        for step in (first..beyond).rev() {
            open.step = step;
            settings.mesh.direct = open.points(&settings.mesh.direct);
            match self.check_memory(settings, meshes) {
                Err(RenderError::Memory { .. }) => {}
                fits => return fits,
            }
        }
        let fitting = open.fitting.filter(|_| open.fitting != open.shown).ok_or(error)?;
        open.step = fitting;
        settings.mesh.direct = open.points(&settings.mesh.direct);
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
        open: &mut OpenPoints,
        meshes: &mut LightMeshes,
        stats: &mut RenderStats,
    ) -> Result<(), RenderError> {
        let meant = settings.shading.estimator;
        let may = settings.limits.estimator_open && meant == Estimator::PerLight;
        if may && self.world.lights.len() >= MANY_LIGHTS {
            settings.shading.estimator = Estimator::Directional;
            let estimate = self
                .check_memory(settings, meshes)
                .and_then(|()| self.judge(settings, meant, asked, &mut open.held_out, meshes, stats));
            let is_good = match estimate {
                Err(RenderError::Memory { .. }) => false,
                estimate => estimate?.is_none_or(|estimate| estimate.is_within(asked)),
            };
            if !is_good {
                settings.shading.estimator = meant;
            }
        }
        Ok(())
    }
}
