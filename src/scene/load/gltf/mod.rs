//! glTF 2.0, `.gltf` and `.glb`.
//!
//! The JSON part is read through the types of the crate `gltf-json`; everything that refers to something else by
//! number is looked up with a check, since files come from anywhere.

mod accessor;
mod animation;
mod document;
mod extensions;
mod material;
mod nodes;
mod primitive;

use std::collections::HashMap;
use std::path::Path;

use glam::{DAffine3, DMat4};

use self::document::Document;
use self::material::{Converted, Materials};
use self::nodes::{PlacedNode, single};
use self::primitive::{Context, Joints, MeshBuilder};
use super::compact::drop_unused_vertices;
use super::model::MAX_COORDINATE;
use super::transform::{is_invertible, move_mesh};
use super::{LoadError, Model, Part, source};
use crate::scene::{Instance, Material, TriangleMesh};

/// Reads a glTF file, with the buffers and images that it names.
///
/// Meshes that stand in one place are moved there; those in several are kept once, with an
/// [`Instance`] per place.
///
/// # Errors
/// [`LoadError::Read`], [`LoadError::Invalid`] with the place in the file, and [`LoadError::Empty`].
pub fn load_gltf(path: &Path) -> Result<Model, LoadError> {
    read_gltf(&source::read_all(path)?, path)
}

/// Reads a file's bytes; `path` names it in messages, and other files are looked for beside it.
///
/// # Errors
/// As [`load_gltf`].
pub fn read_gltf(bytes: &[u8], path: &Path) -> Result<Model, LoadError> {
    let document = Document::parse(bytes, path)?;
    let mut model = Model::default();
    extensions::check(&document, &mut model.warnings)?;
    let converted = Materials::convert(&document, &mut model.warnings)?;
    let nodes = document.placed_nodes()?;
    let mut rig = document.rig(&nodes)?;
    let moving = rig.moving();
    let moves = |number: usize| moving.get(number) == Some(&true);
    for (number, placed) in nodes.iter().enumerate() {
        if let Some(light) = document.light(placed)? {
            rig.lights.extend(moves(number).then_some((model.lights.len() as u32, number as u32)));
            model.lights.push(light);
        }
        if let Some(camera) = document.camera(placed, &mut model.warnings)? {
            rig.cameras.extend(moves(number).then_some((model.cameras.len() as u32, number as u32)));
            model.cameras.push(camera);
        }
    }
    model.rig = rig;
    let mut placer = Placer {
        document: &document,
        converted: &converted,
        nodes: &nodes,
        moving: &moving,
        model: &mut model,
    };
    placer.place_all()?;
    if model.instances.is_empty() {
        return Err(LoadError::Empty { file: path.to_owned(), skipped: model.skipped });
    }
    model.materials.extend(converted.into_iter().map(|converted| converted.material));
    // For primitives that name none.
    model.materials.push(Material::default());
    Ok(model)
}

/// A mesh as a node shows it: morph weights and skins make different geometry of one mesh.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
struct Shown {
    mesh: usize,
    /// The node, where it has weights or a skin of its own.
    node: Option<usize>,
}

/// All places of one mesh.
struct Uses {
    shown: Shown,
    name: String,
    /// With the number of the node.
    places: Vec<(usize, DAffine3)>,
}

/// Puts meshes where nodes have them.
struct Placer<'a> {
    document: &'a Document<'a>,
    converted: &'a [Converted],
    nodes: &'a [PlacedNode],
    /// Which of them move.
    moving: &'a [bool],
    model: &'a mut Model,
}

impl Placer<'_> {
    fn place_all(&mut self) -> Result<(), LoadError> {
        let mut uses: Vec<Uses> = Vec::new();
        let mut known: HashMap<Shown, usize> = HashMap::new();
        for (number, placed) in self.nodes.iter().enumerate() {
            let node = &self.document.root.nodes[placed.index];
            let Some(mesh) = node.mesh.map(|mesh| mesh.value()) else { continue };
            let own_shape = node.skin.is_some() || node.weights.is_some();
            let shown = Shown { mesh, node: own_shape.then_some(placed.index) };
            let index = *known.entry(shown).or_insert_with(|| {
                let name = node.name.clone().unwrap_or_default();
                uses.push(Uses { shown, name, places: Vec::new() });
                uses.len() - 1
            });
            let places = &mut uses[index].places;
            match self.document.gpu_instances(placed.index)? {
                Some(instances) => {
                    places.extend(instances.into_iter().map(|local| (number, placed.to_world * local)));
                }
                None => places.push((number, placed.to_world)),
            }
        }
        uses.into_iter().try_for_each(|uses| self.place(uses))
    }

    fn place(&mut self, uses: Uses) -> Result<(), LoadError> {
        let Some(mut mesh) = self.mesh(uses.shown)? else { return Ok(()) };
        let mut places = uses.places;
        let is_skinned = uses.shown.node.is_some_and(|node| self.document.root.nodes[node].skin.is_some());
        if is_skinned {
            // Joints place a skinned mesh; its node doesn't.
            places = vec![(0, DAffine3::IDENTITY)];
        }
        let all = places.len();
        places.retain(|(_, to_world)| is_invertible(&single(to_world).matrix3));
        let first = self.model.instances.len();
        if !is_skinned {
            let moving =
                places.iter().enumerate().filter(|(_, (node, _))| self.moving.get(*node) == Some(&true));
            let hung = moving.map(|(place, (node, _))| ((first + place) as u32, *node as u32));
            self.model.rig.instances.extend(hung);
        } else if self.moving.contains(&true) {
            self.note("skinned meshes");
        }
        let places: Vec<_> = places.iter().map(|(_, to_world)| single(to_world)).collect();
        self.model.skipped.flat_instances += (all - places.len()) as u64;
        if let Some(bad) = places.iter().find(|place| !self.fits(&mesh, place)) {
            let place = format!("meshes[{}]", uses.shown.mesh);
            let problem =
                format!("reaches beyond ±{:e} where it stands ({})", MAX_COORDINATE, bad.translation);
            return Err(self.document.error(&place, problem));
        }
        let index = self.model.meshes.len() as u32;
        match places[..] {
            [] => return Ok(()),
            [only] => {
                move_mesh(&mut mesh, &only);
                self.model.instances.push(Instance { mesh: index, to_world: None });
            }
            _ => {
                let instances = places.iter().map(|&place| Instance { mesh: index, to_world: Some(place) });
                self.model.instances.extend(instances);
            }
        }
        let triangles = 0..mesh.triangles.len() as u32;
        self.model.parts.push(Part { mesh: index, object: uses.name, group: mesh.name.clone(), triangles });
        self.model.meshes.push(mesh);
        Ok(())
    }

    /// Tells that something stands still that may move in the file.
    fn note(&mut self, what: &str) {
        let note = format!("{}: {what} don't move", self.document.path.display());
        if !self.model.rig.notes.contains(&note) {
            self.model.rig.notes.push(note);
        }
    }

    /// Whether the mesh stays within what the backends can take.
    fn fits(&self, mesh: &TriangleMesh, to_world: &glam::Affine3A) -> bool {
        let bounds = mesh.bounds();
        (0..8).all(|corner| {
            let choose = |axis: usize| {
                if corner >> axis & 1 == 1 { bounds.max[axis] } else { bounds.min[axis] }
            };
            let corner = to_world.transform_point3(glam::Vec3::new(choose(0), choose(1), choose(2)));
            corner.abs().cmple(glam::Vec3::splat(MAX_COORDINATE)).all()
        })
    }

    /// The triangles of a mesh; `None` where there are none.
    fn mesh(&mut self, shown: Shown) -> Result<Option<TriangleMesh>, LoadError> {
        let document = self.document;
        let Some(source) = document.root.meshes.get(shown.mesh) else {
            return Err(document.error("nodes", format!("meshes[{}] does not exist", shown.mesh)));
        };
        let node = shown.node.and_then(|node| document.root.nodes.get(node));
        let weights = node.and_then(|node| node.weights.as_ref()).or(source.weights.as_ref());
        let weights = weights.map_or(&[][..], Vec::as_slice);
        let skin = node.and_then(|node| node.skin);
        let joints = skin.map(|skin| self.joints(skin.value())).transpose()?;
        let mut builder = MeshBuilder::default();
        for (index, primitive) in source.primitives.iter().enumerate() {
            let place = format!("meshes[{}].primitives[{index}]", shown.mesh);
            let default = self.converted.len();
            let material = primitive.material.map_or(default, |material| material.value());
            if material > default || (material == default && primitive.material.is_some()) {
                return Err(document.error(&place, format!("materials[{material}] does not exist")));
            }
            let uv_set = self.converted.get(material).map_or(0, |converted| converted.uv_set);
            let context = Context {
                place: &place,
                material: material as u32,
                uv_set,
                weights,
                joints: joints.as_ref(),
            };
            builder.add(document, primitive, &context)?;
        }
        self.model.skipped.add(&builder.skipped);
        self.model.skipped.bad_normals += builder.bad_normals();
        let name = source.name.clone().unwrap_or_default();
        let mut mesh = builder.finish(name);
        if let Some(mesh) = &mut mesh {
            drop_unused_vertices(mesh);
        }
        Ok(mesh)
    }

    /// Joint matrices of a skin.
    fn joints(&self, index: usize) -> Result<Joints, LoadError> {
        let document = self.document;
        let place = format!("skins[{index}]");
        let Some(skin) = document.root.skins.get(index) else {
            return Err(document.error("nodes", format!("{place} does not exist")));
        };
        let inverse = match skin.inverse_bind_matrices {
            None => Vec::new(),
            Some(accessor) => document.floats::<16>(accessor.value(), &place)?,
        };
        let joints = skin.joints.iter().enumerate().map(|(i, joint)| {
            let joint = joint.value();
            let Some(placed) = self.nodes.iter().find(|placed| placed.index == joint) else {
                return Err(document.error(&place, format!("its joint nodes[{joint}] is not in the scene")));
            };
            let bind = inverse.get(i).map_or(DAffine3::IDENTITY, |matrix| {
                DAffine3::from_mat4(DMat4::from_cols_array(&matrix.map(f64::from)))
            });
            Ok(placed.to_world * bind)
        });
        joints.collect()
    }
}
