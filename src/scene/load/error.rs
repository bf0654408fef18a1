//! What can go wrong while a scene is read, and what is merely worth a warning.

use std::fmt;
use std::io;
use std::path::PathBuf;

/// Why a scene could not be read. Every message is one line that names the file.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// A file cannot be opened or read.
    #[error("{}: cannot be read: {}", file.display(), reason(source))]
    Read {
        /// The file.
        file: PathBuf,
        /// The operating system's reason.
        source: io::Error,
    },
    /// A scene file refers to a file that cannot be read.
    #[error("{}:{line}: {key}: cannot read {}: {}", file.display(), target.display(), reason(source))]
    Reference {
        /// The scene file.
        file: PathBuf,
        /// Line of the reference, from 1.
        line: usize,
        /// Key of the reference.
        key: String,
        /// The file that is missing or unreadable.
        target: PathBuf,
        /// The operating system's reason.
        source: io::Error,
    },
    /// A key of a scene file is unknown, missing, or has a value that it cannot have.
    #[error("{}:{line}: {key}: {problem}", file.display())]
    Key {
        /// The scene file.
        file: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Path of the key, for instance `camera.vertical_fov` or `light[2].position`.
        key: String,
        /// What is wrong.
        problem: String,
    },
    /// A line of a file breaks the format's rules.
    #[error("{}:{line}: {problem}", file.display())]
    Line {
        /// The file.
        file: PathBuf,
        /// Line, from 1.
        line: usize,
        /// What is wrong.
        problem: String,
    },
    /// A part of a file that has no lines breaks the format's rules, or needs what is not supported.
    #[error("{}: {}{problem}", file.display(), place_clause(place))]
    Invalid {
        /// The file.
        file: PathBuf,
        /// Where in it, in the format's terms, for instance `meshes[3].primitives[0]`; empty for the whole.
        place: String,
        /// What is wrong.
        problem: String,
    },
    /// A model has nothing to render.
    #[error("{}: holds no triangles{}", file.display(), skipped_clause(skipped))]
    Empty {
        /// The file.
        file: PathBuf,
        /// What was left out.
        skipped: Skipped,
    },
    /// A model needs more vertices, corners or triangles than 32-bit indices reach.
    #[error("{}: more than {limit} {what}", file.display())]
    TooLarge {
        /// The file.
        file: PathBuf,
        /// What there is too much of.
        what: &'static str,
        /// The limit.
        limit: u64,
    },
    /// The extension belongs to no known format.
    #[error("{}: not a known model format (known: .glb, .gltf, .obj, .ply)", file.display())]
    UnknownFormat {
        /// The file.
        file: PathBuf,
    },
}

/// The system's message without "(os error N)", which means nothing to a user.
fn reason(error: &io::Error) -> String {
    let text = error.to_string();
    match text.find(" (os error") {
        Some(end) => text[..end].to_lowercase(),
        None => text,
    }
}

fn place_clause(place: &str) -> String {
    if place.is_empty() { String::new() } else { format!("{place}: ") }
}

fn skipped_clause(skipped: &Skipped) -> String {
    if skipped.is_empty() { String::new() } else { format!(" (skipped: {skipped})") }
}

/// Elements of a model file that do not become part of the scene, by kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Skipped {
    /// Line elements.
    pub lines: u64,
    /// Point elements.
    pub points: u64,
    /// Free-form curves and surfaces.
    pub free_form: u64,
    /// Faces with fewer than three corners.
    pub short_faces: u64,
    /// Triangles of zero area.
    pub zero_area_triangles: u64,
    /// Instances that are squeezed flat.
    pub flat_instances: u64,
    /// Normals without a direction, replaced by the face's own.
    pub bad_normals: u64,
    /// Texture coordinates that are not finite, replaced by 0.
    pub bad_uvs: u64,
}

impl Skipped {
    /// Whether nothing was left out.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// The counts with the names that messages use.
    pub fn named(&self) -> [(&'static str, u64); 8] {
        [
            ("line elements", self.lines),
            ("point elements", self.points),
            ("curves and surfaces", self.free_form),
            ("faces with fewer than three corners", self.short_faces),
            ("triangles of zero area", self.zero_area_triangles),
            ("instances without volume", self.flat_instances),
            ("normals without a direction", self.bad_normals),
            ("texture coordinates that are not finite", self.bad_uvs),
        ]
    }

    /// Adds another file's counts.
    pub fn add(&mut self, other: &Self) {
        self.lines += other.lines;
        self.points += other.points;
        self.free_form += other.free_form;
        self.short_faces += other.short_faces;
        self.zero_area_triangles += other.zero_area_triangles;
        self.flat_instances += other.flat_instances;
        self.bad_normals += other.bad_normals;
        self.bad_uvs += other.bad_uvs;
    }
}

impl fmt::Display for Skipped {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let counts = self.named().into_iter().filter(|(_, count)| *count > 0);
        for (i, (name, count)) in counts.enumerate() {
            write!(f, "{}{count} {name}", if i > 0 { ", " } else { "" })?;
        }
        Ok(())
    }
}

/// Something that does not stop the rendering but that the user should know.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// The file.
    pub file: PathBuf,
    /// Line, from 1, where there is one.
    pub line: Option<usize>,
    /// What was found, and what was done about it.
    pub message: String,
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:", self.file.display())?;
        if let Some(line) = self.line {
            write!(f, "{line}:")?;
        }
        write!(f, " {}", self.message)
    }
}
