//! Which camera rays a square of pixels can do without (method §9, *Squares that see one triangle*).
//!
//! What covers a sample of a square, and is bounded by one straight edge there, covers an [outermost](outline::Outline) sample as well. So where all of these
//! meet one triangle, so do the others, unless something in the square is [so thin](thin::ThinParts) that it may lie between them. Where
//! they meet it follows without a ray.

mod outline;
mod seen_triangle;
mod thin;

use glam::Vec2;

use crate::scene::{CameraRays, Scene};

pub(super) use outline::Outline;
pub(super) use seen_triangle::SeenTriangle;
use thin::ThinParts;

/// Edge of the smaller squares in pixels; the larger ones are twice as wide.
pub(super) const SMALL: u32 = 2;

/// Rounding of depths, as a share.
const DEPTH_MARGIN: f32 = 1e-3;

/// What is known of a view before its rays are traced.
pub struct SparedRays {
    /// Squares of 4×4 pixels.
    pub(super) large: Level,
    /// Squares of [`SMALL`] × [`SMALL`] pixels, four in each large one.
    pub(super) small: Level,
}

/// Squares of one size.
pub(super) struct Level {
    /// The samples whose rays tell what a square sees.
    pub outline: Outline,
    /// What may lie between them.
    thin: ThinParts,
}

impl SparedRays {
    /// Of a view whose pixels have such samples, counted in pixels from their upper left corners.
    pub fn of_view(scene: &Scene, camera: &CameraRays, resolution: (u32, u32), samples: &[Vec2]) -> Self {
        let (large, small) = (Outline::new(2 * SMALL, samples), Outline::new(SMALL, samples));
        let gaps = [large.gap, small.gap];
        let [in_large, in_small] = ThinParts::find(scene, camera, resolution, small.bounds, gaps);
        Self {
            large: Level { outline: large, thin: in_large },
            small: Level { outline: small, thin: in_small },
        }
    }
}

impl Level {
    /// Whether nothing thin in a small square, given by its upper left pixel, whose coordinates are even, lies before what is seen there up to this depth,
    /// which is infinite where that is nothing.
    #[inline(always)]
    pub fn is_clear(&self, (x, y): (u32, u32), depth: f32) -> bool {
        self.thin.depth(x / SMALL, y / SMALL) > (depth * (1.0 + DEPTH_MARGIN)).min(f32::MAX)
    }
}
