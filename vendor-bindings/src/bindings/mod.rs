//! Generated bindings of both versions; `vendor-bindings/regenerate.sh` writes them.

#[rustfmt::skip]
#[allow(non_upper_case_globals, non_camel_case_types, non_snake_case, missing_docs, unsafe_op_in_unsafe_fn)]
#[allow(dead_code, clippy::all)]
pub(crate) mod embree3;
#[rustfmt::skip]
#[allow(non_upper_case_globals, non_camel_case_types, non_snake_case, missing_docs, unsafe_op_in_unsafe_fn)]
#[allow(dead_code, clippy::all)]
pub(crate) mod embree4;

/// What a device handle points at.
#[repr(C)]
pub(crate) struct RTCDeviceTy {
    _opaque: [u8; 0],
}

/// What a scene handle points at.
#[repr(C)]
pub(crate) struct RTCSceneTy {
    _opaque: [u8; 0],
}

/// What a geometry handle points at.
#[repr(C)]
pub(crate) struct RTCGeometryTy {
    _opaque: [u8; 0],
}

pub(crate) type RTCDevice = *mut RTCDeviceTy;
pub(crate) type RTCScene = *mut RTCSceneTy;
pub(crate) type RTCGeometry = *mut RTCGeometryTy;
