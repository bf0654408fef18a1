//! Material overrides, resolved to per-triangle materials.

use glam::Vec3;

use super::Model;
use crate::scene::{Material, TriangleMaterials};

/// What an override applies to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Selector {
    /// The material of this name.
    Material(String),
    /// The triangles of the object or group of this name.
    Object(String),
    /// All triangles.
    All,
}

/// Values that replace those of materials; `None` leaves a value as it is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MaterialOverride {
    /// k_d.
    pub diffuse: Option<Vec3>,
    /// k_s.
    pub specular: Option<Vec3>,
    /// Emiss.
    pub emission: Option<Vec3>,
    /// Whether front and back are alike.
    pub two_sided: Option<bool>,
    /// Whether camera and reflected rays pass through backs.
    pub cull: Option<bool>,
}

impl MaterialOverride {
    fn apply(&self, material: &mut Material) {
        // A stated colour is the colour, not a factor of an image.
        if let Some(diffuse) = self.diffuse {
            (material.diffuse, material.diffuse_map) = (diffuse, None);
        }
        if let Some(emission) = self.emission {
            (material.emission, material.emission_map) = (emission, None);
        }
        material.specular = self.specular.unwrap_or(material.specular);
        material.two_sided = self.two_sided.unwrap_or(material.two_sided);
        material.cull = self.cull.unwrap_or(material.cull);
    }
}

impl Model {
    /// Applies an override; whether anything matched its selector.
    pub fn apply_override(&mut self, selector: &Selector, values: &MaterialOverride) -> bool {
        match selector {
            Selector::Material(name) => self.override_materials(|material| material.name == *name, values),
            Selector::All => self.override_materials(|_| true, values),
            Selector::Object(name) => self.override_object(name, values),
        }
    }

    fn override_materials(&mut self, selects: impl Fn(&Material) -> bool, values: &MaterialOverride) -> bool {
        let mut found = false;
        for material in self.materials.iter_mut().filter(|material| selects(material)) {
            values.apply(material);
            found = true;
        }
        found
    }

    /// Triangles of the object get copies of their materials, so that other objects keep theirs.
    fn override_object(&mut self, name: &str, values: &MaterialOverride) -> bool {
        let mut copies = vec![None; self.materials.len()];
        let mut found = false;
        for part in &self.parts {
            let in_group = part.group == name || part.group.split_ascii_whitespace().any(|g| g == name);
            if part.object != name && !in_group {
                continue;
            }
            found = true;
            let Some(mesh) = self.meshes.get_mut(part.mesh as usize) else { continue };
            let range = part.triangles.start as usize..part.triangles.end as usize;
            if let TriangleMaterials::Uniform(material) = mesh.materials {
                mesh.materials = TriangleMaterials::PerTriangle(vec![material; mesh.triangles.len()]);
            }
            let TriangleMaterials::PerTriangle(of_triangles) = &mut mesh.materials else { continue };
            for material in of_triangles.get_mut(range).unwrap_or_default() {
                let Some(copy) = copies.get_mut(*material as usize) else { continue };
                *material = *copy.get_or_insert_with(|| {
                    let mut changed = self.materials[*material as usize].clone();
                    values.apply(&mut changed);
                    self.materials.push(changed);
                    self.materials.len() as u32 - 1
                });
            }
        }
        found
    }
}
