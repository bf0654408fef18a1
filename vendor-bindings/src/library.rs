//! Finding and loading Embree.

use std::{ffi::OsStr, mem::ManuallyDrop, ptr, sync::Arc};

use crate::bindings::{
    RTCDevice,
    embree3::Embree3,
    embree4::{self as v4, Embree4},
};
use crate::error::{Code, Error, Version};

/// Names under which the dynamic loader may know Embree, the preferred one first. Names with a
/// version come first: those without belong to development packages.
#[cfg(not(target_os = "macos"))]
const NAMES: [&str; 4] = ["libembree4.so.4", "libembree4.so", "libembree3.so.3", "libembree3.so"];
#[cfg(target_os = "macos")]
const NAMES: [&str; 4] = ["libembree4.4.dylib", "libembree4.dylib", "libembree3.3.dylib", "libembree3.dylib"];

/// Environment variable that names the library explicitly.
const VARIABLE: &str = "EMBREE_LIB";

/// The functions of the loaded version. Never dropped: unloading the library under Embree's worker
/// threads crashes.
pub(crate) enum Api {
    V3(ManuallyDrop<Embree3>),
    V4(ManuallyDrop<Embree4>),
}

/// Calls a function whose signature is the same in both versions.
macro_rules! call {
    ($api:expr, $function:ident($($argument:expr),* $(,)?)) => {
        match $api {
            $crate::library::Api::V3(embree) => (embree.$function)($($argument),*),
            $crate::library::Api::V4(embree) => (embree.$function)($($argument),*),
        }
    };
}
pub(crate) use call;

/// Embree, loaded. Cheap to clone.
#[derive(Clone)]
pub struct Library(Arc<Loaded>);

struct Loaded {
    api: Api,
    name: String,
    version: Version,
}

impl Library {
    /// Loads the library that the environment variable `EMBREE_LIB` names (a path or a name that the
    /// dynamic loader knows), or else version 4, or else version 3.
    ///
    /// # Errors
    ///
    /// [`Error::NotFound`] where nothing is installed, and those of [`Library::open`].
    pub fn load() -> Result<Self, Error> {
        if let Some(name) = std::env::var_os(VARIABLE).filter(|name| !name.is_empty()) {
            return Self::open(&name);
        }
        let mut tried = Vec::new();
        for name in NAMES {
            match Self::open(OsStr::new(name)) {
                Ok(library) => return Ok(library),
                Err(Error::CannotLoad { reason, .. }) => tried.push(reason),
                // A library that is there but unusable must not hide another that is.
                Err(error) => tried.push(error.to_string()),
            }
        }
        Err(Error::NotFound { tried })
    }

    /// Loads one library of every version that is installed, the preferred one first; where `EMBREE_LIB` names one,
    /// that alone.
    ///
    /// # Errors
    ///
    /// As for [`Library::load`], where there is none.
    pub fn load_all() -> Result<Vec<Self>, Error> {
        let first = Self::load()?;
        let mut libraries = vec![first];
        if std::env::var_os(VARIABLE).is_none_or(|name| name.is_empty()) {
            for library in NAMES.iter().filter_map(|name| Self::open(OsStr::new(name)).ok()) {
                if libraries.iter().all(|other| other.version().major != library.version().major) {
                    libraries.push(library);
                }
            }
        }
        Ok(libraries)
    }

    /// Loads the named library, a path or a name that the dynamic loader knows.
    ///
    /// # Errors
    ///
    /// [`Error::CannotLoad`], [`Error::NotEmbree`], [`Error::UnsupportedVersion`], or what Embree reports
    /// where it cannot run on this processor.
    pub fn open(name: &OsStr) -> Result<Self, Error> {
        let display = name.to_string_lossy().into_owned();
        let open = || {
            // SAFETY: Embree's initialisers have no preconditions; that the name stands for Embree is
            // the installation's promise, or the user's where EMBREE_LIB is set.
            unsafe { libloading::Library::new(name) }
                .map_err(|error| Error::CannotLoad { name: display.clone(), reason: text(&error) })
        };
        let not_embree =
            |error: libloading::Error| Error::NotEmbree { name: display.clone(), reason: text(&error) };

        // This handle is never closed, so that dropping another one of the same library, on the error
        // paths below, cannot unload it.
        let first = ManuallyDrop::new(open()?);
        let version = version_of(&first, not_embree)?;
        let api = match version {
            // SAFETY: a library of this version has these functions with these signatures.
            Version { major: 3, minor: 13.., .. } => {
                Api::V3(ManuallyDrop::new(unsafe { Embree3::from_library(open()?) }.map_err(not_embree)?))
            }
            // SAFETY: as above.
            Version { major: 4, .. } => {
                Api::V4(ManuallyDrop::new(unsafe { Embree4::from_library(open()?) }.map_err(not_embree)?))
            }
            version => return Err(Error::UnsupportedVersion { name: display, version }),
        };
        Ok(Self(Arc::new(Loaded { api, name: display, version })))
    }

    /// The library's version.
    pub fn version(&self) -> Version {
        self.0.version
    }

    /// The name or path that it was loaded by.
    pub fn name(&self) -> &str {
        &self.0.name
    }

    #[inline(always)]
    pub(crate) fn api(&self) -> &Api {
        &self.0.api
    }
}

impl std::fmt::Debug for Library {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Embree {} ({})", self.version(), self.name())
    }
}

/// Queries the library's version, which takes a device. The functions used have had these
/// signatures since version 3.0; in version 2 one of them is missing.
fn version_of(
    library: &libloading::Library,
    not_embree: impl Fn(libloading::Error) -> Error,
) -> Result<Version, Error> {
    type NewDevice = unsafe extern "C" fn(*const std::ffi::c_char) -> RTCDevice;
    type ReleaseDevice = unsafe extern "C" fn(RTCDevice);
    type GetDeviceProperty = unsafe extern "C" fn(RTCDevice, v4::RTCDeviceProperty) -> isize;
    type GetDeviceError = unsafe extern "C" fn(RTCDevice) -> v4::RTCError;
    // SAFETY: the types are those of Embree's headers; the symbols don't outlive the library.
    let (new, release, property, error) = unsafe {
        (
            library.get::<NewDevice>(b"rtcNewDevice\0").map_err(&not_embree)?,
            library.get::<ReleaseDevice>(b"rtcReleaseDevice\0").map_err(&not_embree)?,
            library.get::<GetDeviceProperty>(b"rtcGetDeviceProperty\0").map_err(&not_embree)?,
            library.get::<GetDeviceError>(b"rtcGetDeviceError\0").map_err(&not_embree)?,
        )
    };
    // SAFETY: a null configuration stands for the defaults.
    let device = unsafe { new(ptr::null()) };
    if device.is_null() {
        // SAFETY: a null device stands for the error of the failed creation.
        return Err(creation_error(unsafe { error(ptr::null_mut()) }));
    }
    // A property that is no u32 is no version either, and refused as such.
    let get = |name| u32::try_from(unsafe { property(device, name) }).unwrap_or(0); // SAFETY: device is valid.
    let version = Version {
        major: get(v4::RTC_DEVICE_PROPERTY_VERSION_MAJOR),
        minor: get(v4::RTC_DEVICE_PROPERTY_VERSION_MINOR),
        patch: get(v4::RTC_DEVICE_PROPERTY_VERSION_PATCH),
    };
    // SAFETY: the device is valid and released once.
    unsafe { release(device) };
    Ok(version)
}

/// The error of a device creation that returned nothing.
pub(crate) fn creation_error(code: v4::RTCError) -> Error {
    let code = Code::from_raw(code);
    Error::Embree { action: "create a device", code, text: "no device was created".into() }
}

impl Code {
    pub(crate) fn from_raw(code: v4::RTCError) -> Self {
        match code {
            v4::RTC_ERROR_INVALID_ARGUMENT => Self::InvalidArgument,
            v4::RTC_ERROR_INVALID_OPERATION => Self::InvalidOperation,
            v4::RTC_ERROR_OUT_OF_MEMORY => Self::OutOfMemory,
            v4::RTC_ERROR_UNSUPPORTED_CPU => Self::UnsupportedCpu,
            v4::RTC_ERROR_CANCELLED => Self::Cancelled,
            _ => Self::Unknown,
        }
    }
}

/// An error with its cause: libloading keeps the loader's own message in the source.
fn text(error: &libloading::Error) -> String {
    std::error::Error::source(error).map_or_else(|| error.to_string(), ToString::to_string)
}
