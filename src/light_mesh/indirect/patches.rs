//! Patches: what indirect mesh points see of the surfaces, once for all that see the same.
//!
//! Millions of rays from mesh points end on surfaces that hold a few thousand points' worth of light. Hits that lie
//! near to each other, for how far the rays came, and face the same way form a patch; what it sends back is found once, at one
//! hit of it. The mean over a point's directions and the interpolation over D_y blur that light more than the patch does.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

use glam::Vec3;

use crate::sampling::mix;
use crate::scene::{Interaction, SurfacePoint};

/// Number of a ray's patch where the ray left the scene.
pub const NO_PATCH: u32 = u32::MAX;

/// What the hits of a patch have in common.
#[derive(Clone, Copy, Debug)]
pub struct Patch {
    /// One of the hits, which stands for all.
    pub surface: SurfacePoint,
    key: u64,
    /// Sum of k_d over the hits.
    diffuse: Vec3,
    hits: u32,
}

impl Patch {
    /// Mean k_d of the hits.
    pub fn diffuse(&self) -> Vec3 {
        self.diffuse / self.hits as f32
    }
}

/// Some patches, and which of them each of some rays hit.
#[derive(Default)]
pub struct Patches {
    /// By number.
    pub patches: Vec<Patch>,
    /// Number of each ray's patch.
    pub of_ray: Vec<u32>,
    numbers: HashMap<u64, u32, BuildHasherDefault<KeyHasher>>,
}

impl Patches {
    /// Adds a ray that hit a surface in a cell of edge `width`, or nothing.
    #[inline(always)]
    pub fn push(&mut self, hit: Option<(&Interaction, f32)>) {
        let number = hit.map_or(NO_PATCH, |(hit, width)| {
            let key = key(&hit.point, width);
            self.number(Patch { surface: hit.point, key, diffuse: hit.diffuse, hits: 1 })
        });
        self.of_ray.push(number);
    }

    /// Adds the rays and patches of others, after its own. The result depends on the order of the calls alone.
    pub fn extend(&mut self, others: Self) {
        let numbers: Vec<u32> = others.patches.into_iter().map(|patch| self.number(patch)).collect();
        // What has no patch has none here.
        self.of_ray.extend(
            others.of_ray.iter().map(|&other| numbers.get(other as usize).copied().unwrap_or(NO_PATCH)),
        );
    }

    /// The number of a patch, which is joined to one of the same key.
    #[inline(always)]
    fn number(&mut self, patch: Patch) -> u32 {
        let new = self.patches.len() as u32;
        let number = *self.numbers.entry(patch.key).or_insert(new);
        if number == new {
            self.patches.push(patch);
        } else if let Some(known) = self.patches.get_mut(number as usize) {
            known.diffuse += patch.diffuse;
            known.hits += patch.hits;
        }
        number
    }
}

/// What the hits of one patch have in common, and other hits practically never: a hash of the cell of edge `width` and of the
/// rounded normal.
#[inline(always)]
fn key(surface: &SurfacePoint, width: f32) -> u64 {
    let cell = (surface.position / width).floor().to_array();
    let normal = (surface.shading_normal * 4.0).round().to_array();
    // Adding 0 makes one number of the two zeros.
    let pair = |a: f32, b: f32| u64::from((a + 0.0).to_bits()) | u64::from((b + 0.0).to_bits()) << 32;
    let numbers =
        [pair(cell[0], cell[1]), pair(cell[2], normal[0]), pair(normal[1], normal[2]), pair(width, 0.0)];
    numbers.into_iter().fold(0, |hash, number| mix(hash ^ number))
}

/// Takes keys, which are hashes, for what they are.
#[derive(Default)]
struct KeyHasher(u64);

impl Hasher for KeyHasher {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.0 = mix(self.0 ^ u64::from(byte));
        }
    }

    fn write_u64(&mut self, key: u64) {
        self.0 = key;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(x: f32, normal: Vec3, diffuse: f32) -> Interaction {
        Interaction {
            point: SurfacePoint::flat(Vec3::new(x, 0.0, 0.0), normal),
            diffuse: Vec3::splat(diffuse),
            specular: Vec3::ZERO,
            emission: Vec3::ZERO,
            front: true,
            two_sided: false,
            culled: false,
        }
    }

    fn patches(hits: &[Option<Interaction>], width: f32) -> Patches {
        let mut patches = Patches::default();
        hits.iter().for_each(|hit| patches.push(hit.as_ref().map(|hit| (hit, width))));
        patches
    }

    fn hits() -> [Option<Interaction>; 6] {
        [
            Some(point(0.1, Vec3::Y, 0.2)),
            None,
            Some(point(0.9, Vec3::Y, 0.4)),
            Some(point(0.1, Vec3::NEG_Y, 0.5)),
            Some(point(1.1, Vec3::Y, 0.7)),
            Some(point(-0.1, Vec3::Y, 0.9)),
        ]
    }

    /// Hits share a patch where they are near and face the same way; the two sides of a wall never do.
    #[test]
    fn patches_join_what_is_near_and_faces_the_same_way() {
        let patches = patches(&hits(), 1.0);
        assert_eq!(patches.of_ray, [0, NO_PATCH, 0, 1, 2, 3]);
        assert!((patches.patches[0].diffuse().x - 0.3).abs() < 1e-6);
    }

    /// Patches that were found in parts are those that are found at once.
    #[test]
    fn parts_join() {
        let hits = hits();
        let whole = patches(&hits, 1.0);
        for cut in 0..=hits.len() {
            let mut joined = patches(&hits[..cut], 1.0);
            joined.extend(patches(&hits[cut..], 1.0));
            assert_eq!(joined.of_ray, whole.of_ray);
            let diffuse = |patches: &Patches| patches.patches.iter().map(Patch::diffuse).collect::<Vec<_>>();
            assert_eq!(diffuse(&joined), diffuse(&whole));
        }
    }

    /// Far away cells are too many to count, and nothing panics.
    #[test]
    fn far_hits_have_patches() {
        assert_eq!(patches(&[Some(point(1e30, Vec3::Y, 0.5))], 1e-9).of_ray, [0]);
    }
}
