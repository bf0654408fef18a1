//! Wavefront MTL materials.

use std::path::Path;

use glam::Vec3;

use super::text::{Lines, decode, parse_f32, split_word, tokens};
use super::{LoadError, Warning};
use crate::scene::Material;

/// The materials of one MTL file, in order, with the warnings.
#[derive(Debug, Default)]
pub struct MtlFile {
    /// The materials; the first of several of the same name is the one that counts.
    pub materials: Vec<Material>,
    /// Images and coverage of each of the materials.
    pub maps: Vec<MtlMaps>,
    /// What was found and done.
    pub warnings: Vec<Warning>,
}

/// The images that a material names, and how opaque it is.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MtlMaps {
    /// `map_Kd`.
    pub diffuse: Option<String>,
    /// `map_Ke`.
    pub emission: Option<String>,
    /// `map_d`.
    pub coverage: Option<String>,
    /// `d`, or 1 − `Tr`; 1 is opaque.
    pub alpha: Option<f32>,
}

/// Reads an MTL file's text: `Kd`, `Ks` and `Ke` become k_d, k_s and Emiss.
///
/// `Ks` is a mirror's reflectance only in the illumination models that reflect (`illum` 3 and above) or
/// where none is given; in models 0 to 2 it is the strength of a highlight, which the renderer has none
/// of, so it is dropped with a warning. Values above 1 stay as they are, with a warning.
///
/// # Errors
/// [`LoadError::Line`] for a value that is not a number, not finite or negative.
pub fn parse_mtl(text: &[u8], path: &Path) -> Result<MtlFile, LoadError> {
    let mut file = MtlFile::default();
    let mut current: Option<Open> = None;
    for (line, content) in Lines::new(text) {
        let fail = |problem: String| LoadError::Line { file: path.to_owned(), line, problem };
        let (keyword, rest) = split_word(content);
        if keyword == b"newmtl" {
            file.close(current.take(), path);
            let name = decode(rest.trim_ascii());
            let material = Material { name, ..Material::default() };
            current = Some(Open { material, maps: MtlMaps::default(), illum: None, line });
            continue;
        }
        let Some(open) = &mut current else { continue };
        match keyword {
            b"Kd" => open.material.diffuse = color(rest, open.material.diffuse).map_err(fail)?,
            b"Ks" => open.material.specular = color(rest, open.material.specular).map_err(fail)?,
            b"Ke" => open.material.emission = color(rest, open.material.emission).map_err(fail)?,
            b"map_Kd" => open.maps.diffuse = image_name(rest),
            b"map_Ke" => open.maps.emission = image_name(rest),
            b"map_d" => open.maps.coverage = image_name(rest),
            b"d" => open.maps.alpha = finite(rest),
            // Where both are given, d counts: programs disagree about Tr.
            b"Tr" if open.maps.alpha.is_none() => {
                open.maps.alpha = finite(rest).map(|tr| 1.0 - tr);
            }
            b"illum" => open.illum = tokens(rest).next().and_then(parse_f32),
            _ => {}
        }
    }
    file.close(current, path);
    Ok(file)
}

/// A material whose statements are still being read.
struct Open {
    material: Material,
    maps: MtlMaps,
    illum: Option<f32>,
    line: usize,
}

impl MtlFile {
    fn close(&mut self, open: Option<Open>, path: &Path) {
        let Some(Open { mut material, maps, illum, line }) = open else { return };
        let mut warn = |message: String| {
            self.warnings.push(Warning { file: path.to_owned(), line: Some(line), message });
        };
        if material.specular != Vec3::ZERO && illum.is_some_and(|model| model < 3.0) {
            let model = illum.unwrap_or(0.0);
            warn(format!("material '{}': Ks dropped, under illum {model} it is no mirror", material.name));
            material.specular = Vec3::ZERO;
        }
        if material.diffuse.max_element() > 1.0 || material.specular.max_element() > 1.0 {
            warn(format!("material '{}' reflects more light than it receives", material.name));
        }
        self.materials.push(material);
        self.maps.push(maps);
    }
}

/// Options of an image statement, with the number of words that each takes; of the first three, all but one may be
/// left out.
const IMAGE_OPTIONS: [(&[u8], usize); 13] = [
    (b"-o", 3),
    (b"-s", 3),
    (b"-t", 3),
    (b"-mm", 2),
    (b"-bm", 1),
    (b"-blendu", 1),
    (b"-blendv", 1),
    (b"-boost", 1),
    (b"-cc", 1),
    (b"-clamp", 1),
    (b"-imfchan", 1),
    (b"-texres", 1),
    (b"-type", 1),
];

/// The file name behind an image statement's options; it may hold spaces.
fn image_name(rest: &[u8]) -> Option<String> {
    let mut rest = rest.trim_ascii();
    while rest.first() == Some(&b'-') {
        let split = |text: &'_ [u8]| text.iter().position(u8::is_ascii_whitespace).unwrap_or(text.len());
        let (option, mut after) = rest.split_at(split(rest));
        let Some((_, count)) = IMAGE_OPTIONS.iter().find(|(name, _)| *name == option) else { break };
        after = after.trim_ascii_start();
        for taken in 0..*count {
            let (word, behind) = after.split_at(split(after));
            if taken > 0 && *count == 3 && parse_f32(word).is_none() {
                break;
            }
            after = behind.trim_ascii_start();
        }
        rest = after;
    }
    (!rest.is_empty()).then(|| decode(rest))
}

/// A number; `None` where there is none that is finite.
fn finite(rest: &[u8]) -> Option<f32> {
    tokens(rest).next().and_then(parse_f32).filter(|value| value.is_finite())
}

/// One number for grey or three for RGB. `spectral` and `xyz` forms keep the value before.
fn color(rest: &[u8], before: Vec3) -> Result<Vec3, String> {
    let mut components = [0.0; 3];
    let mut count = 0;
    for token in tokens(rest).take(3) {
        if matches!(token, b"spectral" | b"xyz") {
            return Ok(before);
        }
        let value = parse_f32(token).ok_or_else(|| format!("'{}' is not a number", decode(token)))?;
        if !value.is_finite() || value < 0.0 {
            return Err(format!("a colour must be finite and not negative, found {}", decode(token)));
        }
        components[count] = value;
        count += 1;
    }
    match count {
        1 => Ok(Vec3::splat(components[0])),
        3 => Ok(Vec3::from_array(components)),
        _ => Err(format!("a colour takes one number or three, found {count}")),
    }
}
