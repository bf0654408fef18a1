//! What several tests need: the library, a scene with known answers, random numbers.

#![allow(dead_code)]

use std::{io::Write, sync::Arc};

use embree_sys::{Device, Geometry, Library, Opacity, Ray, Scene, SceneBuilder};

pub type Buffers = (Arc<Vec<[f32; 3]>>, Arc<Vec<[u32; 3]>>);

/// The installed library. Without one the test is skipped, aloud; where `REQUIRE_EMBREE` is set it fails,
/// as it does where that names another major version than the one found.
pub fn library() -> Option<Library> {
    let required = std::env::var("REQUIRE_EMBREE").ok();
    match Library::load() {
        Ok(library) => {
            if let Some(major) =
                required.and_then(|value| value.parse::<u32>().ok()).filter(|major| *major > 1)
            {
                assert_eq!(library.version().major, major, "REQUIRE_EMBREE names the version");
            }
            Some(library)
        }
        Err(error) if required.is_some() => panic!("{error}"),
        Err(error) => {
            let test = std::thread::current();
            // Not eprintln!, which the test harness swallows.
            let _ = writeln!(std::io::stderr(), "SKIPPED {}: {error}", test.name().unwrap_or_default());
            None
        }
    }
}

/// A device, or `None` where the test is skipped.
pub fn device() -> Option<Device> {
    Some(Device::new(&library()?, "").unwrap())
}

/// Devices for every instruction set that Embree has code for and this processor runs; none where the test is
/// skipped. Each set has traversals of its own, and packets that are wider than it are taken apart.
pub fn devices() -> Vec<Device> {
    let Some(library) = library() else { return Vec::new() };
    let mut configurations = vec!["", "isa=sse2", "isa=sse4.2"];
    #[cfg(target_arch = "x86_64")]
    {
        if std::arch::is_x86_feature_detected!("avx") {
            configurations.push("isa=avx");
        }
        if std::arch::is_x86_feature_detected!("avx2") {
            configurations.push("isa=avx2");
        }
    }
    configurations.into_iter().map(|configuration| Device::new(&library, configuration).unwrap()).collect()
}

/// The square [0, n]² at z = 0 in unit cells of two triangles, 2·(y·n + x) and the one after it.
pub fn floor(n: u32) -> Buffers {
    let mut vertices: Vec<[f32; 3]> =
        (0..=n).flat_map(|y| (0..=n).map(move |x| [x as f32, y as f32, 0.0])).collect();
    vertices.push([f32::NAN; 3]); // the padding is never looked at
    let triangles = (0..n).flat_map(|y| {
        (0..n).flat_map(move |x| {
            let a = y * (n + 1) + x;
            [[a, a + 1, a + n + 1], [a + n + 2, a + n + 1, a + 1]]
        })
    });
    (Arc::new(vertices), Arc::new(triangles.collect()))
}

/// One geometry under id 0.
pub fn scene_of(device: &Device, (vertices, triangles): Buffers, opacity: Option<Opacity>) -> Scene {
    let mut builder = SceneBuilder::new(device).unwrap();
    builder.attach(0, Geometry::triangles(device, vertices, triangles, opacity).unwrap()).unwrap();
    builder.commit().unwrap()
}

/// Straight down from height 2 above (x, y).
pub fn down(x: f32, y: f32) -> Ray {
    Ray { origin: [x, y, 2.0], direction: [0.0, 0.0, -1.0], tnear: 0.0, tfar: f32::INFINITY }
}

/// Reproducible numbers in [0, 1) (SplitMix64).
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / (1u64 << 24) as f32
    }

    pub fn vector(&mut self, low: f32, high: f32) -> [f32; 3] {
        std::array::from_fn(|_| low + (high - low) * self.next())
    }
}
