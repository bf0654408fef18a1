//! `lightmesh info` of a file of light meshes: what it belongs to, and what it knows.

use std::io::{self, Write};
use std::path::Path;

use serde::Serialize;

use super::error::CommandError;
use crate::render::{LightMeshSummary, light_mesh_summary};

/// What a file of light meshes holds.
#[derive(Serialize)]
pub struct MeshInfo(LightMeshSummary);

impl MeshInfo {
    /// Whether a file is one of those that this is for, by its name.
    pub fn is_for(path: &Path) -> bool {
        path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("lmesh"))
    }

    /// Reads a file.
    pub fn read(path: &Path) -> Result<Self, CommandError> {
        let summary = light_mesh_summary(path);
        summary.map(Self).map_err(|source| CommandError::LightMesh { file: path.to_owned(), source })
    }

    /// Prints it for people.
    pub fn print(&self, out: &mut dyn Write) -> io::Result<()> {
        let LightMeshSummary { scene, lights, points, spacings, views, light_from_surfaces, sections } =
            &self.0;
        writeln!(out, "scene      {scene}")?;
        writeln!(out, "lights     {lights}")?;
        writeln!(out, "points     {points} of direct light, of {spacings} spacings or layouts")?;
        writeln!(out, "surfaces   {}", if *light_from_surfaces { "with light from them" } else { "none" })?;
        writeln!(out, "views      {views}")?;
        for (name, bytes) in sections {
            writeln!(out, "section    {name}: {bytes} bytes")?;
        }
        Ok(())
    }
}
