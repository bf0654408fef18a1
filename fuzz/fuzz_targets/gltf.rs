//! Any bytes as glTF data, binary or text, are read or refused.

#![no_main]

use std::path::Path;

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    let _ = lightmesh::scene::load::gltf::read_gltf(data, Path::new("fuzz.glb"));
});
