//! Patches: what indirect mesh points see of the surfaces, once for all that see the same.
//!
//! Millions of rays from mesh points end on surfaces that hold a few thousand points' worth of indirect light. Hits that lie
//! within half a spacing of each other and face the same way form a patch; light that is passed on once more is looked up
//! for one hit of each patch. Interpolation over D_y has blurred that light more than the patch does.

use glam::Vec3;
use rayon::prelude::*;

use crate::sampling::mix;
use crate::scene::{Interaction, SurfacePoint};

/// A hit that belongs to no patch, since the ray left the scene.
const NONE: u32 = u32::MAX;

/// What the hits of a patch have in common.
#[derive(Clone, Copy, Debug)]
pub struct Patch {
    /// One of the hits, which stands for all.
    pub surface: SurfacePoint,
    /// Mean k_d of all.
    pub diffuse: Vec3,
}

/// The patches of many hits.
#[derive(Default)]
pub struct Patches {
    /// By number.
    pub patches: Vec<Patch>,
    /// Patch of each hit.
    of_hit: Vec<u32>,
}

/// What the hits of one patch have in common, and other hits practically never: a hash of the cell of edge `size` and of the
/// rounded normal.
fn key(surface: &SurfacePoint, size: f32) -> u64 {
    let cell = (surface.position / size).floor().to_array();
    let normal = (surface.shading_normal * 4.0).round().to_array();
    // Adding 0 makes one number of the two zeros.
    let numbers =
        cell.into_iter().chain(normal).chain([size]).map(|number| u64::from((number + 0.0).to_bits()));
    numbers.fold(0, |hash, number| mix(hash ^ number))
}

impl Patches {
    /// Sorts `count` hits into patches of the given width; `surface(i)` gives hit i, if there is one.
    ///
    /// The result depends on the order of the hits alone, not on threads.
    pub fn new(
        count: usize,
        size: impl Fn(&SurfacePoint) -> f32 + Sync,
        surface: impl Fn(usize) -> Option<Interaction> + Sync,
    ) -> Self {
        let mut order: Vec<(u64, usize)> = (0..count)
            .into_par_iter()
            .filter_map(|hit| surface(hit).map(|Interaction { point, .. }| (key(&point, size(&point)), hit)))
            .collect();
        order.par_sort_unstable();
        let members_of: Vec<&[(u64, usize)]> = order.chunk_by(|a, b| a.0 == b.0).collect();
        let patches = members_of
            .par_iter()
            .filter_map(|members| {
                let k_d = members.iter().filter_map(|&(_, hit)| surface(hit)).map(|surface| surface.diffuse);
                let diffuse = k_d.sum::<Vec3>() / members.len() as f32;
                // The one in the middle of the list: the first ones all belong to the same mesh point.
                let (_, middle) = members.get(members.len() / 2)?;
                Some(Patch { surface: surface(*middle)?.point, diffuse })
            })
            .collect();
        let mut of_hit = vec![NONE; count];
        for (patch, members) in (0..).zip(&members_of) {
            members.iter().for_each(|&(_, hit)| of_hit[hit] = patch);
        }
        Self { patches, of_hit }
    }

    /// The patch of a hit.
    #[inline(always)]
    pub fn of(&self, hit: usize) -> Option<usize> {
        let patch = self.of_hit[hit];
        (patch != NONE).then_some(patch as usize)
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

    /// Hits share a patch where they are near and face the same way; the two sides of a wall never do.
    #[test]
    fn patches_join_what_is_near_and_faces_the_same_way() {
        let hits = [
            Some(point(0.1, Vec3::Y, 0.2)),
            None,
            Some(point(0.9, Vec3::Y, 0.4)),
            Some(point(0.1, Vec3::NEG_Y, 0.5)),
            Some(point(1.1, Vec3::Y, 0.7)),
            Some(point(-0.1, Vec3::Y, 0.9)),
        ];
        let patches = Patches::new(hits.len(), |_| 1.0, |hit| hits[hit]);
        assert_eq!(patches.patches.len(), 4);
        assert_eq!(patches.of(1), None);
        assert_eq!(patches.of(0), patches.of(2));
        let shared = patches.of(0).unwrap();
        assert!((patches.patches[shared].diffuse.x - 0.3).abs() < 1e-6);
        let others = [3, 4, 5].map(|hit| patches.of(hit).unwrap());
        assert!(!others.contains(&shared) && others[0] != others[1] && others[1] != others[2]);
        // Far away cells are too many to count, and nothing panics.
        assert!(Patches::new(1, |_| 1e-9, |_| Some(point(1e30, Vec3::Y, 0.5))).of(0).is_some());
    }
}
