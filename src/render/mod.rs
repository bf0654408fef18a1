//! Rendering as a wavefront (spec §9): camera paths of an image block → needed mesh points → evaluation in
//! packets → shading.

mod conventional;
mod hybrid;
mod light_mesh;
mod paths;
mod reference;
mod stats;
mod surface_group;
mod tiles;
mod wavefront;

pub use stats::{MeshCounters, RayCounters, RenderStats, StageSeconds};

use self::conventional::ConventionalIntegrator;
use self::light_mesh::LightMeshIntegrator;
use self::reference::ReferenceIntegrator;
use self::wavefront::{direct_scale, wavefront};
use crate::accel::{Backend, with_accel};
use crate::light_mesh::{DirectMesh, IndirectMesh, LightTable, MeshError};
use crate::scene::{Camera, Scene};
use crate::settings::{Integrator, Settings};

/// Linear RGB picture, row by row from the top left.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// Columns and rows.
    pub resolution: (u32, u32),
    /// Radiance, linear RGB.
    pub pixels: Vec<[f32; 3]>,
}

/// Hears how far a render is; called from the thread that called [`render`].
pub trait Progress {
    /// A block is done: `done` of `total` pixels.
    fn pixels(&self, done: u64, total: u64);
}

/// A listener that ignores all.
impl Progress for () {
    fn pixels(&self, _: u64, _: u64) {}
}

/// Light meshes of a scene; they keep their values from one render to the next.
///
/// Known values are never changed. With several bounces of indirect light, points that a later view adds build on the
/// final values of those that are there, so that views agree with first renders to within the tolerance, not to the bit.
pub struct LightMeshes {
    direct: DirectMesh,
    indirect: Option<IndirectMesh>,
}

impl LightMeshes {
    /// Meshes over a scene, with no point known.
    pub fn new(scene: &Scene, settings: &Settings) -> Result<Self, MeshError> {
        let indirect = settings.light_mesh.indirect.as_ref();
        Ok(Self {
            direct: DirectMesh::new(scene, &settings.light_mesh)?,
            indirect: indirect.map(|indirect| IndirectMesh::new(scene, indirect)).transpose()?,
        })
    }
}

/// Renders with light meshes. `meshes` must have been made for the same scene and light-mesh settings.
pub fn render_light_mesh(
    backend: &Backend,
    scene: &Scene,
    camera: &Camera,
    settings: &Settings,
    meshes: &mut LightMeshes,
    progress: &dyn Progress,
) -> (Film, RenderStats) {
    let (film, mut stats) = with_accel!(backend, accel => {
        let mut integrator = LightMeshIntegrator { accel, scene, settings, meshes };
        wavefront(accel, scene, camera, settings, &mut integrator, progress)
    });
    let counters = &mut meshes.direct.points.counters;
    counters.nearest_fallback += stats.mesh_points.direct.nearest_fallback;
    stats.mesh_points.direct = *counters;
    stats.light_mesh_bytes = meshes.direct.memory_bytes() as u64;
    if let Some(indirect) = &mut meshes.indirect {
        let counters = &mut indirect.points.counters;
        counters.nearest_fallback += stats.mesh_points.indirect.nearest_fallback;
        stats.mesh_points.indirect = *counters;
        stats.light_mesh_bytes += indirect.memory_bytes() as u64;
    }
    (film, stats)
}

/// Renders with one occlusion ray per light at every surface point.
pub fn render_conventional(
    backend: &Backend,
    scene: &Scene,
    camera: &Camera,
    settings: &Settings,
    progress: &dyn Progress,
) -> (Film, RenderStats) {
    let lights = LightTable::of_scene(scene);
    with_accel!(backend, accel => {
        let mut integrator = ConventionalIntegrator { accel, lights, scale: direct_scale(settings) };
        wavefront(accel, scene, camera, settings, &mut integrator, progress)
    })
}

/// Renders what light meshes of infinite density would give (spec §10); direct light only.
///
/// # Errors
/// As for light meshes of the same settings.
pub fn render_reference(
    backend: &Backend,
    scene: &Scene,
    camera: &Camera,
    settings: &Settings,
    progress: &dyn Progress,
) -> Result<(Film, RenderStats), MeshError> {
    with_accel!(backend, accel => {
        let mut integrator = ReferenceIntegrator::new(accel, scene, settings)?;
        Ok(wavefront(accel, scene, camera, settings, &mut integrator, progress))
    })
}

/// Renders with the integrator that the settings name.
pub fn render(
    backend: &Backend,
    scene: &Scene,
    camera: &Camera,
    settings: &Settings,
    progress: &dyn Progress,
) -> Result<(Film, RenderStats), MeshError> {
    match settings.integrator {
        Integrator::Conventional => Ok(render_conventional(backend, scene, camera, settings, progress)),
        Integrator::Reference => render_reference(backend, scene, camera, settings, progress),
        Integrator::LightMesh => {
            let mut meshes = LightMeshes::new(scene, settings)?;
            Ok(render_light_mesh(backend, scene, camera, settings, &mut meshes, progress))
        }
    }
}
