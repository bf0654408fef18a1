//! A scene that is rendered more than once: everything that outlives a view.

use std::path::Path;
use std::sync::OnceLock;

use glam::Vec3;

use super::error::{RenderError, SessionError};
use super::film::TileSink;
use super::fixed::View;
use super::frame::{Purpose, StopToken};
use super::known_view::of_views;
use super::layers::LayerCollector;
use super::memory::within;
use super::mesh_file::{MeshScene, RestoredMeshes, WriteMeshesError};
use super::meshes::LightMeshes;
use super::scene_lights::SceneLights;
use super::settled::Settled;
use super::stats::RenderStats;
use crate::Bounds;
use crate::accel::{Accel, Backend, BackendChoice};
use crate::image::Image;
use crate::light_mesh::direct::{Basis, DirectEvaluation, DirectField, KnownPoints};
use crate::light_mesh::file::{MeshFile, MeshFileError};
use crate::lights::EmissiveTriangles;
use crate::scene::{Camera, Scene, SceneError};
use crate::settings::Settings;
use crate::world::World;

/// A scene with its acceleration structure, lights and light meshes.
///
/// Light meshes keep what they know from one render to the next: another camera, radius, neighbourhood, estimator or leak rule,
/// or another intensity of a light, costs only what was never evaluated.
pub struct Session {
    pub(super) scene: Scene,
    pub(super) backend: Backend,
    pub(super) lights: SceneLights,
    pub(super) emissive: EmissiveTriangles,
    pub(super) meshes: LightMeshes,
    /// What was chosen for several views together, and the settings that left it open.
    pub(super) settled: Option<(Settings, Settled)>,
}

impl Session {
    /// Checks a scene and builds its acceleration structure.
    ///
    /// # Errors
    /// See [`SessionError`].
    pub fn new(scene: Scene, backend: BackendChoice) -> Result<Self, SessionError> {
        scene.validate()?;
        let backend = Backend::build(backend, &scene)?.backend;
        Ok(Self::of_valid(scene, backend))
    }

    /// A session with an acceleration structure that was built from this scene's geometry before.
    ///
    /// # Errors
    /// [`SessionError::Scene`].
    #[cfg(feature = "cli")]
    pub(crate) fn with_backend(scene: Scene, backend: Backend) -> Result<Self, SessionError> {
        scene.validate()?;
        Ok(Self::of_valid(scene, backend))
    }

    fn of_valid(scene: Scene, backend: Backend) -> Self {
        let lights = SceneLights::of(&scene);
        let emissive = EmissiveTriangles::of_scene(&scene);
        let meshes = LightMeshes::new(scene.bounds());
        Self { scene, backend, lights, emissive, meshes, settled: None }
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Its acceleration structure.
    pub fn backend(&self) -> &Backend {
        &self.backend
    }

    /// The scene with what was built from it, and the lights that the settings ask for.
    pub(crate) fn world(&self, settings: &Settings) -> World<'_, Backend> {
        let Self { scene, backend, lights, emissive, .. } = self;
        World { accel: backend, scene, lights: lights.of_settings(settings), emissive }
    }

    /// The same, and the light meshes for change.
    fn split(&mut self, settings: &Settings) -> (World<'_, Backend>, &mut LightMeshes) {
        let Self { scene, backend, lights, emissive, meshes, .. } = self;
        (World { accel: backend, scene, lights: lights.of_settings(settings), emissive }, meshes)
    }

    /// The points of the direct light mesh that are known by now, with their light; costs no ray.
    pub fn known_points(&mut self) -> KnownPoints {
        let Self { lights, meshes, .. } = self;
        let with_emitters = lights.with_emitters.as_ref().filter(|_| meshes.has_emitters());
        meshes.direct.known(with_emitters.unwrap_or(&lights.plain))
    }

    /// Changes the intensity E_i of a light; 0 switches it off. What mesh points see stays known, and what a ball's geometry shows stays as it is.
    /// Returns whether there is such a light.
    ///
    /// # Errors
    /// [`SceneError`] for an intensity that is negative or not finite; then nothing has changed.
    pub fn set_intensity(&mut self, light: usize, intensity: Vec3) -> Result<bool, SceneError> {
        let Some(changed) = self.scene.lights.get_mut(light) else { return Ok(false) };
        let before = std::mem::replace(&mut changed.intensity, intensity);
        if let Err(error) = changed.validate(light) {
            changed.intensity = before;
            return Err(error);
        }
        self.lights = SceneLights::of(&self.scene);
        self.meshes.forget_intensities();
        self.settled = None;
        Ok(true)
    }

    /// Renders a view.
    ///
    /// # Errors
    /// See [`RenderError`].
    pub fn render(
        &mut self,
        camera: &Camera,
        settings: &Settings,
    ) -> Result<(Image, RenderStats), RenderError> {
        self.render_to(camera, settings, &(), &StopToken::default())
    }

    /// Renders a view; `sink` receives its tiles as they are finished, `stop` ends it between two tiles.
    ///
    /// # Errors
    /// See [`RenderError`]. The values of mesh points that were evaluated before an error stay known.
    pub fn render_to(
        &mut self,
        camera: &Camera,
        settings: &Settings,
        sink: &dyn TileSink,
        stop: &StopToken,
    ) -> Result<(Image, RenderStats), RenderError> {
        self.render_layers(camera, settings, sink, stop, None)
    }

    /// Renders a view as [`Session::render_to`] does, and hands its layers to a collector.
    ///
    /// With layers the image is their sum, and differs from one without by rounding.
    ///
    /// # Errors
    /// As [`Session::render_to`].
    pub fn render_layers(
        &mut self,
        camera: &Camera,
        settings: &Settings,
        sink: &dyn TileSink,
        stop: &StopToken,
        layers: Option<&LayerCollector>,
    ) -> Result<(Image, RenderStats), RenderError> {
        let settled = self.settled_for(settings);
        let (world, meshes) = self.split(settings);
        let shown = Shown { camera, sink, stop, settled, layers, purpose: Purpose::Image };
        render_world(world, shown, settings, meshes)
    }

    /// Chooses mesh points and estimator of averaged shadows, where settings leave them open and ask for an error, such that they are good enough for this
    /// view and for all for which this was called before with the same settings. Later renders by these settings take that choice: their images are
    /// alike, share their mesh points, and each still says how wrong it is.
    ///
    /// # Errors
    /// See [`RenderError`]; then what was chosen before stays.
    pub fn settle(
        &mut self,
        camera: &Camera,
        settings: &Settings,
        stop: &StopToken,
    ) -> Result<RenderStats, RenderError> {
        settings.check()?;
        camera.validate()?;
        let before = self.settled_for(settings);
        let (world, meshes) = self.split(settings);
        let (sink, purpose) = (&(), Purpose::Meshes);
        let spared = &OnceLock::new();
        let view =
            View { world, camera, sink, stop, known: None, settled: None, layers: None, purpose, spared };
        let (settled, stats) = view.settle(&of_views(settings), before, meshes)?;
        self.settled = settled.map(|settled| (of_views(settings), settled));
        Ok(stats)
    }

    /// Lets every view choose for itself again what its settings leave open.
    pub fn unsettle(&mut self) {
        self.settled = None;
    }

    /// What was [chosen](Session::settle) for views by these settings.
    fn settled_for(&self, settings: &Settings) -> Option<Settled> {
        let (asked, settled) = self.settled.as_ref()?;
        (*asked == of_views(settings)).then_some(*settled)
    }

    /// Whether a file that was [read](Session::read_light_meshes) knows what the settings leave open for a view.
    pub fn knows_view(&self, camera: &Camera, settings: &Settings) -> bool {
        self.meshes.known_view(camera, settings).is_some()
    }

    /// Makes known what a view needs of the light meshes, and what its settings leave open. Where nothing has to be measured, that takes no image.
    ///
    /// # Errors
    /// See [`RenderError`]. The values of mesh points that were evaluated before an error stay known.
    pub fn prepare(
        &mut self,
        camera: &Camera,
        settings: &Settings,
        sink: &dyn TileSink,
        stop: &StopToken,
    ) -> Result<RenderStats, RenderError> {
        let settled = self.settled_for(settings);
        let (world, meshes) = self.split(settings);
        let shown = Shown { camera, sink, stop, settled, layers: None, purpose: Purpose::Meshes };
        Ok(render_world(world, shown, settings, meshes)?.1)
    }

    /// Makes all mesh points of direct light in a box known whose spacing these settings have there, for a camera where the spacing follows from
    /// one. Returns how many were evaluated, and the rays that took.
    ///
    /// # Errors
    /// See [`RenderError`]; [`RenderError::Stopped`] between two parts of the box.
    pub fn prepare_box(
        &mut self,
        bounds: Bounds,
        camera: &Camera,
        settings: &Settings,
        stop: &StopToken,
    ) -> Result<DirectEvaluation, RenderError> {
        settings.check()?;
        let (world, meshes) = self.split(settings);
        meshes.renew_lights(world.lights);
        let interpolation = meshes.interpolation(world.scene, camera, settings)?.direct;
        let mut evaluation = DirectEvaluation::default();
        // No surface is interpolated from points that are further away.
        let (scene, reach) = (world.scene.bounds(), interpolation.neighbourhoods.radius());
        let bounds =
            Bounds { min: bounds.min.max(scene.min - reach), max: bounds.max.min(scene.max + reach) };
        if bounds.is_empty() {
            return Ok(evaluation);
        }
        for part in interpolation.neighbourhoods.parts_of(bounds) {
            stop.check()?;
            let needed = meshes.direct.points_in(&interpolation, part);
            if let Some(limit) = settings.limits.memory {
                let direct = meshes.direct.bytes_with(world.lights, &interpolation, &needed);
                within(limit, meshes.memory_bytes() - meshes.direct.memory_bytes() + direct)?;
            }
            evaluation.add(meshes.direct.evaluate(world, &interpolation, &needed));
        }
        Ok(evaluation)
    }

    /// Takes the light meshes of a file (docs/light-mesh-files.md), to be used with these settings, for its own.
    ///
    /// # Errors
    /// See [`MeshFileError`]; then what was known stays.
    pub fn read_light_meshes(
        &mut self,
        path: &Path,
        settings: &Settings,
    ) -> Result<RestoredMeshes, MeshFileError> {
        let of = MeshScene { scene: &self.scene, lights: self.lights.of_settings(settings), settings };
        let (meshes, restored) = LightMeshes::of_file(&MeshFile::open(path)?, of)?;
        self.meshes = meshes;
        Ok(restored)
    }

    /// Adds the light meshes to a file, which is made if there is none; what others have added since stays. Returns the file's size in bytes.
    ///
    /// # Errors
    /// See [`WriteMeshesError`]; then the file is as it was.
    pub fn update_light_meshes(&self, path: &Path, settings: &Settings) -> Result<u64, WriteMeshesError> {
        let of = MeshScene { scene: &self.scene, lights: self.lights.of_settings(settings), settings };
        self.meshes.update_file(path, of)
    }

    /// DirectLight of eq. (1) at positions in free space, linear RGB, with the visibility of every light traced; needs no
    /// surface and no normal.
    pub fn direct_light(&self, positions: &[Vec3]) -> Vec<Vec3> {
        let mut field = DirectField::default();
        field.trace(&self.backend, &self.lights.plain, positions);
        field.derive(&self.lights.plain, Basis::Light, positions);
        (0..positions.len() as u32)
            .map(|slot| {
                let [r, g, b, ..] = *field.light(slot);
                Vec3::new(r, g, b)
            })
            .collect()
    }
}

/// Renders one view of a scene; what light meshes know is forgotten afterwards. `backend` must hold the scene.
///
/// # Errors
/// See [`RenderError`]; the scene is not checked, as a [`Session`] does.
pub fn render(
    backend: &Backend,
    scene: &Scene,
    camera: &Camera,
    settings: &Settings,
) -> Result<(Image, RenderStats), RenderError> {
    let lights = SceneLights::of(scene);
    let emissive = EmissiveTriangles::of_scene(scene);
    let mut meshes = LightMeshes::new(scene.bounds());
    let lights = lights.of_settings(settings);
    let world = World { accel: backend, scene, lights, emissive: &emissive };
    let stop = StopToken::default();
    let shown =
        Shown { camera, sink: &(), stop: &stop, settled: None, layers: None, purpose: Purpose::Image };
    render_world(world, shown, settings, &mut meshes)
}

/// A view, who receives it, and what for.
struct Shown<'a> {
    camera: &'a Camera,
    sink: &'a dyn TileSink,
    stop: &'a StopToken,
    settled: Option<Settled>,
    layers: Option<&'a LayerCollector>,
    purpose: Purpose,
}

fn render_world<A: Accel>(
    world: World<A>,
    shown: Shown,
    settings: &Settings,
    meshes: &mut LightMeshes,
) -> Result<(Image, RenderStats), RenderError> {
    settings.check()?;
    let Shown { camera, sink, stop, settled, layers, purpose } = shown;
    camera.validate()?;
    let known = meshes.known_view(camera, settings).cloned();
    let of_file = known.as_ref().map(|known| known.settled.settings(settings));
    let spared = &OnceLock::new();
    let view = View { world, camera, sink, stop, known: known.as_ref(), settled, layers, purpose, spared };
    let (image, mut stats) = view.render(of_file.as_ref().unwrap_or(settings), meshes)?;
    if let Some(known) = known {
        stats.accuracy = known.accuracy;
    }
    meshes.remember(camera, settings, &stats);
    Ok((image, stats))
}
