//! Hashes of positions, and maps of keys that are hashes.

use std::hash::{BuildHasherDefault, Hasher};

use glam::Vec3;

/// Three numbers of [0, 1) that belong to a position: the same every time, and unlike those of others.
pub fn hash_to_unit_cube(x: Vec3) -> Vec3 {
    let bits = x.to_array().map(f32::to_bits);
    let mut h = mix(u64::from(bits[0]) | u64::from(bits[1]) << 32);
    h = mix(h ^ u64::from(bits[2]));
    let part = |shift: u32| (h >> shift & 0x1f_ffff) as f32 / (1u32 << 21) as f32;
    Vec3::new(part(0), part(21), part(42))
}

/// Finaliser of SplitMix64.
#[inline(always)]
pub fn mix(mut h: u64) -> u64 {
    h = (h ^ h >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    h = (h ^ h >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
    h ^ h >> 31
}

/// Takes keys, which are hashes, for what they are.
#[derive(Default)]
pub struct KeyHasher(u64);

/// Builds [`KeyHasher`]s.
pub type BuildKeyHasher = BuildHasherDefault<KeyHasher>;

impl Hasher for KeyHasher {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.0 = mix(self.0 ^ u64::from(byte));
        }
    }

    fn write_u64(&mut self, key: u64) {
        self.0 = key;
    }
}
