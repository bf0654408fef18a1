//! Any bytes as PLY data are read or refused.

#![no_main]

use std::path::Path;

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    let _ = lightmesh::scene::load::ply::read_ply(data, Path::new("fuzz.ply"));
});
