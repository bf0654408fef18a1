//! What the first stage leaves to the others: the surface points of a tile's camera paths.

use glam::Vec3;

use super::layers::FirstHits;
use crate::scene::SurfacePoint;

/// A surface that camera paths of a pixel meet, and how much of its illumination reaches the pixel.
///
/// A block's vertices are written once and read twice from memory: only what that needs is here.
#[derive(Clone, Copy, Debug)]
pub struct PathVertex {
    /// The point that stands for all that are seen.
    pub surface: SurfacePoint,
    /// k_d times the product of the k_s before it, summed over the samples.
    pub reflectance: Vec3,
    /// Pixel within the tile.
    pub pixel: u32,
}

/// The camera paths of a tile: all surface points that have to be shaded.
#[derive(Default)]
pub struct TilePaths {
    /// Surface points; those of 16 neighbouring rays follow each other.
    pub vertices: Vec<PathVertex>,
    /// Where shadow rays of the vertices' samples start, if pixels have several samples: one vertex after the other.
    pub(super) origins: Vec<Vec3>,
    /// The end of each vertex's part of them.
    pub(super) origin_ends: Vec<u32>,
    /// Radiance, summed over the samples of each pixel of the tile: of background and emission once the paths are traced,
    /// of everything once their vertices are shaded.
    pub radiance: Vec<Vec3>,
    /// Camera rays traced.
    pub camera_rays: u64,
    /// Mirror reflections traced.
    pub reflection_rays: u64,
    /// What camera rays meet first, if layers are made of it.
    pub first: Option<Box<FirstHits>>,
}

impl TilePaths {
    /// No paths; tracing some keeps what layers need, if that is asked for.
    pub(super) fn new(with_layers: bool) -> Self {
        Self { first: with_layers.then(Box::default), ..Self::default() }
    }

    /// The vertices' surface points.
    pub fn surfaces(&self) -> impl Iterator<Item = &SurfacePoint> {
        self.vertices.iter().map(|vertex| &vertex.surface)
    }

    /// Where shadow rays of a vertex's samples start; empty if pixels have one sample each.
    #[inline(always)]
    pub fn origins_of(&self, vertex: usize) -> &[Vec3] {
        let end = |vertex: usize| self.origin_ends.get(vertex).map_or(0, |&end| end as usize);
        let start = vertex.checked_sub(1).map_or(0, end);
        self.origins.get(start..end(vertex)).unwrap_or_default()
    }
}
