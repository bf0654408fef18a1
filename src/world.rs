//! A scene together with its acceleration structure and its lights.

use glam::Vec3;

use crate::accel::Accel;
use crate::lights::{EmissiveTriangles, PackedLights};
use crate::scene::{Interaction, Scene};

/// A scene with what was built from it: the acceleration structure and the lights. Everything that traces takes one.
pub struct World<'a, A> {
    /// Answers rays.
    pub accel: &'a A,
    /// The scene.
    pub scene: &'a Scene,
    /// Its lights.
    pub lights: &'a PackedLights,
    /// Its triangles that emit.
    pub emissive: &'a EmissiveTriangles,
}

// Derived implementations would require a backend that can be copied.
impl<A> Copy for World<'_, A> {}
impl<A> Clone for World<'_, A> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<'a, A: Accel> World<'a, A> {
    /// The parts put together; they must be of one scene.
    pub fn new(
        accel: &'a A,
        scene: &'a Scene,
        lights: &'a PackedLights,
        emissive: &'a EmissiveTriangles,
    ) -> Self {
        Self { accel, scene, lights, emissive }
    }

    /// Whether light that a surface emits comes along rays that find it: no light stands for it.
    #[inline(always)]
    pub fn gathers(&self, seen: &Interaction) -> bool {
        seen.emission != Vec3::ZERO && !seen.lamp && !self.lights.has_emitters()
    }
}
