//! Hybrid shadows (method §4): the mesh says which lights a place sees, which not, and which are open; rays answer what is
//! open, and look for where the mesh is wrong.
//!
//! A tile is shaded in three passes. [`prior`](prior::Prior) goes from patch to patch, a patch being up to 16 surface points of one
//! square of pixels, and sorts the lights by what the mesh points around it see. [`trace`](trace::LightTracer) then
//! goes from light to light and traces, for the whole tile at once, what has to be. [`weak`](weak::WeakLights) looks again at
//! lights that were too weak to be traced beside others, where those turned out to be hidden.

mod patch;
mod places;
mod prior;
mod strengths;
mod trace;
mod weak;

use glam::Vec3;

use crate::accel::Accel;
use crate::light_mesh::direct::DirectView;
use crate::light_mesh::lookup::LookupScratch;
use crate::render::layers::LightParts;
use crate::render::meshes::MeshInterpolation;
use crate::render::paths::TilePaths;
use crate::render::shadow_edges::smooth_shadow_edges;
use crate::render::stats::ShadeCounters;
use crate::render::tiles::Tile;

use patch::Patch;
use prior::Prior;
use trace::LightTracer;

/// Shades the vertices of a tile: fills `light` with the I of each, before the scale of direct light, and with it what is asked for of its `parts`.
#[allow(clippy::too_many_arguments, reason = "what shading has to know is no thing of its own")]
#[inline(always)]
pub(super) fn shade_hybrid<A: Accel>(
    accel: &A,
    mesh: DirectView,
    interpolation: &MeshInterpolation,
    tile: &Tile,
    paths: &TilePaths,
    scratch: &mut LookupScratch,
    light: &mut [Vec3],
    parts: Option<&mut LightParts>,
) -> ShadeCounters {
    let lights = mesh.estimator.lights;
    let vertices = &paths.vertices;
    if lights.is_empty() || vertices.is_empty() {
        return ShadeCounters::default();
    }
    let (mut groups, error) = parts.map_or((None, None), |parts| parts.of_direct());
    let mut patches = Patch::cut(tile, vertices);
    let mut prior = Prior::new(mesh, interpolation.tolerance);
    for patch in &mut patches {
        prior.add(patch, vertices, scratch);
    }
    // What single lights come to matters for edges within pixels, and for groups of lights.
    let is_asked = !paths.origins.is_empty() || groups.is_some();
    let mut visibility = is_asked.then(|| prior.visibility(&patches, vertices.len()));
    let tracer = LightTracer::new(accel, lights, tile, &mut patches, &prior, visibility.as_mut());
    let mut counters = tracer.trace(vertices);
    let (weak, tolerance) = (prior.weak_lights(), interpolation.tolerance);
    counters.shadow_rays +=
        weak.look_again(accel, lights, &mut patches, tolerance, visibility.as_mut(), error);
    for patch in &patches {
        let points = &mut light[patch.vertices.clone()];
        for (lane, light) in points.iter_mut().enumerate() {
            // What was taken for lit and then found dark leaves a rounding error.
            *light = Vec3::from(patch.light.map(|channel| channel[lane])).max(Vec3::ZERO);
        }
    }
    if let Some(visibility) = &visibility {
        if let Some(groups) = &mut groups {
            visibility.add_by_group(lights, vertices, groups);
        }
        let scale = interpolation.direct_scale;
        counters.shadow_rays +=
            smooth_shadow_edges(accel, lights, tile, paths, visibility, scale, light, groups);
    }
    counters
}
