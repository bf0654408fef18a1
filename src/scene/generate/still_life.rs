//! A still life: balls, boxes and columns on a floor before a wall; large smooth surfaces that hide no artefact.

use std::path::Path;

use glam::Vec3;

use super::error::GenerateError;
use super::files::write_files;
use super::shapes::{ball, cuboid, cylinder, object, quad};

const MATERIALS: &str = "\
newmtl floor
Kd 0.62 0.58 0.52
newmtl wall
Kd 0.66 0.68 0.72
newmtl red
Kd 0.72 0.16 0.12
newmtl blue
Kd 0.14 0.24 0.66
newmtl white
Kd 0.78 0.78 0.76
newmtl ochre
Kd 0.70 0.48 0.16
";

/// Rings of a ball.
const RINGS: u32 = 20;

/// Writes `still-life.obj` and `still-life.mtl` into `folder`, which is created if need be.
///
/// # Errors
/// [`GenerateError::Write`]; then neither file is new.
pub fn write(folder: &Path) -> Result<(), GenerateError> {
    let text = obj();
    write_files(
        folder,
        &[
            ("still-life.obj", &|out| out.write_all(text.as_bytes())),
            ("still-life.mtl", &|out| out.write_all(MATERIALS.as_bytes())),
        ],
    )
}

fn obj() -> String {
    let mut text = "# lightmesh generate still-life\nmtllib still-life.mtl\n".to_owned();
    object(&mut text, "floor", "floor");
    quad(&mut text, Vec3::new(-5.0, 0.0, -3.0), Vec3::Z * 9.0, Vec3::X * 10.0);
    object(&mut text, "wall", "wall");
    quad(&mut text, Vec3::new(-5.0, 0.0, -3.0), Vec3::X * 10.0, Vec3::Y * 5.0);
    object(&mut text, "pedestal", "white");
    cuboid(&mut text, Vec3::new(-1.0, 0.0, -1.6), Vec3::new(0.6, 0.9, 0.0));
    object(&mut text, "slab", "ochre");
    cuboid(&mut text, Vec3::new(1.1, 0.0, -1.1), Vec3::new(1.5, 2.1, 0.5));
    for (index, x) in [-3.4, -2.6, 3.2].into_iter().enumerate() {
        object(&mut text, &format!("column_{index}"), "white");
        cylinder(&mut text, Vec3::new(x, 0.0, -2.0), 3.6, 0.22, 32);
    }
    for (name, material, centre, radius) in [
        ("ball_on_pedestal", "red", Vec3::new(-0.2, 1.65, -0.8), 0.75),
        ("ball_left", "white", Vec3::new(-1.7, 0.6, 0.9), 0.6),
        ("ball_right", "blue", Vec3::new(0.6, 0.45, 1.5), 0.45),
    ] {
        object(&mut text, name, material);
        ball(&mut text, centre, radius, RINGS);
    }
    text
}
