//! A scene that is rendered more than once: everything that outlives a view.

use glam::Vec3;

use super::error::{RenderError, SessionError};
use super::film::TileSink;
use super::fixed::View;
use super::frame::StopToken;
use super::layers::LayerCollector;
use super::meshes::LightMeshes;
use super::stats::RenderStats;
use crate::accel::{Accel, Backend, BackendChoice};
use crate::image::Image;
use crate::light_mesh::direct::{Basis, DirectField};
use crate::lights::{EmissiveTriangles, PackedLights, emitters};
use crate::scene::{Camera, Scene, SceneError};
use crate::settings::Settings;
use crate::world::World;

/// A scene with its acceleration structure, lights and light meshes.
///
/// Light meshes keep what they know from one render to the next: another camera, radius, neighbourhood, estimator or leak rule,
/// or another intensity of a light, costs only what was never evaluated.
pub struct Session {
    scene: Scene,
    backend: Backend,
    lights: SceneLights,
    emissive: EmissiveTriangles,
    meshes: LightMeshes,
}

/// The lights of a scene, as integrators take them.
struct SceneLights {
    /// Without emissive triangles, whose light comes with that of all other surfaces: the paper's way.
    plain: PackedLights,
    /// With those, if there are any, for Lambertian reflectors, which know what radiance is.
    with_emitters: Option<PackedLights>,
}

impl SceneLights {
    fn of(scene: &Scene) -> Self {
        let emitters = emitters(scene);
        let with_emitters = (!emitters.is_empty()).then(|| PackedLights::with_emitters(scene, &emitters));
        Self { plain: PackedLights::of_scene(scene), with_emitters }
    }

    /// Those that some settings ask for.
    fn of_settings(&self, settings: &Settings) -> &PackedLights {
        let with_emitters = self.with_emitters.as_ref().filter(|_| settings.shading.lambertian);
        with_emitters.unwrap_or(&self.plain)
    }
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
        Self { scene, backend, lights, emissive, meshes }
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Its acceleration structure.
    pub fn backend(&self) -> &Backend {
        &self.backend
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
        let Self { scene, backend, lights, emissive, meshes } = self;
        let lights = lights.of_settings(settings);
        let world = World { accel: &*backend, scene, lights, emissive };
        render_world(world, camera, settings, meshes, sink, stop, layers)
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
    render_world(world, camera, settings, &mut meshes, &(), &StopToken::default(), None)
}

fn render_world<A: Accel>(
    world: World<A>,
    camera: &Camera,
    settings: &Settings,
    meshes: &mut LightMeshes,
    sink: &dyn TileSink,
    stop: &StopToken,
    layers: Option<&LayerCollector>,
) -> Result<(Image, RenderStats), RenderError> {
    settings.check()?;
    camera.validate()?;
    View { world, camera, sink, stop, layers }.render(settings, meshes)
}
