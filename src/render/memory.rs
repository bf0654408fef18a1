//! What light meshes may take of memory. It is counted from the points that a picture needs, before they are evaluated: nothing of it depends on threads, on
//! blocks, or on what the process holds.

use super::error::RenderError;
use super::frame::Frame;
use super::meshes::{LightMeshes, MeshInterpolation};
use super::need::needed_points;
use super::stats::{RenderStats, timed};
use crate::accel::Accel;
use crate::light_mesh::store::PointMask;
use crate::lights::PackedLights;
use crate::settings::Settings;

/// The points of light meshes that a picture needs, and the bytes that all meshes may take with them.
pub(super) struct NeededMemory {
    limit: u64,
    direct: PointMask,
    /// Of indirect light in free space.
    indirect: PointMask,
}

impl NeededMemory {
    /// Finds the points for the picture of a frame, whose camera paths are then known; `None` if memory has no limit, which costs nothing.
    ///
    /// # Errors
    /// [`RenderError::Stopped`].
    pub fn of<A: Accel>(
        frame: &mut Frame<A>,
        settings: &Settings,
        meshes: &LightMeshes,
        interpolation: &MeshInterpolation,
        stats: &mut RenderStats,
    ) -> Result<Option<Self>, RenderError> {
        let Some(limit) = settings.limits.memory else { return Ok(None) };
        let direct = meshes.direct.view(frame.world.lights, &interpolation.direct).lookup;
        let indirect = meshes.indirect.as_ref().zip(interpolation.indirect.as_ref());
        let indirect = indirect.map(|(mesh, interpolation)| mesh.view(interpolation).lookup);
        let mut needed = Self { limit, direct: PointMask::default(), indirect: PointMask::default() };
        frame.trace_image(stats, |paths, stats| {
            timed(&mut stats.seconds.mesh, || {
                // What is beyond the limit already is not counted to its end, which might take all memory by itself.
                if needed.least() <= limit {
                    needed.direct.add(&needed_points(paths, direct));
                    indirect.iter().for_each(|&lookup| needed.indirect.add(&needed_points(paths, lookup)));
                }
            });
        })?;
        Ok(Some(needed))
    }

    /// What the points take at least.
    fn least(&self) -> u64 {
        let bricks = self.direct.bricks().count() + self.indirect.bricks().count();
        (bricks * PointMask::BYTES_OF_BRICK) as u64
    }

    /// Checks that all meshes stay within the limit when the points are evaluated that are unknown by now. The other mesh, which shows nothing, gives
    /// way.
    ///
    /// # Errors
    /// [`RenderError::Memory`].
    pub fn check(
        &self,
        lights: &PackedLights,
        meshes: &mut LightMeshes,
        interpolation: &MeshInterpolation,
    ) -> Result<(), RenderError> {
        let direct = meshes.direct.bytes_with(lights, &interpolation.direct, &self.direct);
        let indirect = meshes.indirect.as_ref();
        let indirect = indirect.map_or(0, |mesh| mesh.bytes_with(&self.indirect) - mesh.memory_bytes());
        let growth = direct - meshes.direct.memory_bytes() + indirect;
        within(self.limit, meshes.memory_bytes() + growth).or_else(|_| {
            meshes.forget_other();
            within(self.limit, meshes.memory_bytes() + growth)
        })
    }

    /// Makes room for the points of direct light.
    pub fn reserve(
        &self,
        lights: &PackedLights,
        meshes: &mut LightMeshes,
        interpolation: &MeshInterpolation,
    ) {
        meshes.direct.reserve(lights, &interpolation.direct, &self.direct);
    }
}

/// Checks that so many bytes are within a limit.
///
/// # Errors
/// [`RenderError::Memory`].
pub(super) fn within(limit: u64, bytes: usize) -> Result<(), RenderError> {
    let needed = bytes as u64;
    if needed > limit { Err(RenderError::Memory { needed, limit }) } else { Ok(()) }
}
