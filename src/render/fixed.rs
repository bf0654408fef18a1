//! One picture, by settings that leave nothing open.

use std::sync::OnceLock;

use super::choice::{WithTrial, choose, is_open};
use super::error::RenderError;
use super::film::TileSink;
use super::frame::{Frame, Purpose, StopToken};
use super::integrators::{ConventionalIntegrator, LightMeshIntegrator, ReferenceIntegrator};
use super::known_view::KnownView;
use super::layers::LayerCollector;
use super::memory::{NeededMemory, within};
use super::meshes::{LightMeshes, MeshInterpolation};
use super::need::needed_points;
use super::reason::{Choice, Reason};
use super::settled::Settled;
use super::spared::SparedRays;
use super::stats::{RenderStats, timed};
use super::surface_light::{SurfaceLight, WithSurfaceLight, evaluate_surface_light};
use crate::accel::Accel;
use crate::image::Image;
use crate::light_mesh::store::PointMask;
use crate::scene::Camera;
use crate::settings::{Integrator, Settings};
use crate::world::World;

/// A view of a world, and who receives its pictures.
pub(super) struct View<'a, A> {
    pub world: World<'a, A>,
    pub camera: &'a Camera,
    pub sink: &'a dyn TileSink,
    pub stop: &'a StopToken,
    /// What a file knows of it.
    pub known: Option<&'a KnownView>,
    /// What was chosen for this view and others together.
    pub settled: Option<Settled>,
    /// What is made of it.
    pub purpose: Purpose,
    pub layers: Option<&'a LayerCollector>,
    /// What of its camera rays can be spared, found when the first are traced.
    pub spared: &'a OnceLock<Option<SparedRays>>,
}

impl<A: Accel> View<'_, A> {
    /// The view, cut up.
    pub(super) fn frame<'a>(&'a self, settings: &'a Settings) -> Frame<'a, A> {
        Frame::new(self.world, self.camera, &settings.view, self.sink, self.stop, self.purpose, self.spared)
            .with_layers(self.layers)
    }

    pub(super) fn render_fixed(
        &self,
        settings: &Settings,
        meshes: &mut LightMeshes,
    ) -> Result<(Image, RenderStats), RenderError> {
        render_frame(self.frame(settings), self, settings, meshes)
    }
}

/// Renders with the integrator that the settings name.
fn render_frame<A: Accel>(
    mut frame: Frame<A>,
    view: &View<A>,
    settings: &Settings,
    meshes: &mut LightMeshes,
) -> Result<(Image, RenderStats), RenderError> {
    let camera = view.camera;
    let mut stats = RenderStats::default();
    let world = frame.world;
    let limit = settings.limits.memory;
    let may_be_mesh = matches!(settings.shading.integrator, Integrator::LightMesh | Integrator::Auto);
    let mut needed = None;
    let mut fits = Ok(());
    if limit.is_some() && may_be_mesh {
        let interpolation = meshes.interpolation(world.scene, camera, settings)?;
        needed = NeededMemory::of(&mut frame, settings, meshes, &interpolation, &mut stats)?;
        fits = needed.iter().try_for_each(|needed| needed.check(world.lights, meshes, &interpolation));
    }
    let mut tried = Vec::new();
    let integrator = match (settings.shading.integrator, fits) {
        (Integrator::Auto, fits) => {
            let choice;
            (choice, tried) = match fits {
                Err(RenderError::Memory { .. }) if is_open(settings) => {
                    let choice = Choice { integrator: Integrator::Conventional, reason: Reason::Memory };
                    (choice, Vec::new())
                }
                fits => fits.and_then(|()| choose(&frame, camera, settings, meshes, &mut stats))?,
            };
            stats.choice = Some(choice);
            choice.integrator
        }
        (named, fits) => fits.map(|()| named)?,
    };
    stats.integrator = Some(integrator);
    let settled = Settled::of(integrator, settings);
    stats.settled = Some(settled);
    frame.begin(&settled.settings(settings));
    let by_light_mesh = matches!(integrator, Integrator::LightMesh | Integrator::Auto);
    let interpolation = if by_light_mesh {
        let interpolation = meshes.interpolation(world.scene, camera, settings)?;
        evaluate_indirect(&mut frame, meshes, &interpolation, &mut stats)?;
        Some(interpolation)
    } else {
        meshes.renew_indirect(world.scene, settings)?;
        None
    };
    if let Some(mesh) = &mut meshes.surface {
        let known = view.known.map(|known| &known.records[..]).filter(|known| !known.is_empty());
        evaluate_surface_light(&mut frame, mesh, camera, known, &mut stats)?;
    }
    // What light from surfaces takes is known by now.
    match (&needed, &interpolation) {
        (Some(needed), Some(interpolation)) => {
            needed.check(world.lights, meshes, interpolation)?;
            needed.reserve(world.lights, meshes, interpolation);
        }
        _ => limit.map_or(Ok(()), |limit| within(limit, meshes.memory_bytes()))?,
    }
    let surface = meshes.surface.as_ref().map(|mesh| SurfaceLight::new(world.accel, mesh, settings));
    let image = match (integrator, interpolation) {
        (Integrator::Reference, _) => {
            let direct = ReferenceIntegrator::new(world, settings)?;
            frame.run(&mut WithSurfaceLight { direct, surface }, &mut stats)?
        }
        (_, Some(interpolation)) => {
            let (direct, indirect) = (&mut meshes.direct, meshes.indirect.as_ref());
            let integrator = LightMeshIntegrator { world, direct, indirect, interpolation: &interpolation };
            let direct = WithTrial { integrator, tried };
            frame.run(&mut WithSurfaceLight { direct, surface }, &mut stats)?
        }
        (_, None) => {
            let scale = settings.shading.direct_scale();
            let direct = ConventionalIntegrator { world, scale, indirect: None };
            frame.run(&mut WithSurfaceLight { direct, surface }, &mut stats)?
        }
    };
    if by_light_mesh || meshes.surface.is_some() {
        stats.light_mesh_bytes = meshes.memory_bytes() as u64;
    }
    Ok((image, stats))
}

/// Evaluates what the view of a frame needs of a mesh of indirect light in free space.
fn evaluate_indirect<A: Accel>(
    frame: &mut Frame<A>,
    meshes: &mut LightMeshes,
    interpolation: &MeshInterpolation,
    stats: &mut RenderStats,
) -> Result<(), RenderError> {
    let world = frame.world;
    let counters = &mut stats.mesh_points;
    counters.direct.total = interpolation.direct.neighbourhoods.count(&meshes.direct.store().points);
    let (Some(mesh), Some(view)) = (&mut meshes.indirect, &interpolation.indirect) else { return Ok(()) };
    counters.indirect.total = view.neighbourhoods.count(&mesh.store().points);
    // Light that passes between surfaces several times is solved for at once, so that blocks leave no trace.
    let mut needed = Vec::new();
    frame.trace_image(stats, |paths, stats| {
        timed(&mut stats.seconds.mesh, || {
            needed.extend(needed_points(paths, mesh.view(view).lookup).bricks());
        });
    })?;
    let mut seconds = stats.seconds.mesh;
    timed(&mut seconds, || {
        let needed = PointMask::union(needed);
        stats.mesh_points.indirect.needed += needed.len();
        let transport = interpolation.transport();
        stats.add_indirect(mesh.evaluate(world, &mut meshes.direct, transport, view, needed));
    });
    stats.seconds.mesh = seconds;
    Ok(())
}
