//! How much memory a scene takes, before it is built.

use serde::Serialize;

use super::BackendChoice;
use crate::scene::{Scene, TriangleMesh};

/// Bytes of an acceleration structure, estimated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Footprint {
    /// Bytes of the finished structure.
    pub built: u64,
    /// Bytes at the peak of the build.
    pub building: u64,
}

/// Bytes per triangle and per placed instance. Measured on scenes of 23,542 to 1.2 million triangles: 70 to
/// 71 bytes built for Embree and 74 to 91 for the BVH, and 107 and 167 at the peak of a build of 871,306 triangles.
struct Rates {
    built: (u64, u64),
    building: (u64, u64),
}

const EMBREE: Rates = Rates { built: (70, 260), building: (110, 700) };
const BVH: Rates = Rates { built: (80, 260), building: (170, 400) };

/// Estimates for a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct MemoryEstimate {
    /// Bytes of the scene's own vertices, indices and materials.
    pub scene: u64,
    /// Bytes of an acceleration structure in Embree.
    pub embree: Footprint,
    /// Bytes of the built-in BVH.
    pub bvh: Footprint,
}

impl MemoryEstimate {
    /// The estimates of a scene that is loaded.
    pub fn of(scene: &Scene) -> Self {
        let triangles: u64 = scene.meshes.iter().map(|mesh| mesh.triangles.len() as u64).sum();
        let placed = scene.instances.iter().filter(|instance| instance.to_world.is_some()).count() as u64;
        let tree = |(triangle, instance): (u64, u64)| triangles * triangle + placed * instance;
        let footprint =
            |rates: &Rates| Footprint { built: tree(rates.built), building: tree(rates.building) };
        Self {
            scene: scene.meshes.iter().map(|mesh| mesh_bytes(mesh)).sum(),
            embree: footprint(&EMBREE),
            bvh: footprint(&BVH),
        }
    }

    /// The acceleration structure of a backend.
    pub fn structure(&self, backend: BackendChoice) -> Footprint {
        let Self { embree, bvh, .. } = *self;
        match backend {
            BackendChoice::Embree => embree,
            BackendChoice::Bvh => bvh,
            // Which one it will be shows when Embree is looked for: the larger is safe.
            BackendChoice::Auto => {
                Footprint { built: embree.built.max(bvh.built), building: embree.building.max(bvh.building) }
            }
            BackendChoice::BruteForce => Footprint { built: 0, building: 0 },
        }
    }
}

fn mesh_bytes(mesh: &TriangleMesh) -> u64 {
    let per_vertex = 12
        + mesh.normals.as_ref().map_or(0, |_| 12)
        + mesh.uvs.as_ref().map_or(0, |_| 8)
        + mesh.colors.as_ref().map_or(0, |_| 12);
    (mesh.positions.as_slice().len() * per_vertex + mesh.triangles.len() * 16) as u64
}

/// Reads a size in bytes: a number, with K, M, G or T for powers of 1024.
///
/// # Errors
/// What is expected, in words.
pub fn parse_size(text: &str) -> Result<u64, String> {
    let trimmed = text.trim();
    let (digits, factor) = match trimmed.char_indices().next_back() {
        Some((at, unit)) if unit.is_ascii_alphabetic() => {
            let power = "KMGT".find(unit.to_ascii_uppercase()).map(|power| power as u32 + 1);
            (&trimmed[..at], power.map(|power| 1024f64.powi(power as i32)))
        }
        _ => (trimmed, Some(1.0)),
    };
    let number = digits.parse::<f64>().ok().filter(|number| number.is_finite() && *number > 0.0);
    match (number, factor) {
        (Some(number), Some(factor)) if number * factor < u64::MAX as f64 => Ok((number * factor) as u64),
        _ => Err(format!("`{text}` is not a size, such as 500M or 8G")),
    }
}

/// A scene that would take more memory than is allowed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "needs about {} MiB while it is built, {} of it for the acceleration structure; the limit is {} MiB",
    mebibytes(*needed), mebibytes(*structure), mebibytes(*limit)
)]
pub struct MemoryLimitError {
    /// Bytes that it would take.
    pub needed: u64,
    /// Bytes of the acceleration structure among them.
    pub structure: u64,
    /// Bytes that are allowed.
    pub limit: u64,
}

fn mebibytes(bytes: u64) -> u64 {
    bytes.div_ceil(1 << 20)
}

/// Refuses a scene that exceeds a limit, if there is one, with the acceleration structures of all these backends. Returns what the limit leaves once they
/// are built.
///
/// # Errors
/// [`MemoryLimitError`] with the estimate.
pub fn check_memory(
    scene: &Scene,
    backends: &[BackendChoice],
    limit: Option<u64>,
) -> Result<Option<u64>, MemoryLimitError> {
    let estimate = MemoryEstimate::of(scene);
    let structures = || backends.iter().map(|backend| estimate.structure(*backend));
    let structure = structures().map(|structure| structure.building).sum();
    let needed = estimate.scene + structure;
    let Some(limit) = limit else { return Ok(None) };
    if needed > limit {
        return Err(MemoryLimitError { needed, structure, limit });
    }
    let built: u64 = structures().map(|structure| structure.built).sum();
    Ok(Some(limit - estimate.scene - built.min(structure)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_bytes_or_powers_of_1024() {
        assert_eq!(parse_size("4096"), Ok(4096));
        assert_eq!(parse_size("1.5K"), Ok(1536));
        assert_eq!(parse_size("8G"), Ok(8 << 30));
        assert_eq!(parse_size("2t"), Ok(2 << 40));
        for wrong in ["", "G", "-1G", "0", "1X", "nanM", "1e30T", "8 é"] {
            assert!(parse_size(wrong).is_err(), "{wrong}");
        }
    }
}
