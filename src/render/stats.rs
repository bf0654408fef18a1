//! What a render did and how long it took.

use serde::{Serialize, Serializer};

use super::accuracy::Accuracy;
use super::reason::Choice;
use super::settled::Settled;
use crate::light_mesh::direct::DirectEvaluation;
use crate::light_mesh::indirect::IndirectEvaluation;
use crate::light_mesh::surface::SurfaceEvaluation;
use crate::settings::Integrator;

/// Wall-clock seconds per stage of rendering.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct StageSeconds {
    /// Camera paths.
    pub paths: f64,
    /// Finding and evaluating mesh points.
    pub mesh: f64,
    /// Shading.
    pub shade: f64,
    /// Measuring the error, and choosing mesh points by it.
    pub check: f64,
}

/// Rays by kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct RayCounters {
    /// Camera rays.
    pub camera: u64,
    /// Mirror reflections.
    pub reflection: u64,
    /// Occlusion rays, from mesh points or from surface points, and rays that look for surfaces in cells.
    pub shadow: u64,
    /// Rays that gather indirect light at mesh points or points on surfaces.
    pub indirect: u64,
    /// Rays that look whether mesh points lie inside of geometry.
    pub inside: u64,
}

impl RayCounters {
    /// Adds other rays.
    pub(super) fn add(&mut self, other: &Self) {
        self.camera += other.camera;
        self.reflection += other.reflection;
        self.shadow += other.shadow;
        self.indirect += other.indirect;
        self.inside += other.inside;
    }
}

/// Counters of one light mesh in one render.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct PointCounters {
    /// About how many points the neighbourhoods of surface points could reach; 0 for points on surfaces, which nobody counts.
    pub total: u64,
    /// Points that lay in the neighbourhood of some surface point, summed over image blocks.
    pub needed: u64,
    /// Points that got a value; never one that had a value before.
    pub evaluated: u64,
    /// Surface points whose neighbourhood was empty and fell back to the nearest point.
    pub nearest_fallback: u64,
}

/// Counters of the light meshes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct MeshCounters {
    /// Direct light mesh.
    pub direct: PointCounters,
    /// Indirect light mesh, or points on surfaces: records are needed, records and sources evaluated.
    pub indirect: PointCounters,
}

/// What one render did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct RenderStats {
    /// What computed the illumination, never [`Integrator::Auto`]; `None` before.
    pub integrator: Option<Integrator>,
    /// How [`Integrator::Auto`] came to it.
    pub choice: Option<Choice>,
    /// Seconds per stage.
    pub seconds: StageSeconds,
    /// Rays by kind.
    pub rays: RayCounters,
    /// Mesh points.
    pub mesh_points: MeshCounters,
    /// What hybrid shadows estimate of their error.
    pub hybrid_error: HybridError,
    /// Bytes held by the light meshes afterwards.
    pub light_mesh_bytes: u64,
    /// How wrong the picture is; `None` where nobody asked.
    pub accuracy: Option<Accuracy>,
    /// What was found for what the settings left open.
    #[serde(skip)]
    pub settled: Option<Settled>,
}

/// The error that hybrid shadows estimate of themselves, over some surface points.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HybridError {
    /// The light that is there and taken for missing, or the other way round; its unit is that of `received`.
    pub missed: f64,
    /// The light of the points, summed over them and the colours.
    pub received: f64,
}

impl HybridError {
    /// Adds the error of other points.
    pub(super) fn add(&mut self, other: Self) {
        self.missed += other.missed;
        self.received += other.received;
    }

    /// As a share of the light; `None` where no point had hybrid shadows, or none had light.
    pub fn share(&self) -> Option<f32> {
        (self.received > 0.0).then(|| (self.missed / self.received) as f32)
    }
}

impl Serialize for HybridError {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.share().serialize(serializer)
    }
}

/// What shading some surface points took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ShadeCounters {
    /// Occlusion rays from the surface points.
    pub shadow_rays: u64,
    /// Rays that look whether positions lie inside of geometry.
    pub inside_rays: u64,
    /// Surface points without direct mesh points in their neighbourhood.
    pub direct_fallbacks: u64,
    /// The same of indirect mesh points.
    pub indirect_fallbacks: u64,
    /// The error that hybrid shadows estimate.
    pub hybrid_error: HybridError,
}

impl RenderStats {
    /// Adds what the evaluation of direct mesh points took.
    pub(super) fn add_direct(&mut self, evaluation: DirectEvaluation) {
        self.mesh_points.direct.evaluated += evaluation.evaluated;
        self.rays.shadow += evaluation.shadow;
        self.rays.inside += evaluation.inside;
    }

    /// Adds what pictures took that were made before this one.
    pub(super) fn add_earlier(&mut self, before: &Self) {
        let Self { seconds, rays, mesh_points, .. } = self;
        seconds.paths += before.seconds.paths;
        seconds.mesh += before.seconds.mesh;
        seconds.shade += before.seconds.shade;
        seconds.check += before.seconds.check;
        rays.add(&before.rays);
        mesh_points.direct.evaluated += before.mesh_points.direct.evaluated;
        mesh_points.indirect.evaluated += before.mesh_points.indirect.evaluated;
    }

    /// Adds what the evaluation of a surface mesh took.
    pub(super) fn add_surface(&mut self, evaluation: SurfaceEvaluation) {
        self.mesh_points.indirect.evaluated += evaluation.evaluated;
        self.mesh_points.indirect.needed += evaluation.needed;
        self.rays.indirect += evaluation.rays;
        self.rays.shadow += evaluation.shadow;
    }

    /// Adds what the evaluation of indirect mesh points took.
    pub(super) fn add_indirect(&mut self, evaluation: IndirectEvaluation) {
        self.mesh_points.indirect.evaluated += evaluation.evaluated;
        self.mesh_points.direct.needed += evaluation.direct_needed;
        self.rays.indirect += evaluation.rays;
        self.rays.shadow += evaluation.shadow;
        self.rays.inside += evaluation.inside;
        self.add_direct(evaluation.direct);
    }

    /// Adds what shading counted.
    pub(super) fn add_shading(&mut self, counters: ShadeCounters) {
        self.rays.shadow += counters.shadow_rays;
        self.rays.inside += counters.inside_rays;
        self.mesh_points.direct.nearest_fallback += counters.direct_fallbacks;
        self.mesh_points.indirect.nearest_fallback += counters.indirect_fallbacks;
        self.hybrid_error.add(counters.hybrid_error);
    }
}

/// Runs a stage and adds its time.
pub(super) fn timed<T>(seconds: &mut f64, stage: impl FnOnce() -> T) -> T {
    let start = std::time::Instant::now();
    let result = stage();
    *seconds += start.elapsed().as_secs_f64();
    result
}
