//! Light meshes that are kept in files between renders.

use std::path::PathBuf;

use clap::Args;

use super::error::CommandError;
use super::progress::Reporter;
use crate::image::OutputFile;
use crate::light_mesh::file::MeshFileError;
use crate::render::Session;
use crate::settings::Settings;

/// The light mesh to begin with.
#[derive(Args, Clone, Debug, Default)]
pub struct LightMeshArgs {
    /// Light mesh that `lightmesh bake` wrote: only points that it lacks are evaluated
    #[arg(long, value_name = "FILE")]
    light_mesh: Option<PathBuf>,
    /// Add the points that were evaluated to that file, which is made if there is none
    #[arg(long, requires = "light_mesh")]
    update: bool,
}

impl LightMeshArgs {
    /// Checks that the file can be written, if that will be asked for.
    ///
    /// # Errors
    /// [`CommandError::Image`].
    pub fn check(&self) -> Result<(), CommandError> {
        if let Some(path) = self.light_mesh.as_deref().filter(|_| self.update) {
            OutputFile::new(path)?;
        }
        Ok(())
    }

    /// Gives the light mesh of the file to a session.
    ///
    /// # Errors
    /// [`CommandError::LightMesh`].
    pub fn read(
        &self,
        session: &mut Session,
        settings: &Settings,
        reporter: &Reporter,
    ) -> Result<(), CommandError> {
        let Some(path) = &self.light_mesh else { return Ok(()) };
        let restored = match session.read_light_meshes(path, settings) {
            Err(MeshFileError::Read(error))
                if self.update && error.kind() == std::io::ErrorKind::NotFound =>
            {
                return Ok(());
            }
            restored => restored.map_err(|source| CommandError::LightMesh { file: path.clone(), source })?,
        };
        if restored.without_indirect {
            reporter.line(&format!(
                "note: {}: light from surfaces is found anew, since lights or surfaces have another brightness than in the file",
                path.display()
            ));
        }
        Ok(())
    }

    /// Whether the file is to be added to.
    pub fn updates(&self) -> bool {
        self.update && self.light_mesh.is_some()
    }

    /// Adds what a session knows to the file, if that was asked for.
    ///
    /// # Errors
    /// [`CommandError::WriteLightMesh`].
    pub fn update(&self, session: &Session, settings: &Settings) -> Result<(), CommandError> {
        let Some(path) = self.light_mesh.as_deref().filter(|_| self.update) else { return Ok(()) };
        session.update_light_meshes(path, settings)?;
        Ok(())
    }
}
