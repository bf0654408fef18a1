//! Fingerprints of a scene: what tells whether values that were found in one scene are those of another.

use std::collections::HashMap;
use std::fmt::{self, Debug, Write as _};
use std::sync::Arc;

use bytemuck::{NoUninit, cast_slice};
use serde::{Deserialize, Serialize};

use super::mesh::TriangleMaterials;
use super::scene::Scene;
use super::texture::{Texture, TextureMap};

/// A cryptographic hash (BLAKE3): equal ones mean equal contents.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Fingerprint([u8; 32]);

impl Fingerprint {
    /// Of how a value prints itself, which for numbers is exact.
    pub fn of(value: &impl Debug) -> Self {
        let mut writer = Writer::default();
        writer.value(value);
        writer.finish()
    }
}

/// The first eight bytes, in hexadecimal digits.
impl fmt::Display for Fingerprint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().take(8).try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

/// Fingerprints of a scene's parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SceneFingerprint {
    /// What rays meet: triangles, their placement, their sides, and where they are cut out.
    pub geometry: Fingerprint,
    /// Where lights are, and of which kind.
    pub lights: Fingerprint,
    /// How bright lights are, and how surfaces reflect and emit.
    pub appearance: Fingerprint,
}

impl SceneFingerprint {
    /// Of a scene. Names count for nothing.
    pub fn of(scene: &Scene) -> Self {
        Self { geometry: geometry(scene), lights: lights(scene), appearance: appearance(scene) }
    }
}

impl fmt::Display for SceneFingerprint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}-{}-{}", self.geometry, self.lights, self.appearance)
    }
}

fn geometry(scene: &Scene) -> Fingerprint {
    let mut writer = Writer::default();
    let masked =
        |material: u32| scene.materials.get(material as usize).is_some_and(|m| m.alpha_mask.is_some());
    for mesh in &scene.meshes {
        writer.array(mesh.positions.as_slice());
        writer.array(&mesh.triangles);
        let any_masked = match &mesh.materials {
            TriangleMaterials::Uniform(material) => {
                writer.value(material);
                masked(*material)
            }
            TriangleMaterials::PerTriangle(materials) => {
                writer.array(materials);
                materials.iter().any(|material| masked(*material))
            }
        };
        if any_masked {
            writer.array(mesh.uvs.as_deref().unwrap_or_default());
        }
    }
    writer.value(&(&scene.instances, scene.bounds()));
    for material in &scene.materials {
        writer.value(&(material.two_sided, material.cull, material.lamp));
        if let Some(mask) = &material.alpha_mask {
            writer.value(&(mask.alpha, mask.cutoff));
            writer.map(mask.map.as_ref());
        }
    }
    writer.finish()
}

fn lights(scene: &Scene) -> Fingerprint {
    let mut writer = Writer::default();
    for light in &scene.lights {
        writer.value(&(light.position, light.kind));
    }
    // Emissive triangles may be among the lights, and are cut up by what they emit.
    for material in &scene.materials {
        writer.value(&material.emission);
        writer.map(material.emission_map.as_ref());
    }
    writer.finish()
}

fn appearance(scene: &Scene) -> Fingerprint {
    let mut writer = Writer::default();
    for mesh in &scene.meshes {
        writer.array(mesh.normals.as_deref().unwrap_or_default());
        writer.array(mesh.uvs.as_deref().unwrap_or_default());
        writer.array(mesh.colors.as_deref().unwrap_or_default());
    }
    for material in &scene.materials {
        writer.value(&(material.diffuse, material.specular, material.emission));
        writer.map(material.diffuse_map.as_ref());
        writer.map(material.emission_map.as_ref());
    }
    let intensities: Vec<_> = scene.lights.iter().map(|light| light.intensity).collect();
    writer.value(&(intensities, scene.falloff, scene.background));
    writer.finish()
}

/// Hashes what is written to it.
#[derive(Default)]
struct Writer {
    hasher: blake3::Hasher,
    /// Hashes of textures, which several materials may share, by address.
    textures: HashMap<*const Texture, blake3::Hash>,
}

impl Writer {
    /// An array with its length, so that arrays that follow each other can't be cut otherwise.
    fn array<T: NoUninit>(&mut self, array: &[T]) {
        self.hasher.update(&(array.len() as u64).to_le_bytes());
        self.hasher.update(cast_slice(array));
    }

    fn value(&mut self, value: &impl Debug) {
        // Hashing can't fail.
        let _ = write!(self, "{value:?};");
    }

    fn map(&mut self, map: Option<&TextureMap>) {
        self.value(&map.map(|map| (map.transform, map.wrap)));
        let Some(map) = map else { return };
        let hash = *self.textures.entry(Arc::as_ptr(&map.texture)).or_insert_with(|| {
            let (width, height, texels) = map.texture.contents();
            let mut hasher = blake3::Hasher::new();
            hasher.update(&width.to_le_bytes());
            hasher.update(&height.to_le_bytes());
            hasher.update(cast_slice(texels));
            hasher.finalize()
        });
        self.hasher.update(hash.as_bytes());
    }

    fn finish(&self) -> Fingerprint {
        Fingerprint(*self.hasher.finalize().as_bytes())
    }
}

impl fmt::Write for Writer {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.hasher.update(text.as_bytes());
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use glam::{Affine3A, Vec3};

    use super::*;
    use crate::scene::{Light, Material, TriangleMesh};

    fn scene() -> Scene {
        let mut scene = Scene::new();
        let red = scene.add_material(Material::diffuse(Vec3::X));
        let corners = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        scene.add(TriangleMesh::new(corners, vec![[0, 1, 2]]).with_material(red));
        scene.lights.push(Light::point(Vec3::Z, Vec3::ONE));
        scene
    }

    /// What a change of a scene changes is what depends on it: which parts of the fingerprint differ.
    #[test]
    fn parts_differ_with_what_they_are_of() {
        let before = SceneFingerprint::of(&scene());
        let changed = |change: &dyn Fn(&mut Scene)| {
            let mut scene = scene();
            change(&mut scene);
            let after = SceneFingerprint::of(&scene);
            [
                after.geometry != before.geometry,
                after.lights != before.lights,
                after.appearance != before.appearance,
            ]
        };
        assert_eq!(changed(&|_| {}), [false; 3]);
        assert_eq!(changed(&|s| s.materials[1].name = "other".into()), [false; 3]);
        assert_eq!(changed(&|s| s.place(0, Affine3A::from_translation(Vec3::X))), [true, false, false]);
        assert_eq!(changed(&|s| s.materials[1].two_sided = true), [true, false, false]);
        assert_eq!(changed(&|s| s.lights[0].position.x = 1e-6), [false, true, false]);
        assert_eq!(changed(&|s| s.lights[0].intensity = Vec3::X), [false, false, true]);
        assert_eq!(changed(&|s| s.materials[1].diffuse = Vec3::Y), [false, false, true]);
        assert_eq!(changed(&|s| s.background = Vec3::ONE), [false, false, true]);
    }
}
