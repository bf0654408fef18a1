//! Proof, at compile time, that the packet types have the memory layout of both Embree versions.

use std::mem::{align_of, offset_of, size_of};

use crate::bindings::{embree3 as v3, embree4 as v4};
use crate::packet::{HitPacket, RayHitPacket, RayPacket};

/// One width of one version: every ray field, and every hit field that the version has.
macro_rules! assert_packet {
    ($n:literal, $version:ident, $ray:ident, $hit:ident, $ray_hit:ident, $($extra:ident = $extra_theirs:ident),*) => {
        const _: () = {
            use $version::{$hit, $ray, $ray_hit};
            assert_packet!(@fields RayPacket<$n>, $ray:
                org_x = org_x, org_y = org_y, org_z = org_z, tnear = tnear,
                dir_x = dir_x, dir_y = dir_y, dir_z = dir_z, time = time,
                tfar = tfar, mask = mask, id = id, flags = flags);
            assert_packet!(@fields HitPacket<$n>, $hit:
                ng_x = Ng_x, ng_y = Ng_y, ng_z = Ng_z, u = u, v = v,
                prim_id = primID, geom_id = geomID, inst_id = instID $(, $extra = $extra_theirs)*);
            assert_packet!(@fields RayHitPacket<$n>, $ray_hit: ray = ray, hit = hit);
            // Embree may write all of its struct, so ours must cover it.
            assert!(size_of::<RayPacket<$n>>() == size_of::<$ray>());
            assert!(size_of::<RayHitPacket<$n>>() >= size_of::<$ray_hit>());
            assert!(align_of::<RayPacket<$n>>() >= align_of::<$ray>());
            assert!(align_of::<RayHitPacket<$n>>() >= align_of::<$ray_hit>());
        };
    };
    (@fields $ours:ty, $theirs:ty: $($a:ident = $b:ident),*) => {
        $(assert!(offset_of!($ours, $a) == offset_of!($theirs, $b));)*
    };
}

assert_packet!(4, v3, RTCRay4, RTCHit4, RTCRayHit4,);
assert_packet!(8, v3, RTCRay8, RTCHit8, RTCRayHit8,);
assert_packet!(16, v3, RTCRay16, RTCHit16, RTCRayHit16,);
assert_packet!(4, v4, RTCRay4, RTCHit4, RTCRayHit4, inst_prim_id = instPrimID);
assert_packet!(8, v4, RTCRay8, RTCHit8, RTCRayHit8, inst_prim_id = instPrimID);
assert_packet!(16, v4, RTCRay16, RTCHit16, RTCRayHit16, inst_prim_id = instPrimID);

// Single rays travel in version 4's structs whatever the version; version 3's must be a prefix.
const _: () = {
    assert!(size_of::<v4::RTCRay>() == size_of::<v3::RTCRay>());
    assert!(size_of::<v4::RTCRayHit>() >= size_of::<v3::RTCRayHit>());
    assert!(align_of::<v4::RTCRayHit>() >= align_of::<v3::RTCRayHit>());
    assert!(offset_of!(v4::RTCRayHit, hit) == offset_of!(v3::RTCRayHit, hit));
    assert!(offset_of!(v4::RTCRay, org_x) == offset_of!(v3::RTCRay, org_x));
    assert!(offset_of!(v4::RTCRay, tnear) == offset_of!(v3::RTCRay, tnear));
    assert!(offset_of!(v4::RTCRay, dir_x) == offset_of!(v3::RTCRay, dir_x));
    assert!(offset_of!(v4::RTCRay, tfar) == offset_of!(v3::RTCRay, tfar));
    assert!(offset_of!(v4::RTCRay, mask) == offset_of!(v3::RTCRay, mask));
    assert!(offset_of!(v4::RTCHit, u) == offset_of!(v3::RTCHit, u));
    assert!(offset_of!(v4::RTCHit, v) == offset_of!(v3::RTCHit, v));
    assert!(offset_of!(v4::RTCHit, primID) == offset_of!(v3::RTCHit, primID));
    assert!(offset_of!(v4::RTCHit, geomID) == offset_of!(v3::RTCHit, geomID));
    assert!(offset_of!(v4::RTCHit, instID) == offset_of!(v3::RTCHit, instID));
};

/// A constant or a struct that the safe layer takes from version 4 and hands to both.
macro_rules! assert_same {
    ($($name:ident),*) => {
        const _: () = { $(assert!(v3::$name == v4::$name);)* };
    };
}

assert_same!(
    RTC_DEVICE_PROPERTY_VERSION_MAJOR,
    RTC_DEVICE_PROPERTY_VERSION_MINOR,
    RTC_DEVICE_PROPERTY_VERSION_PATCH,
    RTC_DEVICE_PROPERTY_NATIVE_RAY4_SUPPORTED,
    RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED,
    RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED,
    RTC_DEVICE_PROPERTY_RAY_MASK_SUPPORTED,
    RTC_DEVICE_PROPERTY_BACKFACE_CULLING_ENABLED,
    RTC_DEVICE_PROPERTY_FILTER_FUNCTION_SUPPORTED,
    RTC_DEVICE_PROPERTY_TRIANGLE_GEOMETRY_SUPPORTED,
    RTC_ERROR_NONE,
    RTC_ERROR_UNKNOWN,
    RTC_ERROR_INVALID_ARGUMENT,
    RTC_ERROR_INVALID_OPERATION,
    RTC_ERROR_OUT_OF_MEMORY,
    RTC_ERROR_UNSUPPORTED_CPU,
    RTC_ERROR_CANCELLED,
    RTC_GEOMETRY_TYPE_TRIANGLE,
    RTC_GEOMETRY_TYPE_INSTANCE,
    RTC_BUFFER_TYPE_INDEX,
    RTC_BUFFER_TYPE_VERTEX,
    RTC_FORMAT_UINT3,
    RTC_FORMAT_FLOAT3,
    RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR,
    RTC_BUILD_QUALITY_LOW,
    RTC_BUILD_QUALITY_MEDIUM,
    RTC_BUILD_QUALITY_HIGH,
    RTC_SCENE_FLAG_ROBUST
);

const _: () = {
    assert!(size_of::<v3::RTCBounds>() == size_of::<v4::RTCBounds>());
    assert!(offset_of!(v3::RTCBounds, upper_x) == offset_of!(v4::RTCBounds, upper_x));
    assert!(size_of::<v3::RTCFilterFunctionNArguments>() == size_of::<v4::RTCFilterFunctionNArguments>());
    assert!(
        offset_of!(v3::RTCFilterFunctionNArguments, geometryUserPtr)
            == offset_of!(v4::RTCFilterFunctionNArguments, geometryUserPtr)
    );
    assert!(
        offset_of!(v3::RTCFilterFunctionNArguments, hit) == offset_of!(v4::RTCFilterFunctionNArguments, hit)
    );
    assert!(offset_of!(v3::RTCFilterFunctionNArguments, N) == offset_of!(v4::RTCFilterFunctionNArguments, N));
};
