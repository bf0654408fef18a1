//! Readings as CSV.

use std::fmt::Write as _;

use glam::Vec3;

use super::probes::Probe;

/// How light is weighed for an eye.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    /// Lumens for a watt of green light, or for whatever unit the intensities of the scene are given in.
    pub lumens_per_watt: f32,
}

impl Unit {
    /// Intensities are in watts: 683 lm/W, the maximum of luminous efficacy, by which the lumen is defined.
    pub const WATT: Self = Self { lumens_per_watt: 683.0 };
    /// Intensities are in lumens (candela per steradian) already.
    pub const LUMEN: Self = Self { lumens_per_watt: 1.0 };

    /// Irradiance, or fluence, in linear RGB of BT.709 as illuminance in lux: 0.2126 R + 0.7152 G + 0.0722 B times the lumens per watt.
    pub fn lux(self, light: Vec3) -> f32 {
        self.lumens_per_watt * light.dot(Vec3::new(0.2126, 0.7152, 0.0722))
    }
}

/// Readings as CSV: a heading, and a line for each probe with its position, its normal if it has one, irradiance or fluence in linear RGB, and lux.
/// Numbers are the shortest that give the same single-precision number again.
///
/// The heading names what was measured: `irradiance_r`, … and `lux`, or `fluence_r`, … and `scalar_lux`. Where only some of the probes have a
/// normal the fields of the others' normals are empty, and what they measured is fluence all the same.
pub fn write_table(probes: &[Probe], light: &[Vec3], unit: Unit) -> String {
    let with_normal = probes.iter().any(|probe| probe.normal.is_some());
    let (normal, name, lux) =
        if with_normal { ("nx,ny,nz,", "irradiance", "lux") } else { ("", "fluence", "scalar_lux") };
    let mut text = format!("x,y,z,{normal}{name}_r,{name}_g,{name}_b,{lux}\n");
    for (probe, light) in probes.iter().zip(light) {
        let Vec3 { x, y, z } = probe.position;
        // Writing to a string can't fail.
        let _ = write!(text, "{x},{y},{z},");
        match probe.normal {
            Some(Vec3 { x, y, z }) => {
                let _ = write!(text, "{x},{y},{z},");
            }
            None if with_normal => text.push_str(",,,"),
            None => {}
        }
        let _ = writeln!(text, "{},{},{},{}", light.x, light.y, light.z, unit.lux(*light));
    }
    text
}
