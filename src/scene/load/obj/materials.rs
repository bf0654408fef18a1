//! The materials of an OBJ file: its MTL files, found and read, and which are used.

use std::collections::{HashMap, HashSet};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{Affine2, Vec2};

use super::chunk::{NameKind, NameStatement};
use crate::scene::load::mtl::{MtlMaps, parse_mtl};
use crate::scene::load::{LoadError, Warning, images, source};
use crate::scene::{AlphaMask, Material, Texture, TextureMap, Wrap};

/// Words of an `mtllib` statement that are tried as one name with spaces.
const LONGEST_NAME: usize = 16;

/// A material of an MTL file whose images are not read yet.
#[derive(Clone)]
struct Known {
    material: Material,
    maps: MtlMaps,
    library: PathBuf,
}

/// Materials by name, and those in use.
#[derive(Default)]
pub struct MaterialTable {
    known: HashMap<String, Known>,
    index: HashMap<String, u32>,
    used: Vec<Material>,
    images: HashMap<PathBuf, Option<Arc<Texture>>>,
    /// What was found and done.
    pub warnings: Vec<Warning>,
}

impl MaterialTable {
    /// Reads the MTL files that `mtllib` statements name; a missing one is a warning.
    ///
    /// # Errors
    /// What [`parse_mtl`] reports, and files that exist but cannot be read.
    pub fn load(names: &[NameStatement], obj: &Path) -> Result<Self, LoadError> {
        let mut table = Self::default();
        let mut read = HashSet::new();
        let folder = obj.parent().unwrap_or(Path::new(""));
        for statement in names.iter().filter(|statement| statement.kind == NameKind::Library) {
            let (files, missing) = library_files(&statement.name, folder);
            for name in missing {
                let message = format!("material file '{name}' not found");
                table.warnings.push(Warning {
                    file: obj.to_owned(),
                    line: Some(statement.line as usize),
                    message,
                });
            }
            for file in files {
                if read.insert(file.clone()) {
                    table.add_file(&file)?;
                }
            }
        }
        Ok(table)
    }

    fn add_file(&mut self, path: &Path) -> Result<(), LoadError> {
        let text = fs::read(path).map_err(|source| LoadError::Read { file: path.to_owned(), source })?;
        let file = parse_mtl(&text, path)?;
        self.warnings.extend(file.warnings);
        for (material, maps) in file.materials.into_iter().zip(file.maps) {
            let library = path.to_owned();
            self.known.entry(material.name.clone()).or_insert(Known { material, maps, library });
        }
        Ok(())
    }

    /// A material with its images, which are read only for materials in use.
    fn complete(&mut self, known: Known) -> Material {
        let Known { mut material, maps, library } = known;
        let mut read = |name: &Option<String>| self.image(name.as_deref()?, &library);
        let (diffuse, emission, coverage) = (read(&maps.diffuse), read(&maps.emission), read(&maps.coverage));
        let map = |texture: Arc<Texture>| {
            // The files count from the lower left corner of the image.
            let transform = Affine2::from_translation(Vec2::Y) * Affine2::from_scale(Vec2::new(1.0, -1.0));
            TextureMap { texture, transform, wrap: [Wrap::Repeat; 2] }
        };
        material.diffuse_map = diffuse.clone().map(map);
        material.emission_map = emission.map(map);
        let coverage = match (coverage, diffuse) {
            (Some(coverage), _) => Some(Arc::new(coverage.with_coverage(&coverage))),
            // An image's own transparency counts too, as programs show it.
            (None, diffuse) => diffuse,
        };
        let mask =
            AlphaMask { map: coverage.map(map), alpha: maps.alpha.unwrap_or(1.0).max(0.0), cutoff: 0.5 };
        material.alpha_mask = (!mask.is_solid()).then_some(mask);
        material
    }

    /// An image beside an MTL file; `None` with a warning where it can't be read.
    fn image(&mut self, name: &str, library: &Path) -> Option<Arc<Texture>> {
        let folder = library.parent().unwrap_or(Path::new(""));
        let found = existing(name, folder).unwrap_or_else(|| folder.join(name));
        if let Some(known) = self.images.get(&found) {
            return known.clone();
        }
        let bytes = if found.is_file() { source::read_all(&found).ok() } else { None };
        let image = bytes
            .ok_or_else(|| "not found or not readable".to_owned())
            .and_then(|bytes| images::decode(&bytes));
        let image = match image {
            Ok(image) => Some(Arc::new(image)),
            Err(why) => {
                let message = format!("image '{}' is left out: {why}", name.escape_debug());
                self.warnings.push(Warning { file: library.to_owned(), line: None, message });
                None
            }
        };
        self.images.insert(found, image.clone());
        image
    }

    /// Index of a material for triangles; a name that no MTL file defines gets the default material,
    /// with a warning where it is first used.
    pub fn index(&mut self, name: &str, obj: &Path, line: u32) -> u32 {
        if let Some(&index) = self.index.get(name) {
            return index;
        }
        let index = self.used.len() as u32;
        let material = match self.known.get(name).cloned() {
            Some(known) => self.complete(known),
            None => {
                if !name.is_empty() {
                    let message = format!("material '{name}' is not defined, the default is used");
                    let line = Some(line as usize);
                    self.warnings.push(Warning { file: obj.to_owned(), line, message });
                }
                Material { name: name.to_owned(), ..Material::default() }
            }
        };
        self.used.push(material);
        self.index.insert(name.to_owned(), index);
        index
    }

    /// The materials in use, in the order of their indices, and the warnings.
    pub fn into_used(self) -> (Vec<Material>, Vec<Warning>) {
        (self.used, self.warnings)
    }
}

/// Existing files that an `mtllib` statement names, and names that no file has.
///
/// Names may contain spaces, escaped with a backslash or not, and one statement may name several files;
/// so the longest run of words that is a file's name is taken, from left to right.
fn library_files(statement: &str, folder: &Path) -> (Vec<PathBuf>, Vec<String>) {
    // NUL stands for an escaped space: no file name holds it.
    let escaped = statement.replace("\\ ", "\0");
    let words: Vec<String> = escaped.split_ascii_whitespace().map(|word| word.replace('\0', " ")).collect();
    let (mut files, mut missing) = (Vec::new(), Vec::new());
    let mut next = 0;
    while next < words.len() {
        let longest = (words.len() - next).min(LONGEST_NAME);
        let run = |count: usize| existing(&words[next..next + count].join(" "), folder);
        match (1..=longest).rev().find_map(|count| run(count).map(|file| (file, count))) {
            Some((file, count)) => {
                files.push(file);
                next += count;
            }
            None => {
                missing.push(words[next].clone());
                next += 1;
            }
        }
    }
    (files, missing)
}

/// The file of this name, as written, in quotes, or with Windows separators.
fn existing(name: &str, folder: &Path) -> Option<PathBuf> {
    let candidates = [name.to_owned(), name.trim_matches('"').to_owned(), name.replace('\\', "/")];
    candidates.into_iter().filter(|name| !name.is_empty()).map(|name| folder.join(name)).find(|path| {
        // A directory of that name is no material file; other obstacles are reported on reading.
        match fs::metadata(path) {
            Ok(metadata) => metadata.is_file(),
            Err(error) => error.kind() == io::ErrorKind::PermissionDenied,
        }
    })
}
