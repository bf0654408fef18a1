//! How a command ends, and how the program reports why it failed.

use std::error::Error;
use std::io;
use std::path::PathBuf;
use std::process::ExitCode;

use crate::accel::{BackendError, MemoryLimitError};
use crate::bench::BenchError;
use crate::crosscheck::RayTextError;
use crate::export::GridError;
use crate::image::ImageError;
use crate::image::exr::MergeError;
use crate::image::metrics::MetricsError;
use crate::light_mesh::file::MeshFileError;
use crate::render::{RenderError, SessionError, WriteMeshesError};
use crate::scene::generate::GenerateError;
use crate::scene::load::LoadError;
use crate::suggestion::hint;

/// How a command ended that did its work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// There is nothing to object to.
    Passed,
    /// What was checked is not as it should be.
    Failed,
}

impl Outcome {
    /// The outcome of a check.
    pub(super) fn of(passed: bool) -> Self {
        if passed { Self::Passed } else { Self::Failed }
    }
}

impl From<Outcome> for ExitCode {
    fn from(outcome: Outcome) -> Self {
        match outcome {
            Outcome::Passed => Self::SUCCESS,
            Outcome::Failed => Self::FAILURE,
        }
    }
}

/// Why a command could not do its work. A message names what was worked on; the cause is the
/// [source](Error::source), and [`describe`] puts both together.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CommandError {
    /// A scene can't be read.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// A scene is larger than allowed.
    #[error("{}", scene.display())]
    MemoryLimit {
        /// The scene file.
        scene: PathBuf,
        /// The estimate.
        source: MemoryLimitError,
    },
    /// The backend is missing or failed.
    #[error(transparent)]
    Backend(#[from] BackendError),
    /// The scene contradicts itself.
    #[error("{}", scene.display())]
    Session {
        /// The scene file.
        scene: PathBuf,
        /// Why.
        source: SessionError,
    },
    /// There is no image.
    #[error("{}", scene.display())]
    Render {
        /// The scene file.
        scene: PathBuf,
        /// Why.
        source: RenderError,
    },
    /// A scene has no camera of that name.
    #[error("{}: no camera is named `{name}`{}; {}", scene.display(), hint(name, names.split(", ")), there_are(names))]
    NoSuchCamera {
        /// The scene file.
        scene: PathBuf,
        /// The name.
        name: String,
        /// Those that exist.
        names: String,
    },
    /// A signal ended the work; `kept` says what is not lost.
    #[error("interrupted: {kept}")]
    Interrupted {
        /// The exit code that belongs to the signal.
        exit_code: u8,
        /// What was kept, and how to go on.
        kept: String,
    },
    /// Signals can't be caught.
    #[error("cannot catch signals")]
    Signals(#[source] io::Error),
    /// A part of an image that there is not.
    #[error("the image has {width}×{height} pixels: {problem}")]
    Region {
        /// Its columns.
        width: u32,
        /// Its rows.
        height: u32,
        /// What is wrong.
        problem: String,
    },
    /// Parts of an image don't make it.
    #[error("{}", file.display())]
    Merge {
        /// The part that doesn't belong to it, or the image.
        file: PathBuf,
        /// Why.
        source: MergeError,
    },
    /// A light mesh can't be used.
    #[error("{}", file.display())]
    LightMesh {
        /// Its file.
        file: PathBuf,
        /// Why.
        source: MeshFileError,
    },
    /// A light mesh can't be written.
    #[error(transparent)]
    WriteLightMesh(#[from] WriteMeshesError),
    /// Several frames would be written to one file.
    #[error("{}: several frames need a place for their number in its name, such as frame.####.exr", .0.display())]
    FrameName(PathBuf),
    /// Pictures of several cameras would be written to one file.
    #[error("{}: several cameras need a place for their name in its name, such as {{camera}}.exr", .0.display())]
    CameraFileName(PathBuf),
    /// A camera was named twice.
    #[error("camera `{0}` is named twice")]
    CameraTwice(String),
    /// Files of two cameras have one name.
    #[error("{}: files of the cameras `{first}` and `{second}` would both be called `{file_name}`", scene.display())]
    SameFileName {
        /// The scene file.
        scene: PathBuf,
        /// Name of a camera.
        first: String,
        /// Name of another one.
        second: String,
        /// Both in names of files.
        file_name: String,
    },
    /// All frames were asked for where there are none.
    #[error("{}: nothing moves, so that `all` names no frames", scene.display())]
    NoFrames {
        /// The scene file.
        scene: PathBuf,
    },
    /// An animation is longer than any that one would render at once.
    #[error("{}: {count} frames are too many for `all`", scene.display())]
    TooManyFrames {
        /// The scene file.
        scene: PathBuf,
        /// Number of its frames.
        count: i64,
    },
    /// Layers are asked for, and no output can hold them.
    #[error("{}: layers need an output that ends in .exr", file.display())]
    Layers {
        /// The first output.
        file: PathBuf,
    },
    /// Mesh points make no regular grid.
    #[error("{}", file.display())]
    Grid {
        /// What they are of.
        file: PathBuf,
        /// Why not.
        source: GridError,
    },
    /// Threads can't be started.
    #[error("cannot start the threads")]
    Threads(#[from] rayon::ThreadPoolBuildError),
    /// An image can't be read, or a file can't be written.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// Two images can't be compared.
    #[error("{} and {}", image.display(), reference.display())]
    Incomparable {
        /// The image.
        image: PathBuf,
        /// The reference.
        reference: PathBuf,
        /// Why not.
        source: MetricsError,
    },
    /// The error image's name has another extension than .png.
    #[error("{}: an error image is a .png", .0.display())]
    ErrorImageFormat(PathBuf),
    /// A file that is no image or scene can't be read.
    #[error("cannot read {}", file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// The operating system's reason.
        source: io::Error,
    },
    /// A folder can't be created.
    #[error("{}: cannot be created", folder.display())]
    Folder {
        /// The folder.
        folder: PathBuf,
        /// The operating system's reason.
        source: io::Error,
    },
    /// A ray to replay is none.
    #[error("{place}")]
    Ray {
        /// Where it stands.
        place: String,
        /// What is wrong.
        source: RayTextError,
    },
    /// A gallery's list, or the statistics of one of its images, is malformed.
    #[error("{}: {problem}", file.display())]
    Malformed {
        /// The file.
        file: PathBuf,
        /// What is wrong, and where.
        problem: String,
    },
    /// A gallery's list has no image of that name.
    #[error("{}: no picture is named `{name}`{}; there are: {names}", file.display(), hint(name, names.split(", ")))]
    NoSuchImage {
        /// The list.
        file: PathBuf,
        /// The name.
        name: String,
        /// Those that exist.
        names: String,
    },
    /// A scene can't be generated.
    #[error(transparent)]
    Generate(#[from] GenerateError),
    /// A benchmark can't be run.
    #[error(transparent)]
    Bench(#[from] BenchError),
    /// Scenes can't be measured; each text names one and says why.
    #[error("{} not measured: {}", .0.len(), .0.join("; "))]
    NotMeasured(Vec<String>),
    /// Only a model can be turned into a scene file.
    #[error("{}: is not a model (known: .glb, .gltf, .obj, .ply)", .0.display())]
    NotAModel(PathBuf),
    /// TOML can't hold the name of a file.
    #[error("{}: the name is not UTF-8", .0.display())]
    Name(PathBuf),
    /// The result can't be printed.
    #[error("cannot print the result")]
    Print(#[from] io::Error),
}

impl CommandError {
    /// The exit code of the program: that of the signal that ended it, or 3 if a light mesh belongs to another scene or other settings, which a script may answer by baking it again.
    pub(super) fn exit_code(&self) -> ExitCode {
        let mismatch = match self {
            Self::Interrupted { exit_code, .. } => return ExitCode::from(*exit_code),
            Self::LightMesh { source, .. } => source.is_mismatch(),
            Self::WriteLightMesh(WriteMeshesError::File { source, .. }) => source.is_mismatch(),
            _ => false,
        };
        ExitCode::from(if mismatch { 3 } else { 1 })
    }
}

/// An error and its causes in one line: `a: b: c`.
///
/// Errors of the library name their cause in their own text, where it is not repeated. The system's numbers of errors,
/// which mean nothing to a user, are left out.
pub fn describe(error: &dyn Error) -> String {
    let mut text = without_number(error);
    let mut cause = error.source();
    while let Some(error) = cause {
        let part = without_number(error);
        if !text.to_lowercase().ends_with(&part.to_lowercase()) {
            text = format!("{text}: {part}");
        }
        cause = error.source();
    }
    text
}

/// An error's text without "(os error N)".
fn without_number(error: &dyn Error) -> String {
    let text = error.to_string();
    match text.split_once(" (os error ").map(|(before, rest)| (before, rest.split_once(')'))) {
        Some((before, Some((_, after)))) => format!("{before}{after}"),
        _ => text,
    }
}

/// The cameras of a scene by name.
fn there_are(names: &str) -> String {
    if names.is_empty() { "its cameras have no names".into() } else { format!("there are: {names}") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::DecodeError;

    fn missing() -> io::Error {
        // ENOENT.
        io::Error::from_raw_os_error(2)
    }

    /// A cause is said once, whether the error's own text names it or not.
    #[test]
    fn causes_are_named_once() {
        let file = PathBuf::from("a.toml");
        let context_only = CommandError::Read { file: file.clone(), source: missing() };
        let reason = describe(&missing());
        assert!(!reason.contains("os error"), "{reason}");
        assert_eq!(describe(&context_only), format!("cannot read a.toml: {reason}"));

        let whole = LoadError::Read { file: file.clone(), source: missing() };
        let expected = format!("a.toml: cannot be read: {}", reason.to_lowercase());
        assert_eq!(describe(&CommandError::from(whole)), expected);

        let nested = ImageError::Contents { path: file, source: DecodeError::UnknownFormat };
        let expected = format!("a.toml: {}", DecodeError::UnknownFormat);
        assert_eq!(describe(&CommandError::from(nested)), expected);
    }
}
