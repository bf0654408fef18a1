//! The node graph: what stands where.

use glam::{Affine3A, DAffine3, DMat4, DQuat, DVec3, Vec3};
use gltf_json::Node;
use gltf_json::extensions::scene::khr_lights_punctual::{Light as PunctualLight, Type};
use gltf_json::validation::Checked;
use serde_json::Value;

use super::document::Document;
use crate::scene::animation::Local;
use crate::scene::load::{LoadError, Warning};
use crate::scene::{Camera, Light, LightKind};

/// A node of the scene with its place in it.
pub struct PlacedNode {
    /// Index of the node.
    pub index: usize,
    /// The node that it is relative to, by its place among the nodes of the scene.
    pub parent: Option<usize>,
    /// Node to scene, in double precision: long chains of nodes would lose digits.
    pub to_world: DAffine3,
}

/// A node's place for 32-bit geometry.
pub fn single(to_world: &DAffine3) -> Affine3A {
    Affine3A::from_mat4(DMat4::from(*to_world).as_mat4())
}

impl Document<'_> {
    /// The nodes of the default scene, parents before children.
    ///
    /// # Errors
    /// [`LoadError::Invalid`] for nodes that don't exist, are reached twice (every cycle is such a case), or stand
    /// nowhere finite.
    pub fn placed_nodes(&self) -> Result<Vec<PlacedNode>, LoadError> {
        let nodes = &self.root.nodes;
        let mut seen = vec![false; nodes.len()];
        let mut placed = Vec::new();
        // Not by recursion: a file may nest more nodes than the stack holds.
        let mut pending: Vec<(usize, Option<usize>, DAffine3, String)> = Vec::new();
        let mut roots = self.scene_roots()?;
        roots.reverse();
        pending.extend(roots.into_iter().map(|root| (root, None, DAffine3::IDENTITY, "scene".to_owned())));
        while let Some((index, parent, parent_to_world, place)) = pending.pop() {
            let Some(node) = nodes.get(index) else {
                return Err(self.error(&place, format!("nodes[{index}] does not exist")));
            };
            let place = format!("nodes[{index}]");
            if std::mem::replace(&mut seen[index], true) {
                let problem = "is reached twice: it has two parents, or is its own ancestor".to_owned();
                return Err(self.error(&place, problem));
            }
            let to_world = parent_to_world * local(node).matrix();
            if !single(&to_world).is_finite() {
                return Err(self.error(&place, "its transform is not finite".to_owned()));
            }
            let children = node.children.iter().flatten().rev();
            let own = Some(placed.len());
            let pend = |child: usize| (child, own, to_world, format!("{place}.children"));
            pending.extend(children.map(|child| pend(child.value())));
            placed.push(PlacedNode { index, parent, to_world });
        }
        Ok(placed)
    }

    /// Roots of the default scene, else of the first, else all nodes without a parent.
    fn scene_roots(&self) -> Result<Vec<usize>, LoadError> {
        let root = &self.root;
        let scene = root.scene.map(|scene| scene.value());
        if let Some(index) = scene
            && index >= root.scenes.len()
        {
            return Err(self.error("scene", format!("scenes[{index}] does not exist")));
        }
        if let Some(scene) = root.scenes.get(scene.unwrap_or(0)) {
            return Ok(scene.nodes.iter().map(|node| node.value()).collect());
        }
        let mut is_child = vec![false; root.nodes.len()];
        for child in root.nodes.iter().flat_map(|node| node.children.iter().flatten()) {
            if let Some(is_child) = is_child.get_mut(child.value()) {
                *is_child = true;
            }
        }
        Ok((0..root.nodes.len()).filter(|&node| !is_child[node]).collect())
    }

    /// Places of a node's instances by EXT_mesh_gpu_instancing, relative to the node; `None` where it has no such
    /// extension.
    ///
    /// # Errors
    /// [`LoadError::Invalid`].
    pub fn gpu_instances(&self, index: usize) -> Result<Option<Vec<DAffine3>>, LoadError> {
        let extensions = self.root.nodes.get(index).and_then(|node| node.extensions.as_ref());
        let Some(extension) = extensions.and_then(|e| e.others.get("EXT_mesh_gpu_instancing")) else {
            return Ok(None);
        };
        let place = format!("nodes[{index}].extensions.EXT_mesh_gpu_instancing");
        let attribute = |name: &str| -> Option<usize> {
            extension.get("attributes")?.get(name).and_then(Value::as_u64)?.try_into().ok()
        };
        let translations =
            attribute("TRANSLATION").map(|accessor| self.floats::<3>(accessor, &place)).transpose()?;
        let rotations =
            attribute("ROTATION").map(|accessor| self.floats::<4>(accessor, &place)).transpose()?;
        let scales = attribute("SCALE").map(|accessor| self.floats::<3>(accessor, &place)).transpose()?;
        let counts = [
            translations.as_ref().map(Vec::len),
            rotations.as_ref().map(Vec::len),
            scales.as_ref().map(Vec::len),
        ];
        let Some(count) = counts.into_iter().flatten().next() else {
            return Err(self.error(&place, "places nothing: no TRANSLATION, ROTATION or SCALE".to_owned()));
        };
        if counts.into_iter().flatten().any(|other| other != count) {
            return Err(self.error(&place, "its attributes differ in number".to_owned()));
        }
        let vector = |list: &Option<Vec<[f32; 3]>>, i: usize, default: DVec3| {
            list.as_ref().map_or(default, |list| DVec3::from_array(list[i].map(f64::from)))
        };
        let places = (0..count).map(|i| {
            let rotation = rotations.as_ref().map_or(DQuat::IDENTITY, |list| quaternion(list[i]));
            let (scale, translation) =
                (vector(&scales, i, DVec3::ONE), vector(&translations, i, DVec3::ZERO));
            DAffine3::from_scale_rotation_translation(scale, rotation, translation)
        });
        Ok(Some(places.collect()))
    }

    /// The light of a node, by KHR_lights_punctual: E_i in candela, of directional lights in lux.
    ///
    /// # Errors
    /// [`LoadError::Invalid`].
    pub fn light(&self, placed: &PlacedNode) -> Result<Option<Light>, LoadError> {
        let extension = self.root.nodes[placed.index].extensions.as_ref();
        let Some(reference) = extension.and_then(|extensions| extensions.khr_lights_punctual.as_ref()) else {
            return Ok(None);
        };
        let index = reference.light.value();
        let lights = self.root.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref());
        let Some(light) = lights.and_then(|lights| lights.lights.get(index)) else {
            let place = format!("nodes[{}]", placed.index);
            return Err(self.error(&place, format!("light {index} does not exist")));
        };
        let place = format!("extensions.KHR_lights_punctual.lights[{index}]");
        let intensity = Vec3::from_array(light.color) * light.intensity;
        if !intensity.is_finite() || intensity.min_element() < 0.0 {
            let problem = "color and intensity must be finite and not negative".to_owned();
            return Err(self.error(&place, problem));
        }
        let position = placed.to_world.translation.as_vec3();
        let direction = (placed.to_world.matrix3 * DVec3::NEG_Z).try_normalize();
        let direction = direction.unwrap_or(DVec3::NEG_Z).as_vec3();
        let kind = self.kind(light, direction, &place)?;
        Ok(Some(Light { position, intensity, kind }))
    }

    fn kind(&self, light: &PunctualLight, direction: Vec3, place: &str) -> Result<LightKind, LoadError> {
        match light.type_ {
            Checked::Valid(Type::Point) => Ok(LightKind::Point),
            Checked::Valid(Type::Directional) => Ok(LightKind::Directional { direction }),
            Checked::Valid(Type::Spot) => {
                let (inner, outer) = light.spot.as_ref().map_or((0.0, std::f32::consts::FRAC_PI_4), |spot| {
                    (spot.inner_cone_angle, spot.outer_cone_angle)
                });
                let right_angle = std::f32::consts::FRAC_PI_2 + 1e-3;
                if !(0.0 <= inner && inner <= outer && outer <= right_angle) {
                    let problem =
                        format!("0 ≤ innerConeAngle ≤ outerConeAngle ≤ π/2 needed: {inner}, {outer}");
                    return Err(self.error(place, problem));
                }
                Ok(LightKind::Spot { direction, inner_cosine: inner.cos(), outer_cosine: outer.cos() })
            }
            Checked::Invalid => Err(self.error(place, "its type is unknown".to_owned())),
        }
    }

    /// The camera of a node; an orthographic one is left out with a warning.
    ///
    /// # Errors
    /// [`LoadError::Invalid`].
    pub fn camera(
        &self,
        placed: &PlacedNode,
        warnings: &mut Vec<Warning>,
    ) -> Result<Option<Camera>, LoadError> {
        let node = &self.root.nodes[placed.index];
        let Some(index) = node.camera.map(|camera| camera.value()) else { return Ok(None) };
        let place = format!("cameras[{index}]");
        let Some(camera) = self.root.cameras.get(index) else {
            let problem = format!("{place} does not exist");
            return Err(self.error(&format!("nodes[{}].camera", placed.index), problem));
        };
        let name =
            node.name.clone().or_else(|| camera.name.clone()).unwrap_or_else(|| format!("camera{index}"));
        let Some(perspective) = &camera.perspective else {
            let message = format!("camera '{}' is not a perspective one, left out", name.escape_debug());
            warnings.push(Warning { file: self.path.to_owned(), line: None, message });
            return Ok(None);
        };
        let vertical_fov = perspective.yfov.to_degrees();
        if !(vertical_fov > 0.0 && vertical_fov < 180.0) {
            return Err(self.error(&place, format!("yfov {} is not between 0 and π", perspective.yfov)));
        }
        let axis = |axis: DVec3| (placed.to_world.matrix3 * axis).try_normalize();
        let (Some(forward), Some(up)) = (axis(DVec3::NEG_Z), axis(DVec3::Y)) else {
            return Err(
                self.error(&format!("nodes[{}]", placed.index), "its camera has no direction".to_owned())
            );
        };
        if forward.cross(up).length() < 1e-6 {
            return Err(self.error(&format!("nodes[{}]", placed.index), "its camera has no up".to_owned()));
        }
        let position = placed.to_world.translation;
        // As far away as the camera is from the origin: a nearer point would lose the direction's digits.
        let look_at = position + forward * position.abs().max_element().max(1.0);
        let (position, look_at) = (position.as_vec3(), look_at.as_vec3());
        Ok(Some(Camera { name, position, look_at, up: up.as_vec3(), vertical_fov }))
    }
}

/// A node relative to its parent.
pub fn local(node: &Node) -> Local {
    if let Some(matrix) = node.matrix {
        return Local::Matrix(DAffine3::from_mat4(DMat4::from_cols_array(&matrix.map(f64::from))));
    }
    let vector =
        |values: Option<[f32; 3]>, default| values.map_or(default, |v| DVec3::from_array(v.map(f64::from)));
    Local::Steps {
        scale: vector(node.scale, DVec3::ONE),
        rotation: node.rotation.map_or(DQuat::IDENTITY, |rotation| quaternion(rotation.0)),
        translation: vector(node.translation, DVec3::ZERO),
    }
}

/// A rotation; writers round, so it is made unit length again.
fn quaternion(values: [f32; 4]) -> DQuat {
    let quaternion = DQuat::from_array(values.map(f64::from));
    let length = quaternion.length();
    if length > 0.0 && length.is_finite() { quaternion / length } else { DQuat::IDENTITY }
}
