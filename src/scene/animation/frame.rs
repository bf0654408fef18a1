//! One frame of an animation.

use glam::Affine3A;

use crate::scene::{Camera, Light, Scene};

/// Where the moving parts of a scene are at one time; everything else stands still.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Frame {
    /// Its number.
    pub number: i64,
    /// The moving cameras, each with its index in the list of cameras.
    pub cameras: Vec<(u32, Camera)>,
    /// Placements of the moving instances, each with its index in [`Scene::instances`].
    pub instances: Vec<(u32, Option<Affine3A>)>,
    /// The moving lights, each with its index in [`Scene::lights`]. Their intensities are those of the file, whatever has become of them.
    pub lights: Vec<(u32, Light)>,
}

impl Frame {
    /// A camera as it is in this frame, given its index and where it stands otherwise.
    pub fn camera(&self, index: usize, still: &Camera) -> Camera {
        let moving = self.cameras.iter().find(|(moving, _)| *moving as usize == index);
        moving.map_or(still, |(_, camera)| camera).clone()
    }

    /// Puts the parts of a scene where they are in this frame. What the scene doesn't have is passed over.
    pub fn apply(&self, scene: &mut Scene) {
        for (index, to_world) in &self.instances {
            if let Some(instance) = scene.instances.get_mut(*index as usize) {
                instance.to_world = *to_world;
            }
        }
        for (index, light) in &self.lights {
            if let Some(other) = scene.lights.get_mut(*index as usize) {
                *other = Light { intensity: other.intensity, ..*light };
            }
        }
    }
}
