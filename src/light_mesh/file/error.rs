//! Why a file of light meshes can't be used.

use std::fmt;
use std::io;

/// Why a file of light meshes can't be used.
#[derive(Debug, thiserror::Error)]
pub enum MeshFileError {
    /// It can't be read.
    #[error("cannot be read")]
    Read(#[source] io::Error),
    /// It is something else.
    #[error("is no file of light meshes, nor of tiles")]
    Foreign,
    /// Another version of the format.
    #[error("has version {found} of the format, which this program does not know")]
    Version {
        /// The version.
        found: u32,
    },
    /// It is not as it was written.
    #[error("is damaged: {0}")]
    Damaged(String),
    /// It belongs to another scene.
    #[error("belongs to another scene: {0} differ")]
    OtherScene(Differences),
    /// Light from surfaces was found by other settings.
    #[error(
        "its light from surfaces was found by other settings than these (`indirect`): bake it again, or leave it out (`--indirect off`)"
    )]
    OtherSettings,
}

impl MeshFileError {
    /// Something in a section is wrong.
    pub(crate) fn damaged(section: &str, what: impl fmt::Display) -> Self {
        Self::Damaged(format!("section `{section}`: {what}"))
    }

    /// Whether the file is whole, but not of this scene and its settings.
    pub fn is_mismatch(&self) -> bool {
        matches!(self, Self::OtherScene(_) | Self::OtherSettings)
    }
}

/// In what two scenes differ, of what values of mesh points follow from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Differences {
    /// Triangles, their placement, and where they are cut out.
    pub geometry: bool,
    /// Places and kinds of lights.
    pub lights: bool,
}

impl fmt::Display for Differences {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match (self.geometry, self.lights) {
            (true, true) => "triangles, and places or kinds of lights",
            (true, false) => "triangles or cut-outs",
            _ => "places or kinds of lights",
        })
    }
}
