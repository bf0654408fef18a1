//! Light meshes in files: what a session knows is kept for others (docs/light-mesh-files.md).

use std::fs::OpenOptions;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::known_view::KnownView;
use super::meshes::LightMeshes;
use crate::Bounds;
use crate::image::{ImageError, OutputFile};
use crate::light_mesh::direct::{DirectMesh, KnownPoints};
use crate::light_mesh::file::{Differences, MeshFile, MeshFileError, SectionsWriter};
use crate::light_mesh::indirect::IndirectMesh;
use crate::light_mesh::points::MeshError;
use crate::light_mesh::surface::{SavedSurfaceMesh, SurfaceMesh};
use crate::lights::PackedLights;
use crate::scene::{Fingerprint, Scene, SceneFingerprint};
use crate::settings::Settings;

/// Names of sections.
const IDENTITY: &str = "identity";
const LIGHTS: &str = "lights";
const SURFACE: &str = "surface";
const VIEWS: &str = "views";

/// What the values of a file belong to.
#[derive(Serialize, Deserialize)]
struct Identity {
    scene: SceneFingerprint,
    bounds: Bounds,
    /// Whether emissive triangles are among the lights.
    has_emitters: bool,
    /// Of what light from surfaces follows from, if there is any.
    indirect: Option<Fingerprint>,
}

/// Why light meshes can't be written to a file.
#[derive(Debug, thiserror::Error)]
pub enum WriteMeshesError {
    /// What is there already can't be used.
    #[error("{}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Why.
        source: MeshFileError,
    },
    /// The meshes can't be put together.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The file can't be written.
    #[error(transparent)]
    Write(#[from] ImageError),
}

/// What a file of light meshes brought.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RestoredMeshes {
    /// Mesh points of direct light.
    pub direct: u64,
    /// Views that need not be measured again.
    pub views: usize,
    /// Whether its light from surfaces was left out: lights are as bright or surfaces as dark as they were not when it was found.
    pub without_indirect: bool,
}

/// A scene, and what light meshes of it follow from.
#[derive(Clone, Copy)]
pub(super) struct MeshScene<'a> {
    pub scene: &'a Scene,
    pub lights: &'a PackedLights,
    pub settings: &'a Settings,
}

impl LightMeshes {
    /// The file of these meshes. If they have no light from surfaces, that of the file `before` is kept, if it is still right.
    ///
    /// # Errors
    /// See [`SectionsWriter::value`].
    fn to_file(&self, of: MeshScene, before: Option<&MeshFile>) -> Result<Vec<u8>, MeshFileError> {
        let mut writer = SectionsWriter::default();
        let mut identity = Identity {
            scene: SceneFingerprint::of(of.scene),
            bounds: of.scene.bounds(),
            has_emitters: of.lights.has_emitters(),
            indirect: self.indirect_fingerprint(),
        };
        let kept = match before.filter(|_| identity.indirect.is_none()) {
            Some(before) => Some((before, before.value::<Identity>(IDENTITY)?)),
            None => None,
        };
        let kept = kept.filter(|(_, kept)| kept.scene.appearance == identity.scene.appearance);
        if let Some((before, kept)) = &kept {
            identity.indirect = kept.indirect;
            for name in IndirectMesh::SECTIONS.into_iter().chain([SURFACE]) {
                before.section(name).iter().for_each(|kept| writer.bytes(name, kept.bytes().to_vec()));
            }
        }
        writer.value(IDENTITY, &identity)?;
        writer.value(LIGHTS, of.lights)?;
        self.direct.save(of.lights, &mut writer)?;
        if let Some(indirect) = &self.indirect {
            indirect.save(&mut writer)?;
        }
        if let Some(surface) = &self.surface {
            writer.value(SURFACE, &surface.saved())?;
        }
        writer.value(VIEWS, &self.views)?;
        Ok(writer.finish())
    }

    /// The meshes of a file.
    ///
    /// # Errors
    /// See [`MeshFileError`].
    pub(super) fn of_file(file: &MeshFile, of: MeshScene) -> Result<(Self, RestoredMeshes), MeshFileError> {
        let identity: Identity = file.value(IDENTITY)?;
        let own = SceneFingerprint::of(of.scene);
        let differences = Differences {
            geometry: identity.scene.geometry != own.geometry,
            lights: identity.scene.lights != own.lights || identity.has_emitters != of.lights.has_emitters(),
        };
        if differences.geometry || differences.lights {
            return Err(MeshFileError::OtherScene(differences));
        }
        let bounds = of.scene.bounds();
        let mut meshes = Self::new(bounds);
        meshes.renew_lights(of.lights);
        meshes.direct = DirectMesh::restore(bounds, of.lights, file)?;
        let mut restored = RestoredMeshes {
            direct: meshes.direct.store().positions().len() as u64,
            ..RestoredMeshes::default()
        };
        let looks_alike = identity.scene.appearance == own.appearance;
        restored.without_indirect = identity.indirect.is_some() && !looks_alike;
        if let Some(settings) = of.settings.mesh.indirect.as_ref().filter(|_| looks_alike) {
            let wanted = Self::wanted_indirect(of.scene, of.settings);
            if identity.indirect.is_some_and(|found| Some(found) != wanted) {
                return Err(MeshFileError::OtherSettings);
            }
            if identity.indirect.is_some() {
                meshes.indirect = IndirectMesh::restore(bounds, settings, file)?;
                if file.section(SURFACE).is_some() {
                    let saved = file.value::<SavedSurfaceMesh>(SURFACE)?;
                    let scale = of.settings.shading.direct_scale();
                    meshes.surface = Some(SurfaceMesh::restore(saved, settings, scale, of.lights)?);
                }
                meshes.accept_indirect(of.scene, of.settings);
            }
        }
        if looks_alike {
            meshes.views = file.value::<Vec<KnownView>>(VIEWS)?;
            restored.views = meshes.views.len();
        }
        Ok((meshes, restored))
    }

    /// Takes over what other meshes of the same scene know and these don't.
    ///
    /// # Errors
    /// [`MeshError::TooManySpacings`].
    pub(super) fn absorb(&mut self, other: &Self, lights: &PackedLights) -> Result<(), MeshError> {
        self.direct.absorb(&other.direct, lights)?;
        if self.indirect_fingerprint() == other.indirect_fingerprint() {
            if let (Some(own), Some(other)) = (&mut self.indirect, &other.indirect) {
                own.absorb(other)?;
            }
            let numbers = match (&mut self.surface, &other.surface) {
                (Some(own), Some(other)) => own.absorb(other),
                _ => Vec::new(),
            };
            for view in &other.views {
                if self.views.iter().all(|known| known.identity != view.identity) {
                    let renumbered = |&(number, count): &(u32, u32)| {
                        numbers.get(number as usize).map(|number| (*number, count))
                    };
                    let records = view.records.iter().filter_map(renumbered).collect();
                    self.views.push(KnownView { records, ..view.clone() });
                }
            }
        }
        Ok(())
    }

    /// Writes the meshes to a file, together with what is in it already. Several programs may do so at once: each waits for the others, and nothing
    /// that one of them wrote is lost.
    ///
    /// # Errors
    /// See [`WriteMeshesError`]; then the file is as it was.
    pub(super) fn update_file(&self, path: &Path, of: MeshScene) -> Result<u64, WriteMeshesError> {
        let output = OutputFile::new(path)?;
        let failed = |source| WriteMeshesError::File { path: path.to_path_buf(), source };
        let lock = OpenOptions::new().create(true).truncate(false).write(true).open(lock_path(path));
        let lock = lock.map_err(|error| failed(MeshFileError::Read(error)))?;
        lock.lock().map_err(|error| failed(MeshFileError::Read(error)))?;
        let bytes = if path.exists() {
            let file = MeshFile::open(path).map_err(failed)?;
            // What is known of light from surfaces stays: others have rendered with it.
            let (mut merged, restored) = Self::of_file(&file, of).map_err(failed)?;
            if restored.without_indirect || merged.indirect_fingerprint().is_none() {
                merged.take_indirect_like(self, of.scene, of.settings)?;
            }
            merged.absorb(self, of.lights)?;
            merged.to_file(of, Some(&file)).map_err(failed)?
        } else {
            self.to_file(of, None).map_err(failed)?
        };
        output.write_durably(&bytes)?;
        // Closing the file ends the lock, also if the program is killed.
        drop(lock);
        Ok(bytes.len() as u64)
    }
}

/// The points of direct light of a file, with their light when the file was written; needs no scene.
///
/// # Errors
/// See [`MeshFileError`].
pub fn read_known_points(path: &Path) -> Result<KnownPoints, MeshFileError> {
    let file = MeshFile::open(path)?;
    let (bounds, lights) = (file.value::<Identity>(IDENTITY)?.bounds, file.value::<PackedLights>(LIGHTS)?);
    Ok(DirectMesh::restore(bounds, &lights, &file)?.known(&lights))
}

/// What a file of light meshes holds.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LightMeshSummary {
    /// Fingerprint of the scene that it belongs to.
    pub scene: String,
    /// Lights that bits are of; a lamp with a size is several.
    pub lights: usize,
    /// Known points of direct light.
    pub points: usize,
    /// Layers that these belong to.
    pub spacings: usize,
    /// Views whose settings are known.
    pub views: usize,
    /// Whether there is light from surfaces.
    pub light_from_surfaces: bool,
    /// Names and lengths of the sections, bytes.
    pub sections: Vec<(String, usize)>,
}

/// Reads what a file of light meshes holds; needs no scene.
///
/// # Errors
/// See [`MeshFileError`].
pub fn light_mesh_summary(path: &Path) -> Result<LightMeshSummary, MeshFileError> {
    let file = MeshFile::open(path)?;
    let (identity, lights) = (file.value::<Identity>(IDENTITY)?, file.value::<PackedLights>(LIGHTS)?);
    let direct = DirectMesh::restore(identity.bounds, &lights, &file)?;
    Ok(LightMeshSummary {
        scene: identity.scene.to_string(),
        lights: lights.len(),
        points: direct.store().positions().len(),
        spacings: direct.store().points.layers().count(),
        views: file.value::<Vec<KnownView>>(VIEWS)?.len(),
        light_from_surfaces: identity.indirect.is_some(),
        sections: file.sections().map(|(name, length)| (name.to_owned(), length)).collect(),
    })
}

/// A file beside a file of light meshes, which whoever changes that one holds: the other is replaced, and can't be held itself.
fn lock_path(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!(".{name}.lock"))
}
