//! The field as data: light at points that a caller names, as a lighting designer measures it with a meter (docs/probes.md).
//!
//! Nothing is interpolated: from every probe, rays go to all lights, and, for light from surfaces, in many directions.
//!
//! | file | what |
//! |---|---|
//! | `probes` | probes, and where they lie: in files, along lines, on planes, in grids |
//! | `sensor` | what a probe measures: irradiance of a normal, fluence, or harmonics |
//! | `harmonics` | the basis of spherical harmonics |
//! | `direct` | light of lights |
//! | `gather` | light of surfaces and of the background |
//! | `measure` | both together, for many probes |
//! | `table`, `map`, `grid_file` | readings as CSV, as images, as files for game engines |

mod direct;
mod gather;
mod grid_file;
mod harmonics;
mod map;
mod measure;
mod probes;
mod sensor;
mod station;
mod table;

pub use grid_file::{GridFile, encode_grid_bytes, encode_grid_json, encode_grid_vti};
pub use harmonics::{COEFFICIENTS, COSINE_FACTORS, basis};
pub use map::{false_colours, luminous_map};
pub use measure::{ProbeSettings, measure, measure_harmonics};
pub use probes::{Plane, Probe, ProbeGrid, line, load_probes};
pub use table::{Unit, write_table};
