//! A moving camera: light at surfaces that was seen before costs nothing again, and doesn't flicker (method §5, *points on surfaces*).

use glam::Vec3;
use lightmesh::image::Image;
use lightmesh::render::{RenderStats, Session};
use lightmesh::scene::{Camera, Falloff, Light, Material, Scene};
use lightmesh::settings::{Estimator, IndirectForm, IndirectSettings, Resolve, Settings};

use crate::common::{Builder, camera, grey, light, session, settings_at};

/// Pixels of a row and of a column.
const EDGE: u32 = 64;
/// Pixels along the border that records out of sight would be interpolated at.
const BORDER: usize = 16;
/// From the camera to the wall that it looks at.
const DISTANCE: f32 = 3.0;

/// A closed room with a coloured wall, and a box that keeps the lamp's light from the wall at z = 0.
fn room() -> Scene {
    let mut builder = Builder::default();
    builder.cuboid(Vec3::ZERO, Vec3::new(6.0, 3.0, 5.0), true, 0);
    builder.cuboid(Vec3::new(0.5, 1.0, 1.2), Vec3::new(5.5, 2.9, 1.4), false, 0);
    builder.quad(Vec3::new(0.01, 0.0, 0.0), Vec3::Y * 3.0, Vec3::Z * 5.0, 1);
    let red = Material { diffuse: Vec3::new(0.7, 0.1, 0.1), ..Material::default() };
    let lamp: Light = light(Vec3::new(3.0, 2.5, 3.0), Vec3::splat(10.0));
    builder.scene(vec![grey(0.7), red], vec![lamp], Falloff::InverseSquare)
}

/// Looks straight at the wall at z = 5, from `x`.
fn view(x: f32) -> Camera {
    let position = Vec3::new(x, 1.3, 5.0 - DISTANCE);
    camera(position, position + Vec3::Z, 30.0)
}

fn settings() -> Settings {
    let mut settings = settings_at((EDGE, EDGE));
    settings.shading.lambertian = true;
    settings.shading.estimator = Estimator::PerLight;
    settings.shading.resolve = Resolve::Trace;
    settings.mesh.indirect =
        Some(IndirectSettings { form: IndirectForm::Surface, bounces: 8, ..IndirectSettings::default() });
    settings
}

fn render(session: &mut Session, camera: &Camera) -> (Image, RenderStats) {
    session.render(camera, &settings()).expect("an image")
}

/// The wall's illumination doesn't depend on the camera. A camera that moves along it by whole pixels sees the same places; what it sees of them
/// differs by less than an eye tells, a hundredth (Weber's contrast threshold), and on average by a tenth of that. Within two records, of at most eight
/// pixels each, of the border it may be three hundredths, a record's noise: the next records come into sight there.
#[test]
fn a_static_wall_does_not_flicker() {
    let scene = room();
    let mut session = session(&scene);
    let pixel = view(0.0).pixel_footprint((EDGE, EDGE)).edge * DISTANCE;
    let frames: Vec<Image> =
        (0..24).map(|frame| render(&mut session, &view(2.5 + frame as f32 * pixel)).0).collect();
    let (mut worst, mut at_border, mut sum, mut count) = (0.0f32, 0.0f32, 0.0, 0);
    let inside = BORDER..EDGE as usize - BORDER - 1;
    for (before, after) in frames.iter().zip(&frames[1..]) {
        let [before, after] = [before, after].map(|image| image.pixels());
        for y in 0..EDGE as usize {
            for x in 0..EDGE as usize - 1 {
                // Towards +z the camera's right is −x: the picture moves to the right.
                let [a, b] =
                    [before[y * EDGE as usize + x], after[y * EDGE as usize + x + 1]].map(Vec3::from_array);
                let difference = ((a - b).abs() / a.max(Vec3::splat(1e-3))).max_element();
                if inside.contains(&x) && inside.contains(&y) {
                    worst = worst.max(difference);
                } else {
                    at_border = at_border.max(difference);
                }
                sum += f64::from(difference);
                count += 1;
            }
        }
    }
    let mean = sum / f64::from(count);
    assert!(
        worst < 0.01 && at_border < 0.03 && mean < 0.001,
        "{worst}, {at_border} at the border, {mean} on average"
    );
}

/// Once the room is known, another view of it gathers only what comes into sight, and one that was seen nothing.
#[test]
fn another_view_of_a_room_costs_little() {
    let scene = room();
    let mut session = session(&scene);
    let first = render(&mut session, &view(2.5)).1.rays.indirect;
    let second = render(&mut session, &view(2.6)).1.rays.indirect;
    let again = render(&mut session, &view(2.5)).1.rays.indirect;
    assert!(second * 10 < first, "{second} of {first}");
    assert_eq!(again, 0);
}
