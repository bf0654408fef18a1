//! What can go wrong between here and Embree.

use thiserror::Error;

/// Errors of loading Embree and of setting up devices, geometries and scenes. Queries cannot fail.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum Error {
    /// None of the known library names could be loaded.
    #[error("Embree was not found: {}", tried.join("; "))]
    NotFound {
        /// The loader's message for each name, in the order tried.
        tried: Vec<String>,
    },
    /// The library that was named explicitly could not be loaded.
    #[error("cannot load the Embree library {name}: {reason}")]
    CannotLoad {
        /// The name as given.
        name: String,
        /// The loader's message.
        reason: String,
    },
    /// The library lacks a function that Embree has.
    #[error("{name} is not a usable Embree library: {reason}")]
    NotEmbree {
        /// The library's name.
        name: String,
        /// The loader's message.
        reason: String,
    },
    /// The library is of a version whose structs these bindings do not fit.
    #[error("{name} is Embree {version}; supported are 3.13 and later 3.x, and 4.x")]
    UnsupportedVersion {
        /// The library's name.
        name: String,
        /// Its version.
        version: Version,
    },
    /// The library was built without something that is needed, or with something that is in the way.
    #[error("this build of Embree {version} cannot be used: {reason}")]
    UnsuitableBuild {
        /// The library's version.
        version: Version,
        /// What is missing.
        reason: &'static str,
    },
    /// Embree reported an error.
    #[error("Embree failed to {action}: {text} ({code})")]
    Embree {
        /// What was being done.
        action: &'static str,
        /// Kind of error.
        code: Code,
        /// Embree's own text; that of `code` where Embree gave none.
        text: String,
    },
    /// A device configuration with a zero byte.
    #[error("the Embree device configuration contains a zero byte")]
    Configuration,
    /// The vertex buffer does not end in a vertex of padding.
    #[error(
        "a vertex buffer needs one vertex of padding at its end, and at most 2^32 − 2 vertices before it"
    )]
    VertexBuffer,
    /// A triangle names a vertex that does not exist.
    #[error("triangle {triangle} names vertex {index}, but there are {vertices}")]
    IndexOutOfRange {
        /// The triangle.
        triangle: usize,
        /// The index that it names.
        index: u32,
        /// How many vertices there are, the padding not counted.
        vertices: usize,
    },
    /// More triangles than Embree's 32-bit ids can name.
    #[error("{triangles} triangles in one geometry, but at most 2^32 − 2 are possible")]
    TooManyTriangles {
        /// How many there were.
        triangles: usize,
    },
    /// Geometry id that cannot be used: 2³² − 1, or one that is taken.
    #[error("geometry id {id} is reserved or in use")]
    GeometryId {
        /// The id.
        id: u32,
    },
    /// Objects of two devices were combined.
    #[error("geometry and scene belong to different Embree devices")]
    ForeignDevice,
    /// A placement that cannot be undone, so that no ray could be brought into the instance's space.
    #[error("the instance's transform has no inverse, or scales by too much")]
    Transform,
    /// An instance of a scene that holds instances; Debian's Embree has one level.
    #[error("a scene that contains instances cannot be instanced")]
    NestedInstance,
}

/// Embree's error codes (`RTCError`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Code {
    /// `RTC_ERROR_UNKNOWN`, and codes that are not in the headers.
    Unknown,
    /// `RTC_ERROR_INVALID_ARGUMENT`.
    InvalidArgument,
    /// `RTC_ERROR_INVALID_OPERATION`.
    InvalidOperation,
    /// `RTC_ERROR_OUT_OF_MEMORY`.
    OutOfMemory,
    /// `RTC_ERROR_UNSUPPORTED_CPU`.
    UnsupportedCpu,
    /// `RTC_ERROR_CANCELLED`.
    Cancelled,
}

impl std::fmt::Display for Code {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Unknown => "unknown error",
            Self::InvalidArgument => "invalid argument",
            Self::InvalidOperation => "invalid operation",
            Self::OutOfMemory => "out of memory",
            Self::UnsupportedCpu => "unsupported processor",
            Self::Cancelled => "cancelled",
        })
    }
}

/// Version of the loaded library.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Version {
    /// 3 or 4.
    pub major: u32,
    /// Minor version.
    pub minor: u32,
    /// Patch level.
    pub patch: u32,
}

impl std::fmt::Display for Version {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}.{}.{}", self.major, self.minor, self.patch)
    }
}
