//! What the tables of a scene file and its models add up to.

use std::sync::Arc;

use glam::Affine3A;

use super::keyframes::still_node;
use crate::scene::animation::{Counts, Node, Rig, double};
use crate::scene::load::{Model, Skipped, Warning, transform};
use crate::scene::{Camera, Instance, Material, Scene, TriangleMaterials, TriangleMesh};

/// Where a model stands.
pub struct Placement {
    /// Model to world; `None` where the file states no transform.
    pub to_world: Option<Affine3A>,
    /// How it moves from there, if it does.
    pub motion: Option<Node>,
}

/// The scene so far.
#[derive(Default)]
pub struct Gathered {
    /// Its geometry, materials and lights.
    pub scene: Scene,
    /// What moves of them with a node.
    pub rig: Rig,
    /// Cameras, those of the scene file first.
    pub cameras: Vec<Camera>,
    /// Elements of the models that were left out.
    pub skipped: Skipped,
    /// Warnings for the user.
    pub warnings: Vec<Warning>,
}

impl Gathered {
    /// Adds a model in all its placements.
    pub fn add(&mut self, model: Model, placements: &[Placement]) {
        let scene = &mut self.scene;
        let first_mesh = scene.meshes.len() as u32;
        let first_material = scene.materials.len() as u32;
        scene.materials.extend(model.materials);
        let mut instances = model.instances;
        let mut meshes = model.meshes;
        for mesh in &mut meshes {
            match &mut mesh.materials {
                TriangleMaterials::Uniform(material) => *material += first_material,
                TriangleMaterials::PerTriangle(list) => list.iter_mut().for_each(|m| *m += first_material),
            }
        }
        let of_model =
            Counts { instances: instances.len(), lights: model.lights.len(), cameras: model.cameras.len() };
        for (number, placement) in placements.iter().enumerate() {
            let to_world = placement.to_world.unwrap_or(Affine3A::IDENTITY);
            let root = placement.motion.clone().unwrap_or_else(|| still_node(double(&to_world)));
            let first = Counts {
                instances: scene.instances.len() + number * of_model.instances,
                lights: scene.lights.len(),
                cameras: self.cameras.len(),
            };
            self.rig.append(&model.rig, root, of_model, first);
            scene.lights.extend(model.lights.iter().map(|light| light.moved(&to_world)));
            let cameras = model.cameras.iter().map(|camera| camera.moved(&to_world));
            self.cameras.extend(cameras);
        }
        // Geometry that stands in one place only is moved there, which spares rays the way through an instance.
        let mut placements: Vec<_> = placements.iter().map(|placement| placement.to_world).collect();
        if let ([Some(to_world)], true) =
            (placements.as_slice(), instances.iter().all(|i| i.to_world.is_none()))
        {
            let to_world = *to_world;
            for mesh in &mut meshes {
                transform::move_mesh(mesh, &to_world);
            }
            placements = vec![None];
        }
        for placement in &placements {
            for instance in &mut instances {
                let to_world = match (placement, instance.to_world) {
                    (None, own) => own,
                    (Some(outer), None) => Some(*outer),
                    (Some(outer), Some(inner)) => Some(*outer * inner),
                };
                scene.instances.push(Instance { mesh: first_mesh + instance.mesh, to_world });
            }
        }
        scene.meshes.extend(meshes.into_iter().map(Arc::<TriangleMesh>::new));
        self.skipped.add(&model.skipped);
        self.warnings.extend(model.warnings);
    }

    /// Material 0 exists in every scene.
    pub fn ensure_material(&mut self) {
        if self.scene.materials.is_empty() {
            self.scene.materials.push(Material::default());
        }
    }
}
