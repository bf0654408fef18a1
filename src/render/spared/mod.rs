//! Which camera rays a square of pixels can do without (method §9, *Squares that see one triangle*).
//!
//! What covers a sample of a square, and is bounded by one straight edge there, covers an [outermost](outline::Outline) sample as well. So where all of these
//! meet one triangle, so do the others, unless something in the square is [so thin](thin::ThinParts) that it may lie between them. Where
//! they meet it follows without a ray.

mod outline;
mod seen_triangle;
mod thin;

use glam::Vec2;

use crate::accel::{Accel, LaneMask, RayHitPacket, on_triangle_of};
use crate::scene::{CameraRays, Scene};
use crate::simd::LANES;

use outline::Outline;
pub(super) use seen_triangle::SeenTriangle;
use thin::ThinParts;

/// Edge of the smaller squares in pixels; the larger ones are twice as wide.
pub(super) const SMALL: u32 = 2;

/// Rounding of depths, as a share.
const DEPTH_MARGIN: f32 = 1e-3;

/// What is known of a view before its rays are traced.
pub struct SparedRays {
    /// Squares of 4×4 pixels.
    large: Level,
    /// Squares of [`SMALL`] × [`SMALL`] pixels, four in each large one.
    small: Level,
}

/// Squares of one size.
struct Level {
    /// The samples whose rays tell what a square sees.
    outline: Outline,
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

    /// What all samples of each small square of a large one see, as far as that is found out by its outermost rays; they are counted. The large one is
    /// given by its upper left pixel.
    #[inline(always)]
    pub(super) fn seen<A: Accel>(
        &self,
        accel: &A,
        scene: &Scene,
        camera: &CameraRays,
        (left, top): (u32, u32),
        rays: &mut u64,
    ) -> [Option<SeenTriangle>; 4] {
        let Self { large, small } = self;
        let parts = [(0, 0), (SMALL, 0), (0, SMALL), (SMALL, SMALL)].map(|(x, y)| (left + x, top + y));
        let first = large.outline.trace(accel, camera, (left, top), rays);
        let depth = common_depth(&first, large.outline.lanes());
        let mut seen = [None; 4];
        if depth.is_some_and(|depth| parts.iter().all(|&part| large.is_clear(part, depth))) {
            seen = [Some(SeenTriangle::of_packet(scene, camera, &first)); 4];
        } else {
            for (seen, (part, lanes)) in seen.iter_mut().zip(parts.into_iter().zip(large.outline.quarters)) {
                // Where the first rays differ, or something thin lies before them, more would be for nothing.
                if !common_depth(&first, lanes).is_some_and(|depth| small.is_clear(part, depth)) {
                    continue;
                }
                let more = small.outline.trace(accel, camera, part, rays);
                let depth = common_depth(&more, small.outline.lanes());
                if depth.is_some_and(|depth| small.is_clear(part, depth)) {
                    *seen = Some(SeenTriangle::of_packet(scene, camera, &more));
                }
            }
        }
        seen
    }
}

impl Level {
    /// Whether nothing thin in a small square, given by its upper left pixel, whose coordinates are even, lies before what is seen there up to this depth,
    /// which is infinite where that is nothing.
    #[inline(always)]
    fn is_clear(&self, (x, y): (u32, u32), depth: f32) -> bool {
        self.thin.depth(x / SMALL, y / SMALL) > (depth * (1.0 + DEPTH_MARGIN)).min(f32::MAX)
    }
}

/// The greatest depth of what some lanes of a packet of camera rays hit, infinite if that is nothing; `None` if they hit different triangles.
#[inline(always)]
fn common_depth(packet: &RayHitPacket<LANES>, lanes: LaneMask) -> Option<f32> {
    let first = lanes.trailing_zeros() as usize % LANES;
    if on_triangle_of(packet, first) & lanes != lanes {
        return None;
    }
    let mut farthest = 0.0;
    for lane in 0..LANES {
        // Directions of camera rays are as long as that of their depth.
        let depth = packet.ray.tfar[lane];
        farthest = if lanes >> lane & 1 == 1 && depth > farthest { depth } else { farthest };
    }
    Some(farthest)
}
