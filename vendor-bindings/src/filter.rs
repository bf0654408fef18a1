//! Opacity filters: Rust closures behind Embree's filter callbacks.

use std::{
    ffi::{c_int, c_void},
    mem,
    panic::{AssertUnwindSafe, catch_unwind},
    slice,
    sync::Arc,
};

use crate::bindings::{RTCGeometry, embree3 as v3, embree4 as v4};
use crate::device::Device;
use crate::library::{Api, call};

/// Tells whether triangle `prim_id` is opaque at barycentric (u, v). Called from many threads at once.
pub type Opacity = Arc<dyn Fn(u32, f32, f32) -> bool + Send + Sync>;

/// What the callbacks get as user data.
pub(crate) struct Filter {
    opacity: Opacity,
    device: Device,
}

impl Filter {
    /// Registers an opacity filter for all queries. The result must live as long as the geometry.
    pub(crate) fn register(device: &Device, geometry: RTCGeometry, opacity: Opacity) -> Box<Self> {
        let filter = Box::new(Self { opacity, device: device.clone() });
        let user = std::ptr::from_ref(&*filter).cast_mut().cast::<c_void>();
        // SAFETY: the geometry is valid, the callbacks match the version's types, and the caller keeps
        // the user data alive.
        unsafe {
            call!(device.api(), rtcSetGeometryUserData(geometry, user));
            match device.api() {
                Api::V3(embree) => {
                    (embree.rtcSetGeometryIntersectFilterFunction)(geometry, Some(filter3));
                    (embree.rtcSetGeometryOccludedFilterFunction)(geometry, Some(filter3));
                }
                Api::V4(embree) => {
                    (embree.rtcSetGeometryIntersectFilterFunction)(geometry, Some(filter4));
                    (embree.rtcSetGeometryOccludedFilterFunction)(geometry, Some(filter4));
                }
            }
        }
        filter
    }

    /// Whether a hit counts. A filter that panics leaves its triangle opaque; a panic must not unwind
    /// into C.
    fn keeps(&self, prim_id: u32, u: f32, v: f32) -> bool {
        catch_unwind(AssertUnwindSafe(|| (self.opacity)(prim_id, u, v))).unwrap_or_else(|payload| {
            // Its destructor might panic again, and what that throws is not worth another attempt.
            let _ = catch_unwind(AssertUnwindSafe(|| drop(payload))).map_err(mem::forget);
            self.device.count_filter_panic();
            true
        })
    }
}

/// `RTCFilterFunctionN` of version 3.
unsafe extern "C" fn filter3(arguments: *const v3::RTCFilterFunctionNArguments) {
    // SAFETY: Embree passes valid arguments.
    unsafe {
        let a = &*arguments;
        run(a.geometryUserPtr, a.valid, a.hit.cast(), a.N);
    }
}

/// `RTCFilterFunctionN` of version 4.
unsafe extern "C" fn filter4(arguments: *const v4::RTCFilterFunctionNArguments) {
    // SAFETY: Embree passes valid arguments.
    unsafe {
        let a = &*arguments;
        run(a.geometryUserPtr, a.valid, a.hit.cast(), a.N);
    }
}

/// Clears the valid flag of every lane whose hit does not count.
///
/// # Safety
///
/// `user` is that of [`Filter::register`]; `valid` points at `n` flags and `hit` at an `RTCHitN` of `n`
/// lanes, which nobody else accesses meanwhile.
unsafe fn run(user: *mut c_void, valid: *mut c_int, hit: *const f32, n: u32) {
    let n = n as usize;
    // SAFETY: by contract. RTCHitN is an array of n-lane fields: Ng (3), u, v, primID, …; all 4 bytes.
    let (filter, valid, u, v, prim_id) = unsafe {
        (
            &*user.cast::<Filter>(),
            slice::from_raw_parts_mut(valid, n),
            slice::from_raw_parts(hit.add(3 * n), n),
            slice::from_raw_parts(hit.add(4 * n), n),
            slice::from_raw_parts(hit.add(5 * n).cast::<u32>(), n),
        )
    };
    for (((valid, u), v), prim_id) in valid.iter_mut().zip(u).zip(v).zip(prim_id) {
        if *valid != 0 && !filter.keeps(*prim_id, *u, *v) {
            *valid = 0;
        }
    }
}
