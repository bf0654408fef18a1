//! `[[geometry]]` and `[[material]]`: models, where they stand, and changes to their materials.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use glam::{Affine3A, EulerRot, Mat3A, Quat, Vec3A};
use serde::Deserialize;
use toml::Spanned;

use super::gathered::{Gathered, Placement};
use super::keyframes::{self, GeometryKeyframe, Steps};
use super::place::Places;
use super::values::{Color, Finite, Point, Reflectance, Rotation, ScaleFactors};
use crate::scene::animation::{Interpolation, Node};
use crate::scene::load::parts::{MaterialOverride, Selector};
use crate::scene::load::{LoadError, Model, load_model, transform};

/// `[[geometry]]`
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GeometryTable {
    file: Spanned<PathBuf>,
    translate: Option<Point>,
    rotate: Option<Rotation>,
    scale: Option<ScaleFactors>,
    matrix: Option<Spanned<[[Finite; 4]; 3]>>,
    keyframes: Option<Spanned<Vec<GeometryKeyframe>>>,
    interpolation: Option<Spanned<Interpolation>>,
    #[serde(default = "yes")]
    lights: bool,
    #[serde(default = "yes")]
    cameras: bool,
}

fn yes() -> bool {
    true
}

/// `[[material]]`
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MaterialTable {
    name: Option<String>,
    object: Option<String>,
    file: Option<PathBuf>,
    diffuse: Option<Reflectance>,
    specular: Option<Reflectance>,
    emission: Option<Color>,
    two_sided: Option<bool>,
    cull: Option<bool>,
}

impl MaterialTable {
    fn selector(&self) -> Option<Selector> {
        match (&self.name, &self.object) {
            (Some(name), None) => Some(Selector::Material(name.clone())),
            (None, Some(object)) => Some(Selector::Object(object.clone())),
            (None, None) => Some(Selector::All),
            (Some(_), Some(_)) => None,
        }
    }

    fn values(&self) -> MaterialOverride {
        MaterialOverride {
            diffuse: self.diffuse.map(|color| color.0),
            specular: self.specular.map(|color| color.0),
            emission: self.emission.map(|color| color.0),
            two_sided: self.two_sided,
            cull: self.cull,
        }
    }
}

impl GeometryTable {
    /// Object to world; `None` where the table states no transform.
    fn to_world(&self, index: usize, places: &Places) -> Result<Option<Affine3A>, LoadError> {
        let steps = self.translate.is_some() || self.rotate.is_some() || self.scale.is_some();
        let key = format!("geometry[{index}].matrix");
        if let Some(matrix) = &self.matrix {
            if steps {
                let problem = "excludes translate, rotate and scale";
                return Err(places.error(&matrix.span(), &key, problem));
            }
            let rows = matrix.get_ref().map(|row| row.map(|x| x.0));
            let column = |i: usize| Vec3A::new(rows[0][i], rows[1][i], rows[2][i]);
            let linear = Mat3A::from_cols(column(0), column(1), column(2));
            if !transform::is_invertible(&linear) {
                return Err(places.error(&matrix.span(), &key, "flattens space (its determinant is 0)"));
            }
            return Ok(Some(Affine3A { matrix3: linear, translation: column(3) }));
        }
        if !steps {
            return Ok(None);
        }
        let rotation = match &self.rotate {
            None => Quat::IDENTITY,
            Some(Rotation::Axes(angles)) => {
                // The first turn about x: a vector is multiplied by it first.
                let [x, y, z] = angles.to_array();
                Quat::from_euler(EulerRot::ZYX, z.to_radians(), y.to_radians(), x.to_radians())
            }
            Some(Rotation::AxisAngle { axis, degrees }) => {
                Quat::from_axis_angle(axis.as_dvec3().normalize().as_vec3(), degrees.to_radians())
            }
        };
        let scale = self.scale.map_or(glam::Vec3::ONE, |scale| scale.0);
        let translation = self.translate.map_or(glam::Vec3::ZERO, |t| t.0);
        Ok(Some(Affine3A::from_scale_rotation_translation(scale, rotation, translation)))
    }
}

impl GeometryTable {
    /// How the model moves, if it does.
    fn motion(&self, index: usize, places: &Places) -> Result<Option<Node>, LoadError> {
        let Some(keyframes) = &self.keyframes else {
            let Some(interpolation) = &self.interpolation else { return Ok(None) };
            let key = format!("geometry[{index}].interpolation");
            return Err(places.error(&interpolation.span(), &key, "needs keyframes"));
        };
        let error =
            |problem: &str| places.error(&keyframes.span(), &format!("geometry[{index}].keyframes"), problem);
        if self.matrix.is_some() {
            return Err(error("excludes matrix"));
        }
        let still = Steps {
            translate: self.translate.map(|at| at.0),
            rotate: self.rotate,
            scale: self.scale.map(|factors| factors.0),
        };
        let interpolation = self.interpolation.as_ref().map(|name| *name.get_ref()).unwrap_or_default();
        let node = keyframes::node(still, keyframes.get_ref(), interpolation);
        node.map(Some).map_err(|problem| error(&problem))
    }
}

/// Loads the models, each file once, applies the materials' changes, and places them.
pub fn load(
    geometry: &[Spanned<GeometryTable>],
    materials: &[Spanned<MaterialTable>],
    folder: &Path,
    places: &Places,
    gathered: &mut Gathered,
) -> Result<(), LoadError> {
    // Keyed by the path in full, so that two spellings of one file are one model.
    let mut models: BTreeMap<PathBuf, (Model, Vec<Placement>)> = BTreeMap::new();
    let mut order = Vec::new();
    for (index, table) in geometry.iter().enumerate() {
        let placement = Placement {
            to_world: table.get_ref().to_world(index, places)?,
            motion: table.get_ref().motion(index, places)?,
        };
        let file = &table.get_ref().file;
        let path = folder.join(file.get_ref());
        let key = format!("geometry[{index}].file");
        let readable = fs::File::open(&path).and_then(|opened| {
            if opened.metadata()?.is_dir() { Err(std::io::ErrorKind::IsADirectory.into()) } else { Ok(()) }
        });
        let canonical = readable.and_then(|()| fs::canonicalize(&path));
        let canonical =
            canonical.map_err(|error| places.unreadable(&file.span(), &key, path.clone(), error))?;
        if let Some((model, placements)) = models.get_mut(&canonical) {
            placements.push(placement);
            if !table.get_ref().lights {
                model.lights.clear();
            }
            if !table.get_ref().cameras {
                model.cameras.clear();
            }
            continue;
        }
        let mut model = load_model(&path)?;
        if !table.get_ref().lights {
            model.lights.clear();
        }
        if !table.get_ref().cameras {
            model.cameras.clear();
        }
        order.push(canonical.clone());
        models.insert(canonical, (model, vec![placement]));
    }
    for (index, table) in materials.iter().enumerate() {
        let key = format!("material[{index}]");
        let Some(selector) = table.get_ref().selector() else {
            return Err(places.error(&table.span(), &key, "name and object exclude each other"));
        };
        let only = match &table.get_ref().file {
            None => None,
            Some(file) => match fs::canonicalize(folder.join(file)) {
                Ok(path) if models.contains_key(&path) => Some(path),
                _ => {
                    let problem = "is the file of no [[geometry]]";
                    return Err(places.error(&table.span(), &format!("{key}.file"), problem));
                }
            },
        };
        let mut found = false;
        for (path, (model, _)) in &mut models {
            if only.as_ref().is_none_or(|only| only == path) {
                found |= model.apply_override(&selector, &table.get_ref().values());
            }
        }
        if !found {
            let (field, problem) = match &selector {
                Selector::Material(name) => (".name", format!("no triangle has a material '{name}'")),
                Selector::Object(name) => (".object", format!("there is no object or group '{name}'")),
                Selector::All => ("", "there is no material".to_owned()),
            };
            return Err(places.error(&table.span(), &format!("{key}{field}"), problem));
        }
    }
    for path in order {
        if let Some((model, placements)) = models.remove(&path) {
            gathered.add(model, &placements);
        }
    }
    Ok(())
}
