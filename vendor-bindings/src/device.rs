//! Devices: Embree's root object, its errors and its memory.

use std::{
    ffi::{CStr, CString, c_char, c_void},
    panic::{AssertUnwindSafe, catch_unwind},
    ptr,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicIsize, AtomicUsize, Ordering},
    },
    thread::{self, ThreadId},
};

use crate::bindings::{RTCDevice, embree4 as v4};
use crate::error::{Code, Error};
use crate::library::{Api, Library, call, creation_error};

/// An Embree device. Cheap to clone; freed with the last object made from it.
#[derive(Clone)]
pub struct Device(Arc<Inner>);

struct Inner {
    handle: RTCDevice,
    library: Library,
    // Boxed, since Embree's callbacks hold its address. Dropped after `Inner::drop` released the device.
    state: Box<State>,
}

/// What Embree's callbacks write to.
#[derive(Default)]
struct State {
    /// Texts of errors that were raised and not yet fetched, by the thread that raised them.
    errors: Mutex<Vec<(ThreadId, String)>>,
    /// Bytes that Embree holds.
    memory: AtomicIsize,
    /// How many calls of opacity filters ended in a panic.
    filter_panics: Arc<AtomicUsize>,
}

// SAFETY: Embree's device functions may be called from any thread; the state is synchronised.
unsafe impl Send for Inner {}
// SAFETY: as above.
unsafe impl Sync for Inner {}

impl Device {
    /// Opens a device. The configuration is Embree's (`threads=2`, `isa=avx2`, …), usually empty.
    ///
    /// # Errors
    ///
    /// [`Error::Embree`] for a configuration that Embree refuses, and [`Error::UnsuitableBuild`] for a
    /// library that was built without triangles, ray masks or filter functions, or with back-face
    /// culling.
    pub fn new(library: &Library, configuration: &str) -> Result<Self, Error> {
        let configuration = CString::new(configuration).map_err(|_| Error::Configuration)?;
        let api = library.api();
        // SAFETY: the string ends in a zero byte and is copied.
        let handle = unsafe { call!(api, rtcNewDevice(configuration.as_ptr())) };
        if handle.is_null() {
            // SAFETY: a null device stands for the error of the failed creation.
            return Err(creation_error(unsafe { call!(api, rtcGetDeviceError(ptr::null_mut())) }));
        }
        let device = Self(Arc::new(Inner { handle, library: library.clone(), state: Box::default() }));
        let user = ptr::from_ref(&*device.0.state).cast_mut().cast::<c_void>();
        // SAFETY: the callbacks match their types; the state outlives the device (see Inner).
        unsafe {
            call!(api, rtcSetDeviceErrorFunction(handle, Some(on_error), user));
            call!(api, rtcSetDeviceMemoryMonitorFunction(handle, Some(on_memory), user));
        }
        device.check("set the device's callbacks")?;
        device.require(v4::RTC_DEVICE_PROPERTY_TRIANGLE_GEOMETRY_SUPPORTED, true, "it has no triangles")?;
        device.require(v4::RTC_DEVICE_PROPERTY_RAY_MASK_SUPPORTED, true, "it has no ray masks")?;
        device.require(
            v4::RTC_DEVICE_PROPERTY_FILTER_FUNCTION_SUPPORTED,
            true,
            "it has no filter functions",
        )?;
        device.require(v4::RTC_DEVICE_PROPERTY_BACKFACE_CULLING_ENABLED, false, "it culls back faces")?;
        Ok(device)
    }

    /// The library that the device belongs to.
    pub fn library(&self) -> &Library {
        &self.0.library
    }

    /// Bytes that Embree has allocated on behalf of this device, shared buffers not counted.
    pub fn memory_bytes(&self) -> usize {
        usize::try_from(self.0.state.memory.load(Ordering::Relaxed)).unwrap_or(0)
    }

    /// Whether packets of `width` rays are traversed as such; others are traced ray by ray, with the
    /// same results.
    pub fn native_packets(&self, width: usize) -> bool {
        let property = match width {
            1 => return true,
            4 => v4::RTC_DEVICE_PROPERTY_NATIVE_RAY4_SUPPORTED,
            8 => v4::RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED,
            16 => v4::RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED,
            _ => return false,
        };
        self.property(property) != 0
    }

    /// How many calls of opacity filters ended in a panic, and counted as opaque.
    pub fn filter_panics(&self) -> usize {
        self.0.state.filter_panics.load(Ordering::Relaxed)
    }

    /// What [`Device::filter_panics`] reads.
    pub(crate) fn filter_panic_counter(&self) -> Arc<AtomicUsize> {
        self.0.state.filter_panics.clone()
    }

    pub(crate) fn handle(&self) -> RTCDevice {
        self.0.handle
    }

    #[inline(always)]
    pub(crate) fn api(&self) -> &Api {
        self.0.library.api()
    }

    pub(crate) fn is(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }

    /// Turns an error of the calls before, on this thread, into a result.
    pub(crate) fn check(&self, action: &'static str) -> Result<(), Error> {
        // SAFETY: the device is valid.
        let code = unsafe { call!(self.api(), rtcGetDeviceError(self.0.handle)) };
        let mut errors = self.0.state.errors.lock().unwrap_or_else(PoisonError::into_inner);
        if code == v4::RTC_ERROR_NONE {
            return Ok(());
        }
        let code = Code::from_raw(code);
        // Embree keeps the code of the first error of a thread, so the first text belongs to it.
        let own = thread::current().id();
        let text = errors.iter().find(|(thread, _)| *thread == own).map(|(_, text)| text.clone());
        errors.retain(|(thread, _)| *thread != own);
        Err(Error::Embree { action, code, text: text.unwrap_or_else(|| code.to_string()) })
    }

    fn property(&self, property: v4::RTCDeviceProperty) -> isize {
        // SAFETY: the device is valid, the property exists in both versions.
        unsafe { call!(self.api(), rtcGetDeviceProperty(self.0.handle, property)) }
    }

    fn require(&self, property: v4::RTCDeviceProperty, set: bool, reason: &'static str) -> Result<(), Error> {
        if (self.property(property) != 0) == set {
            Ok(())
        } else {
            Err(Error::UnsuitableBuild { version: self.0.library.version(), reason })
        }
    }
}

impl std::fmt::Debug for Device {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("Device").field(&self.0.library).finish()
    }
}

impl Drop for Inner {
    fn drop(&mut self) {
        // SAFETY: this is the last user of the handle; geometries and scenes hold a `Device`.
        unsafe { call!(self.library.api(), rtcReleaseDevice(self.handle)) }
    }
}

/// `RTCErrorFunction`: keeps the text.
unsafe extern "C" fn on_error(user: *mut c_void, _code: v4::RTCError, text: *const c_char) {
    // A panic must not cross into C; an error without its text is still an error.
    let _ = catch_unwind(AssertUnwindSafe(|| {
        // SAFETY: the pointer is the one given to rtcSetDeviceErrorFunction.
        let state = unsafe { &*user.cast::<State>() };
        let text = if text.is_null() {
            String::new()
        } else {
            // SAFETY: Embree passes a string that ends in a zero byte.
            unsafe { CStr::from_ptr(text) }.to_string_lossy().into_owned()
        };
        let mut errors = state.errors.lock().unwrap_or_else(PoisonError::into_inner);
        // Bounded, should Embree report from a thread that never fetches.
        if errors.len() < 64 {
            errors.push((thread::current().id(), text));
        }
    }));
}

/// `RTCMemoryMonitorFunction`: counts, and never refuses.
unsafe extern "C" fn on_memory(user: *mut c_void, bytes: isize, _post: bool) -> bool {
    // SAFETY: the pointer is the one given to rtcSetDeviceMemoryMonitorFunction.
    let state = unsafe { &*user.cast::<State>() };
    state.memory.fetch_add(bytes, Ordering::Relaxed);
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Errors carry Embree's own text, go to the thread that made them, and are gone once fetched. The
    /// safe layer lets no mistake through that could be made here, so the raw functions make one: a
    /// buffer that is not aligned.
    #[test]
    #[cfg_attr(miri, ignore = "calls Embree")]
    fn errors_carry_embrees_text() {
        let Ok(library) = Library::load() else {
            if std::env::var_os("REQUIRE_EMBREE").is_some() {
                panic!("Embree is required");
            }
            let _ = std::io::Write::write_all(&mut std::io::stderr(), b"SKIPPED errors_carry_embrees_text\n");
            return;
        };
        let device = Device::new(&library, "").unwrap();
        let data = [0u32; 16];
        // SAFETY: Embree refuses the pointer and does not keep it; the geometry is released once.
        let geometry = unsafe {
            let geometry =
                call!(device.api(), rtcNewGeometry(device.handle(), v4::RTC_GEOMETRY_TYPE_TRIANGLE));
            call!(
                device.api(),
                rtcSetSharedGeometryBuffer(
                    geometry,
                    v4::RTC_BUFFER_TYPE_INDEX,
                    0,
                    v4::RTC_FORMAT_UINT3,
                    data.as_ptr().cast(),
                    1,
                    12,
                    1
                )
            );
            geometry
        };
        let elsewhere = device.clone();
        assert_eq!(thread::spawn(move || elsewhere.check("do nothing")).join().unwrap(), Ok(()));
        let error = device.check("share a buffer").unwrap_err();
        // SAFETY: the handle is valid.
        unsafe { call!(device.api(), rtcReleaseGeometry(geometry)) };
        let Error::Embree { action, code, text } = &error else { panic!("{error:?}") };
        assert_eq!((*action, *code), ("share a buffer", Code::InvalidOperation));
        assert!(text.contains("align"), "{text}");
        assert!(error.to_string().contains(text), "{error}");
        assert_eq!(device.check("do nothing"), Ok(()));
    }

    /// Embree hands its callbacks a pointer and a text, which may be missing, from any thread.
    #[test]
    fn callbacks_reach_the_state_through_their_pointer() {
        let state = Box::<State>::default();
        let user = ptr::from_ref(&*state).cast_mut().cast::<c_void>();
        // SAFETY: the state outlives the calls; the texts end in a zero byte or are null.
        unsafe {
            on_error(user, v4::RTC_ERROR_UNKNOWN, c"first".as_ptr());
            on_error(user, v4::RTC_ERROR_UNKNOWN, ptr::null());
            assert!(on_memory(user, 48, false) && on_memory(user, -16, true));
        }
        thread::scope(|scope| {
            let state = &*state;
            scope.spawn(move || {
                let user = ptr::from_ref(state).cast_mut().cast::<c_void>();
                // SAFETY: as above.
                unsafe { on_error(user, v4::RTC_ERROR_UNKNOWN, c"elsewhere".as_ptr()) };
            });
        });
        let errors = state.errors.lock().unwrap();
        assert_eq!(
            errors.iter().map(|(_, text)| text.as_str()).collect::<Vec<_>>(),
            ["first", "", "elsewhere"]
        );
        assert_ne!(errors[0].0, errors[2].0);
        assert_eq!(state.memory.load(Ordering::Relaxed), 32);
    }
}
