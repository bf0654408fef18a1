//! From one frame of an animation to another: what moves, and what stays known all the same (method §9).

use super::error::SessionError;
use super::scene_lights::SceneLights;
use super::session::Session;
use crate::Bounds;
use crate::light_mesh::direct::KeptBits;
use crate::lights::EmissiveTriangles;
use crate::scene::{Frame, Instance, Light, Scene};

/// What a [move](Session::move_to) changed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Moved {
    /// Instances that stand elsewhere.
    pub instances: usize,
    /// Lights that are elsewhere, or shine another way.
    pub lights: usize,
    /// What stays known of direct light at mesh points.
    pub known: KeptBits,
}

/// Instances and lights of a frame that differ from those of a scene, by index.
#[derive(Default)]
struct Changes {
    instances: Vec<(usize, Instance)>,
    lights: Vec<(usize, Light)>,
}

impl Changes {
    fn of(frame: &Frame, scene: &Scene) -> Result<Self, SessionError> {
        let missing = |what, index: u32| SessionError::NothingToMove {
            frame: frame.number,
            what,
            index: index as usize,
        };
        let mut changes = Self::default();
        for &(index, to_world) in &frame.instances {
            let before = scene.instances.get(index as usize).ok_or_else(|| missing("instance", index))?;
            if before.to_world != to_world {
                changes.instances.push((index as usize, Instance { mesh: before.mesh, to_world }));
            }
        }
        for &(index, light) in &frame.lights {
            let before = scene.lights.get(index as usize).ok_or_else(|| missing("light", index))?;
            let after = Light { intensity: before.intensity, ..light };
            after.validate(index as usize)?;
            if *before != after {
                changes.lights.push((index as usize, after));
            }
        }
        Ok(changes)
    }

    /// Makes the changes, and itself those that undo them.
    fn swap(&mut self, scene: &mut Scene) {
        let Self { instances, lights } = self;
        for (index, instance) in instances {
            scene.instances.get_mut(*index).into_iter().for_each(|other| std::mem::swap(other, instance));
        }
        for (index, light) in lights {
            scene.lights.get_mut(*index).into_iter().for_each(|other| std::mem::swap(other, light));
        }
    }

    /// Boxes around the instances, as they stand in a scene.
    fn boxes<'a>(&'a self, scene: &'a Scene) -> impl Iterator<Item = Bounds> + 'a {
        let instances = self.instances.iter().filter_map(|(index, _)| scene.instances.get(*index));
        instances.filter_map(|instance| {
            Some(world_box(&scene.meshes.get(instance.mesh as usize)?.bounds(), instance))
        })
    }

    /// Whether one of the instances sends out light of its own.
    fn emits(&self, scene: &Scene) -> bool {
        let glows = |material: u32| {
            let material = scene.materials.get(material as usize);
            material.is_some_and(|material| material.emission.max_element() > 0.0)
        };
        self.instances.iter().filter_map(|(_, instance)| scene.meshes.get(instance.mesh as usize)).any(
            |mesh| match &mesh.materials {
                crate::scene::TriangleMaterials::Uniform(material) => glows(*material),
                crate::scene::TriangleMaterials::PerTriangle(list) => {
                    list.iter().any(|&material| glows(material))
                }
            },
        )
    }
}

/// Box around a placed mesh.
fn world_box(of_mesh: &Bounds, instance: &Instance) -> Bounds {
    let Some(to_world) = instance.to_world else { return *of_mesh };
    if of_mesh.is_empty() {
        return *of_mesh;
    }
    let corners = of_mesh.corners().map(|corner| to_world.transform_point3(corner));
    let mut placed = Bounds::EMPTY;
    corners.for_each(|corner| placed = placed.union(Bounds { min: corner, max: corner }));
    placed
}

/// How much larger boxes are than what moves in them, over the scene's size and over its largest coordinate: rays that are rounded on their way
/// into the space of an instance may meet it a little beside it.
const MARGIN: f32 = 1e-4;
const ROUNDING: f32 = 32.0 * f32::EPSILON;

impl Session {
    /// Moves instances and lights to where a frame has them; their intensities stay.
    ///
    /// Images are those of a new session of the moved scene, to the bit. Of direct light, a mesh point forgets only what the motion may have
    /// changed: lights whose ray passes a box around something that moved, where it was or where it is, and lights that moved or, in the packed
    /// order, made room for one that did. It is traced again where an image needs it. Where `levels` are in use, or the [bounds](Scene::bounds) of the scene change, all
    /// is forgotten, and so is indirect light when anything moved. A frame that moves neither instances nor lights forgets nothing.
    ///
    /// # Errors
    /// See [`SessionError`]; then nothing has changed.
    pub fn move_to(&mut self, frame: &Frame) -> Result<Moved, SessionError> {
        let mut changes = Changes::of(frame, &self.scene)?;
        let mut moved = Moved {
            instances: changes.instances.len(),
            lights: changes.lights.len(),
            known: self.meshes.all_kept(&self.lights),
        };
        if changes.instances.is_empty() && changes.lights.is_empty() {
            return Ok(moved);
        }
        let bounds_before = self.scene.bounds();
        let mut boxes: Vec<Bounds> = changes.boxes(&self.scene).collect();
        changes.swap(&mut self.scene);
        if !changes.instances.is_empty()
            && let Err(error) = self.backend.rebuild(&self.scene)
        {
            changes.swap(&mut self.scene);
            return Err(error.into());
        }
        boxes.extend(changes.boxes(&self.scene));
        let bounds = self.scene.bounds();
        let largest = bounds.min.abs().max(bounds.max.abs()).max_element();
        let margin = MARGIN * bounds.extent().length() + ROUNDING * largest;
        boxes.retain(|one| !one.is_empty());
        for one in &mut boxes {
            *one = Bounds { min: one.min - margin, max: one.max + margin };
        }
        let lights_change =
            !changes.lights.is_empty() || bounds != bounds_before || changes.emits(&self.scene);
        let lights = lights_change.then(|| SceneLights::of(&self.scene));
        let after = lights.as_ref().unwrap_or(&self.lights);
        moved.known = self.meshes.forget_moved(bounds, boxes, [&self.lights, after]);
        if let Some(lights) = lights {
            self.lights = lights;
            self.emissive = EmissiveTriangles::of_scene(&self.scene);
        }
        Ok(moved)
    }
}
