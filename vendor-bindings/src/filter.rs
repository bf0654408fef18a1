//! Opacity filters: Rust closures behind Embree's filter callbacks.

use std::{
    ffi::{c_int, c_void},
    mem,
    panic::{AssertUnwindSafe, catch_unwind},
    slice,
    sync::{
        Arc,
        atomic::{AtomicUsize, Ordering},
    },
};

use crate::bindings::{RTCGeometry, embree3 as v3, embree4 as v4};
use crate::device::Device;
use crate::library::{Api, call};

/// Whether triangle `prim_id` is opaque at barycentric (u, v). Called from many threads at once.
pub type Opacity = Arc<dyn Fn(u32, f32, f32) -> bool + Send + Sync>;

/// What the callbacks get as user data.
pub(crate) struct Filter {
    opacity: Opacity,
    panics: Arc<AtomicUsize>,
}

impl Filter {
    /// Registers an opacity filter for all queries. The result must live as long as the geometry.
    pub(crate) fn register(device: &Device, geometry: RTCGeometry, opacity: Opacity) -> Box<Self> {
        let filter = Box::new(Self { opacity, panics: device.filter_panic_counter() });
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
            self.panics.fetch_add(1, Ordering::Relaxed);
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

#[cfg(test)]
mod tests {
    use super::*;

    /// The filter reads u, v and the triangle of its lanes and no others', and clears the flags of hits that don't
    /// count; a panic leaves a hit as it is.
    #[test]
    fn flags_of_hits_that_do_not_count_are_cleared() {
        const N: usize = 4;
        // Ng (3 fields), u, v, primID, geomID, instID: fields of N lanes.
        let mut hit = [f32::NAN; 8 * N];
        hit[3 * N..4 * N].copy_from_slice(&[0.1, 0.2, 0.3, 0.4]);
        hit[4 * N..5 * N].copy_from_slice(&[0.5; N]);
        hit[5 * N..6 * N].copy_from_slice(&[7, 8, 9, 10].map(f32::from_bits));
        let opacity: Opacity = Arc::new(|prim_id, u, v| {
            assert!(prim_id != 9, "a filter that panics");
            (prim_id, u, v) == (7, 0.1, 0.5)
        });
        let filter = Filter { opacity, panics: Arc::default() };
        let user = std::ptr::from_ref(&filter).cast_mut().cast::<c_void>();
        let mut three = [-1; N];
        let arguments = v3::RTCFilterFunctionNArguments {
            valid: three.as_mut_ptr(),
            geometryUserPtr: user,
            context: std::ptr::null_mut(),
            ray: std::ptr::null_mut(),
            hit: hit.as_mut_ptr().cast(),
            N: N as u32,
        };
        // SAFETY: flags and hits are those of N lanes, and the filter outlives the calls.
        unsafe { filter3(&arguments) };
        assert_eq!(three, [-1, 0, -1, 0]);
        let mut four = [-1, -1, 0, 0];
        let arguments = v4::RTCFilterFunctionNArguments {
            valid: four.as_mut_ptr(),
            geometryUserPtr: user,
            context: std::ptr::null_mut(),
            ray: std::ptr::null_mut(),
            hit: hit.as_mut_ptr().cast(),
            N: N as u32,
        };
        // SAFETY: as above.
        unsafe { filter4(&arguments) };
        assert_eq!(four, [-1, 0, 0, 0]);
        assert_eq!(filter.panics.load(Ordering::Relaxed), 1);
    }
}
