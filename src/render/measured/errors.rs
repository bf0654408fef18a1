//! What is wrong with averaged shadows at pixels that are held out, by another light mesh (method §10).

use crate::accel::Accel;
use crate::image::Image;
use crate::light_mesh::direct::{DirectEvaluation, DirectMesh};
use crate::render::accuracy::{ErrorEstimate, Measure, PartError};
use crate::render::error::RenderError;
use crate::render::fixed::View;
use crate::render::frame::BlockIntegrator;
use crate::render::held_out::{HeldOut, Pixels};
use crate::render::integrators::LightMeshIntegrator;
use crate::render::memory::within;
use crate::render::meshes::{LightMeshes, MeshInterpolation};
use crate::render::need::needed_points;
use crate::render::stats::RenderStats;
use crate::settings::{Estimator, Settings};

/// Rays that measuring the error may take where shadows are averaged, as a share of the camera rays, since those of the mesh aren't known yet, and
/// what is always spent, with which a frame of a tenth of a second says something about itself: they cost four times as much as camera rays.
const MEASURED_BY_CAMERA: f64 = 0.02;
const FEWEST_RAYS: f64 = 5e4;

/// Pixels of a finished picture of which it is predicted how wrong they are, for each that is held out; and at most, as a share of the picture.
const CANDIDATES: usize = 8;
const LOOKED_AT: f64 = 1.0 / 32.0;

/// Pixels that are held out at least, and at most.
pub(super) const PIXELS: (usize, usize) = (96, 2048);

impl<A: Accel> View<'_, A> {
    /// What is wrong with direct light at the first `count` held-out pixels, in a picture that is `meant` to be by an estimator, perhaps another than that of the
    /// settings.
    ///
    /// They are compared with what another mesh of the same density gives, whose points lie elsewhere. Both miss the mean over D_y by as much,
    /// independently of each other, so that the mean of the squared difference is twice that of the error. The other one traces all lights: where a
    /// mesh has levels it may be the better one by far, and the whole difference is taken for the error, which is then too large rather than too small.
    pub(super) fn errors_of(
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
        let room = room_of(settings, meshes, &meshes.direct);
        let right = self.shaded_by(&mut meshes.direct, &interpolation, held_out, count, room)?;
        stats.add_direct(right.evaluation);
        let by_other = |meshes: &mut LightMeshes| {
            let elsewhere = meshes.other_interpolation(&as_meant)?;
            let room = room_of(settings, meshes, &meshes.other);
            self.shaded_by(&mut meshes.other, &elsewhere, held_out, count, room)
        };
        let mut other = by_other(meshes);
        if matches!(other, Err(RenderError::Memory { .. })) {
            // Points of coarser trials and other pixels are not needed any more.
            meshes.forget_other();
            other = by_other(meshes);
        }
        let other = other?;
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
        let room = room_of(settings, meshes, &meshes.direct);
        let shown = self.shaded_by(&mut meshes.direct, &interpolation, held_out, count, room)?;
        stats.add_direct(shown.evaluation);
        let mut parts = errors(&shown.pixels, 1.0);
        parts.iter_mut().zip(&own).for_each(|(part, own)| part.wrong -= own.wrong);
        Ok(Errors { parts, rays })
    }

    /// Pixels of a finished picture by which it is judged: chosen by how bright they are, and of many of those by how much two halves of the
    /// mesh points around them differ. A few pixels in a thousand make most of an RMSE.
    pub(super) fn held_out_of(
        &self,
        image: &Image,
        settings: &Settings,
        count: usize,
        meshes: &mut LightMeshes,
        stats: &mut RenderStats,
    ) -> Result<HeldOut, RenderError> {
        let frame = self.frame(settings);
        let candidates = (CANDIDATES * count).min((image.pixels().len() as f64 * LOOKED_AT) as usize);
        let candidates = HeldOut::by_brightness(&frame, image, candidates.max(count))?;
        let interpolation = meshes.interpolation(self.world.scene, self.camera, settings)?;
        let (world, direct) = (self.world, &mut meshes.direct);
        let mut integrator =
            LightMeshIntegrator { world, direct, indirect: None, interpolation: &interpolation };
        // Their points were needed by the picture and are known.
        integrator.evaluate(&candidates.paths, stats);
        candidates.by_prediction(&frame, &candidates.predicted(&integrator), count)
    }

    /// Direct light of the first `count` held-out pixels by a mesh, which may take so many bytes, if memory is limited.
    ///
    /// # Errors
    /// [`RenderError::Memory`].
    fn shaded_by(
        &self,
        mesh: &mut DirectMesh,
        interpolation: &MeshInterpolation,
        held_out: &HeldOut,
        count: usize,
        room: Option<u64>,
    ) -> Result<ShadedPixels, RenderError> {
        let world = self.world;
        let paths = held_out.paths.get(..count).unwrap_or(&held_out.paths);
        let lookup = mesh.view(world.lights, &interpolation.direct).lookup;
        let needed = needed_points(paths, lookup);
        if let Some(room) = room {
            within(room, mesh.bytes_with(world.lights, &interpolation.direct, &needed))?;
        }
        let evaluation = mesh.evaluate(world, &interpolation.direct, &needed);
        let integrator = LightMeshIntegrator { world, direct: mesh, indirect: None, interpolation };
        let (pixels, leak_rays) = held_out.shaded(&integrator, 0..count);
        Ok(ShadedPixels { pixels, evaluation, leak_rays })
    }

    /// Pixels that are held out to judge a mesh: the denser it is, the more rays each takes.
    pub(super) fn pixels_for(
        &self,
        settings: &Settings,
        meshes: &mut LightMeshes,
    ) -> Result<usize, RenderError> {
        let interpolation = meshes.interpolation(self.world.scene, self.camera, settings)?;
        let (width, height) = settings.view.resolution;
        let camera_rays = f64::from(width) * f64::from(height) * f64::from(settings.view.samples_per_pixel);
        let per_pixel = interpolation.direct.neighbourhoods.points_around() * self.world.lights.len() as f32;
        let affordable = (MEASURED_BY_CAMERA * camera_rays).max(FEWEST_RAYS) / f64::from(per_pixel.max(1.0));
        Ok((affordable as usize).clamp(PIXELS.0, PIXELS.1))
    }
}

/// Bytes that a mesh of direct light may take beside the others.
fn room_of(settings: &Settings, meshes: &LightMeshes, mesh: &DirectMesh) -> Option<u64> {
    let others = (meshes.memory_bytes() - mesh.memory_bytes()) as u64;
    settings.limits.memory.map(|limit| limit.saturating_sub(others))
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

/// What is wrong with parts of a picture.
pub(super) struct Errors {
    parts: Vec<PartError>,
    /// Rays that it took to find out.
    rays: u64,
}

impl Errors {
    /// The error they make; `mean_shown` is the mean of the picture, if there is one yet.
    pub(super) fn estimate(&self, mean_shown: Option<f64>) -> Option<ErrorEstimate> {
        ErrorEstimate::of(&self.parts, Measure::Rmse, mean_shown, self.rays)
    }
}
