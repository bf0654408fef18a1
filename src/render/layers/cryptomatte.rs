//! Object and material ids as Cryptomatte: names by their hash, and how much of a pixel each covers (Friedman and Jones, 2015; version 1.2 of
//! the specification).

use std::collections::{BTreeMap, BTreeSet, HashMap};

use crate::scene::Scene;

/// Ids that a pixel has at most, those that cover most of it; two to a group of channels.
pub(super) const RANKS: usize = 6;

/// What ids are of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum IdKind {
    /// Placed meshes.
    Object,
    /// Materials.
    Material,
}

impl IdKind {
    /// The layer's name.
    pub fn layer(self) -> &'static str {
        match self {
            Self::Object => "CryptoObject",
            Self::Material => "CryptoMaterial",
        }
    }

    /// Names of its channels, in the order of [`ranked`].
    pub fn channels(self) -> impl Iterator<Item = String> {
        (0..RANKS / 2).flat_map(move |group| {
            ["R", "G", "B", "A"].map(|channel| format!("{}{group:02}.{channel}", self.layer()))
        })
    }
}

/// The names of what ids are of, different for each.
pub(super) struct Names {
    kind: IdKind,
    names: Vec<String>,
}

impl Names {
    /// The names in a scene: a mesh's or material's, with its number among those of that name if there are several.
    pub fn new(kind: IdKind, scene: &Scene) -> Self {
        let own: Vec<&str> = match kind {
            IdKind::Object => {
                let name = |mesh: u32| scene.meshes.get(mesh as usize).map_or("", |mesh| &mesh.name);
                scene.instances.iter().map(|instance| name(instance.mesh)).collect()
            }
            IdKind::Material => scene.materials.iter().map(|material| material.name.as_str()).collect(),
        };
        let word = if kind == IdKind::Object { "object" } else { "material" };
        let mut counts: HashMap<&str, usize> = HashMap::new();
        own.iter().for_each(|name| *counts.entry(name).or_default() += 1);
        let mut before: HashMap<String, usize> = HashMap::new();
        let unique = |name: &str| {
            let shown = if name.is_empty() { word } else { name };
            if counts.get(name) == Some(&1) && !name.is_empty() {
                return shown.to_owned();
            }
            let number = before.entry(name.to_owned()).or_default();
            *number += 1;
            format!("{shown}#{number}")
        };
        let names = own.into_iter().map(unique).collect();
        Self { kind, names }
    }

    /// What the ids are of.
    pub fn kind(&self) -> IdKind {
        self.kind
    }

    /// The id that channels hold.
    pub fn id(&self, number: u32) -> f32 {
        f32::from_bits(self.bits(number))
    }

    fn bits(&self, number: u32) -> u32 {
        id_bits(self.names.get(number as usize).map_or("", String::as_str))
    }

    /// The attributes by which other programs find the layer and its names; of the names, those that the image shows.
    pub fn attributes(&self, shown: &BTreeSet<u32>) -> Vec<(String, String)> {
        let named = shown.iter().filter_map(|&number| {
            Some((self.names.get(number as usize)?, format!("{:08x}", self.bits(number))))
        });
        let manifest: BTreeMap<&String, String> = named.collect();
        let layer = self.kind.layer();
        let key = format!("{:08x}", hash(layer));
        let attribute = |name: &str, value: String| {
            (format!("cryptomatte/{}/{name}", key.get(..7).unwrap_or(&key)), value)
        };
        vec![
            attribute("name", layer.to_owned()),
            attribute("hash", "MurmurHash3_32".to_owned()),
            attribute("conversion", "uint32_to_float32".to_owned()),
            attribute("manifest", serde_json::json!(manifest).to_string()),
        ]
    }
}

/// Ids and coverages of a pixel by falling coverage, one after the other, as the channels hold them; 0 beyond. `found` has what samples
/// hit, each thing perhaps several times.
pub(super) fn ranked(
    names: &Names,
    found: impl Iterator<Item = (u32, u32)>,
    samples: u32,
) -> [f32; 2 * RANKS] {
    let mut counts: BTreeMap<u32, u32> = BTreeMap::new();
    found.for_each(|(number, count)| *counts.entry(number).or_default() += count);
    let mut counts: Vec<(u32, u32)> = counts.into_iter().collect();
    counts.sort_by_key(|&(number, count)| (std::cmp::Reverse(count), number));
    let mut ranks = [0.0; 2 * RANKS];
    for (rank, (number, count)) in ranks.as_chunks_mut::<2>().0.iter_mut().zip(counts) {
        *rank = [names.id(number), count as f32 / samples.max(1) as f32];
    }
    ranks
}

/// The hash of a name as the bits of a float that is neither 0 nor tiny nor infinite nor a not-a-number.
fn id_bits(name: &str) -> u32 {
    let hash = hash(name);
    let exponent = hash >> 23 & 255;
    if exponent == 0 || exponent == 255 { hash ^ 1 << 23 } else { hash }
}

/// MurmurHash3, 32 bits, seed 0.
fn hash(name: &str) -> u32 {
    // Reading from memory can't fail.
    murmur3::murmur3_32(&mut name.as_bytes(), 0).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Material, TriangleMesh};

    /// The examples of Cryptomatte's specification, and a hash whose exponent would make it a tiny number.
    #[test]
    fn ids_are_those_of_the_specification() {
        assert_eq!(hash("hello"), 0x248b_fa47);
        assert_eq!(hash("hello, world"), 0x149b_bb7f);
        assert_eq!(hash(""), 0);
        // A name of hash 0 would be the id of nothing.
        assert_eq!(id_bits(""), 1 << 23);
    }

    /// Ids tell things apart, so that names have to be different; those that are stay as they are.
    #[test]
    fn names_are_different() {
        let mut scene = Scene::new();
        let mesh = |name: &str| TriangleMesh {
            name: name.to_owned(),
            ..TriangleMesh::new(vec![[0.0; 3]; 3], vec![[0, 1, 2]])
        };
        for name in ["ball", "tree", ""] {
            scene.add(mesh(name));
        }
        scene.place(1, glam::Affine3A::IDENTITY);
        assert_eq!(Names::new(IdKind::Object, &scene).names, ["ball", "tree#1", "object#1", "tree#2"]);
        scene.add_material(Material { name: "red".to_owned(), ..Material::default() });
        let names = Names::new(IdKind::Material, &scene).names;
        assert_eq!(names.last().unwrap(), "red");
    }

    /// What covers most comes first, whatever the order in which samples found it.
    #[test]
    fn ranks_fall() {
        let names =
            Names { kind: IdKind::Object, names: (0..9).map(|number| format!("object {number}")).collect() };
        let ranks = ranked(&names, [(3, 1), (5, 4), (3, 2), (7, 1)].into_iter(), 16);
        assert_eq!(ranks[..8], [names.id(5), 0.25, names.id(3), 0.1875, names.id(7), 0.0625, 0.0, 0.0]);
        // Of nine things, six stay.
        let ranks = ranked(&names, (0..9).map(|number| (number, 1)), 9);
        assert!(ranks.iter().all(|&value| value != 0.0));
    }
}
