//! Any bytes as OBJ text are read or refused.

#![no_main]

use std::path::Path;

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    let _ = lightmesh::scene::load::obj::read_obj(data, Path::new("fuzz.obj"), Default::default());
});
