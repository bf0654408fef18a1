//! Spherical harmonics of a grid of probes, as files for game engines (docs/probes.md).

use std::f32::consts::PI;

use glam::Vec3;
use serde::Serialize;

use super::harmonics::{COEFFICIENTS, COSINE_FACTORS};
use super::probes::ProbeGrid;
use crate::export::{ImageGrid, Values, encode_vti};

/// A grid of probes with what they measured.
#[derive(Clone, Copy, Debug)]
pub struct GridFile<'a> {
    /// Where they are.
    pub grid: &'a ProbeGrid,
    /// Coefficients of radiance of each, in the order of [`ProbeGrid::positions`].
    pub coefficients: &'a [[Vec3; COEFFICIENTS]],
}

/// The JSON file, as it is written.
#[derive(Serialize)]
struct Json {
    format: &'static str,
    version: u32,
    basis: &'static str,
    quantity: &'static str,
    colour: &'static str,
    space: &'static str,
    order: &'static str,
    origin: Vec3,
    step: Vec3,
    counts: [u32; 3],
    irradiance_factors: [f32; COEFFICIENTS],
    coefficients: Vec<[[f32; 3]; COEFFICIENTS]>,
}

const FORMAT: &str = "lightmesh-sh-grid";
const VERSION: u32 = 1;

/// The grid as JSON: what the numbers mean, origin, step and counts of the grid, and for each probe nine coefficients of three channels.
///
/// # Errors
/// Of the encoder, if any.
pub fn encode_grid_json(file: &GridFile) -> serde_json::Result<String> {
    let coefficients = file.coefficients.iter().map(|of_probe| of_probe.map(|value| value.to_array()));
    let json = Json {
        format: FORMAT,
        version: VERSION,
        basis: "real, orthonormal, no Condon-Shortley phase; (l,m) = 0,0 1,-1 1,0 1,1 2,-2 2,-1 2,0 2,1 2,2",
        quantity: "radiance that arrives from a direction",
        colour: "linear RGB, BT.709",
        space: "right-handed, that of the scene",
        order: "x fastest, z slowest",
        origin: file.grid.origin,
        step: file.grid.step,
        counts: file.grid.counts.to_array(),
        irradiance_factors: COSINE_FACTORS,
        coefficients: coefficients.collect(),
    };
    Ok(serde_json::to_string(&json)? + "\n")
}

/// The same as bytes, little-endian: `LMSH`, version (u32), counts (three u32), origin and step (three f32 each), and for each probe nine
/// coefficients of three channels (27 f32).
pub fn encode_grid_bytes(file: &GridFile) -> Vec<u8> {
    let GridFile { grid, coefficients } = file;
    let mut bytes = b"LMSH".to_vec();
    bytes.extend(VERSION.to_le_bytes());
    bytes.extend(grid.counts.to_array().into_iter().flat_map(u32::to_le_bytes));
    let places = [grid.origin, grid.step];
    let numbers = places.iter().chain(coefficients.iter().flatten()).flat_map(|value| value.to_array());
    bytes.extend(numbers.flat_map(f32::to_le_bytes));
    bytes
}

/// The light of a grid as a `.vti` file for ParaView: `Fluence`, and `Direction`, the mean of the directions that the light comes from, weighted by its
/// amount, whose length is 0 for even light and 1 for that of one lamp.
pub fn encode_grid_vti(file: &GridFile) -> Vec<u8> {
    let ProbeGrid { origin, step, counts } = *file.grid;
    let fluence = |of_probe: &[Vec3; COEFFICIENTS]| of_probe[0] * (4.0 * PI).sqrt();
    let direction = |of_probe: &[Vec3; COEFFICIENTS]| {
        let [constant, y, z, x] = [0, 1, 2, 3].map(|index| of_probe[index].element_sum());
        // ∫ L ω over ∫ L: √(4π/3) c₁ over √4π c₀.
        if constant > 0.0 { Vec3::new(x, y, z) / (3f32.sqrt() * constant) } else { Vec3::ZERO }
    };
    let arrays = [
        ("Fluence".to_owned(), Values::Vectors(file.coefficients.iter().map(fluence).collect())),
        ("Direction".to_owned(), Values::Vectors(file.coefficients.iter().map(direction).collect())),
    ];
    encode_vti(&ImageGrid { origin, step, counts }, &arrays)
}
