//! Groups of packed lights: what each of them gives a surface point.

use glam::Vec3;

use super::packed::PackedLights;
use super::visibility::{Visibility, VisibilityBits};
use crate::scene::{LightGroups, SurfacePoint};
use crate::simd::Lanes;

/// The groups of packed lights, as bits of their chunks. Emissive triangles, whose clusters know no groups, belong to the default one.
pub struct PackedGroups {
    names: Vec<String>,
    chunks: usize,
    /// By group and chunk.
    masks: Vec<VisibilityBits>,
}

impl PackedGroups {
    /// The groups of some lights.
    pub fn new(groups: &LightGroups, lights: &PackedLights) -> Self {
        let names: Vec<String> = groups.names().map(str::to_owned).collect();
        let chunks = lights.chunks().len();
        let mut masks = vec![0; names.len() * chunks];
        for (index, chunk) in lights.chunks().iter().enumerate() {
            for lane in (0..VisibilityBits::BITS as usize).filter(|lane| chunk.used >> lane & 1 == 1) {
                if let Some(mask) = masks.get_mut(lights.group(index, lane) * chunks + index) {
                    *mask |= 1 << lane;
                }
            }
        }
        Self { names, chunks, masks }
    }

    /// Their names; the default group comes first.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Adds to `sums`, one for each group, what its lights give a surface point: [`PackedLights::irradiance`] of each.
    #[inline(always)]
    pub fn add_irradiance(
        &self,
        lights: &PackedLights,
        surface: &SurfacePoint,
        mut visibility: impl Visibility,
        sums: &mut [Vec3],
    ) {
        if self.chunks == 0 {
            return;
        }
        for (sum, mask) in sums.iter_mut().zip(self.masks.chunks_exact(self.chunks)) {
            *sum += lights.irradiance(surface, Only { mask, of: &mut visibility });
        }
    }
}

/// Visibility of the lights of a group; others are not seen.
struct Only<'a, V> {
    mask: &'a [VisibilityBits],
    of: &'a mut V,
}

impl<V: Visibility> Visibility for Only<'_, V> {
    #[inline(always)]
    fn of_chunk(&mut self, index: usize) -> Option<Lanes> {
        let mask = self.mask[index];
        if mask == 0 {
            return None;
        }
        let mut visible = self.of.of_chunk(index)?;
        for (lane, visible) in visible.iter_mut().enumerate() {
            *visible = if mask >> lane & 1 == 1 { *visible } else { 0.0 };
        }
        Some(visible)
    }
}
