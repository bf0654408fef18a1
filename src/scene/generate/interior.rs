//! A hall with columns, beams and benches under rows of lamps: many lights in a closed room.
//!
//! Metres; y is up, the hall runs along z and its middle is the origin of the floor.

use std::path::Path;

use glam::Vec3;

use super::error::GenerateError;
use super::files::write_files;
use super::shapes::{ball, cuboid, cylinder, object, quad};

/// A hall; see [`Interior::BAYS`] and [`Interior::LAMPS`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Interior {
    /// Pairs of columns along the hall.
    pub bays: u32,
    /// Lamps per bay.
    pub lamps: u32,
}

impl Interior {
    /// Least and greatest number of bays.
    pub const BAYS: (u32, u32) = (1, 1_000);
    /// Least and greatest number of lamps per bay.
    pub const LAMPS: (u32, u32) = (1, 1_000);

    /// Writes `interior.obj`, `interior.mtl` and `interior.toml` into `folder`, which is created if need be.
    ///
    /// # Errors
    /// [`GenerateError`]; then none of the files is new.
    pub fn write(&self, folder: &Path) -> Result<(), GenerateError> {
        for (name, found, (min, max)) in [("bays", self.bays, Self::BAYS), ("lamps", self.lamps, Self::LAMPS)]
        {
            if !(min..=max).contains(&found) {
                return Err(GenerateError::OutOfRange { name, min, max, found });
            }
        }
        let (obj, scene) = (self.obj(), self.scene_file());
        write_files(
            folder,
            &[
                ("interior.obj", &|out| out.write_all(obj.as_bytes())),
                ("interior.mtl", &|out| out.write_all(MATERIALS.as_bytes())),
                ("interior.toml", &|out| out.write_all(scene.as_bytes())),
            ],
        )
    }

    fn half_length(&self) -> f32 {
        0.5 * BAY * self.bays as f32
    }

    fn obj(&self) -> String {
        let mut text = format!(
            "# lightmesh generate interior --bays {} --lamps {}\nmtllib interior.mtl\n",
            self.bays, self.lamps
        );
        let far = self.half_length();
        let (length, width, height) = (Vec3::Z * (2.0 * far), Vec3::X * (2.0 * HALF_WIDTH), Vec3::Y * HEIGHT);
        let corner = Vec3::new(-HALF_WIDTH, 0.0, -far);
        object(&mut text, "floor", "floor");
        quad(&mut text, corner, length, width);
        object(&mut text, "ceiling", "plaster");
        quad(&mut text, corner + height, width, length);
        object(&mut text, "ends", "plaster");
        quad(&mut text, corner, width, height);
        quad(&mut text, corner + length, height, width);
        object(&mut text, "left_wall", "clay");
        quad(&mut text, corner, height, length);
        object(&mut text, "right_wall", "slate");
        quad(&mut text, corner + width, length, height);
        for bay in 0..self.bays {
            self.bay(&mut text, bay, -far + BAY * (bay as f32 + 0.5));
        }
        text
    }

    /// One pair of columns with a beam on them, and the benches between.
    fn bay(&self, text: &mut String, bay: u32, z: f32) {
        object(text, &format!("columns_{bay}"), "stone");
        for x in [-COLUMN, COLUMN] {
            let foot = Vec3::new(x, 0.0, z);
            cuboid(text, foot - Vec3::new(0.4, 0.0, 0.4), foot + Vec3::new(0.4, 0.3, 0.4));
            cylinder(text, foot + Vec3::Y * 0.3, HEIGHT - 0.9, 0.28, 20);
            let top = foot + Vec3::Y * (HEIGHT - 0.6);
            cuboid(text, top - Vec3::new(0.4, 0.0, 0.4), top + Vec3::new(0.4, 0.2, 0.4));
        }
        object(text, &format!("beam_{bay}"), "wood");
        cuboid(text, Vec3::new(-HALF_WIDTH, HEIGHT - 0.4, z - 0.2), Vec3::new(HALF_WIDTH, HEIGHT, z + 0.2));
        object(text, &format!("benches_{bay}"), "wood");
        for (x, row) in [(-1.0, 0.9), (1.0, 0.9), (-1.0, 2.4), (1.0, 2.4)] {
            let side = x * 1.55;
            let z = z - 0.5 * BAY + row;
            let seat = |low: Vec3, high: Vec3, text: &mut String| {
                cuboid(text, Vec3::new(side, 0.0, z) + low, Vec3::new(side, 0.0, z) + high);
            };
            seat(Vec3::new(-0.9, 0.42, -0.22), Vec3::new(0.9, 0.48, 0.22), text);
            seat(Vec3::new(-0.9, 0.55, 0.2), Vec3::new(0.9, 0.95, 0.25), text);
            for leg in [-0.8, 0.74] {
                seat(Vec3::new(leg, 0.0, -0.2), Vec3::new(leg + 0.06, 0.42, 0.2), text);
                seat(Vec3::new(leg, 0.42, 0.2), Vec3::new(leg + 0.06, 0.95, 0.25), text);
            }
        }
        object(text, &format!("vases_{bay}"), "slate");
        for x in [-COLUMN - 1.2, COLUMN + 1.2] {
            ball(text, Vec3::new(x, 0.35, z), 0.35, 10);
        }
    }

    fn scene_file(&self) -> String {
        let Self { bays, lamps } = *self;
        let far = self.half_length();
        format!(
            "\
# A hall of {bays} bays with {lamps} lamps each under its ceiling.
# Made by: lightmesh generate interior --bays {bays} --lamps {lamps}

[camera]
position = [-2.6, 1.75, {eye:.2}]
look_at = [0.8, 1.5, {look:.2}]
vertical_fov = 55.0

[render]
resolution = [600, 400]

[light_mesh]
spacing = 0.25

[[geometry]]
file = \"interior.obj\"

[[light_box]]
min = [-5.2, 3.9, {low:.2}]
max = [5.2, 4.25, {high:.2}]
count = {count}
seed = 1
total_intensity = [{red:.2}, {green:.2}, {blue:.2}]
color_variation = 0.2
",
            eye = far - 0.6,
            look = far - 8.0,
            low = 0.2 - far,
            high = far - 0.2,
            count = bays * lamps,
            red = 2.4 * bays as f32,
            green = 2.2 * bays as f32,
            blue = 1.9 * bays as f32,
        )
    }
}

const MATERIALS: &str = "\
newmtl floor
Kd 0.45 0.40 0.34
newmtl plaster
Kd 0.74 0.72 0.68
newmtl clay
Kd 0.62 0.32 0.22
newmtl slate
Kd 0.28 0.38 0.46
newmtl stone
Kd 0.68 0.66 0.62
newmtl wood
Kd 0.46 0.30 0.18
";

/// Distance between pairs of columns.
const BAY: f32 = 4.0;
/// Half the hall's width.
const HALF_WIDTH: f32 = 6.0;
/// The hall's height.
const HEIGHT: f32 = 5.0;
/// Distance of the columns from the hall's middle.
const COLUMN: f32 = 3.4;
