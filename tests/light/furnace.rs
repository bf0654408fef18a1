//! A closed white furnace settles at e/(1 − ρ) everywhere (method §5).

use glam::Vec3;
use lightmesh::scene::{Falloff, Material};
use lightmesh::settings::{IndirectForm, IndirectSettings, Integrator, Normalization, Spacing};

use crate::common::{Builder, camera, grey, light, picture, settings_at};

/// The pixels of a picture inside of a closed box whose walls all emit `emission` and reflect `albedo`.
fn furnace(
    emission: f32,
    albedo: f32,
    indirect: IndirectSettings,
    normalization: Normalization,
) -> Vec<[f32; 3]> {
    let mut builder = Builder::default();
    builder.cuboid(Vec3::new(-1.0, -1.0, -1.0), Vec3::new(1.0, 1.5, 1.2), true, 0);
    let walls =
        Material { diffuse: Vec3::splat(albedo), emission: Vec3::splat(emission), ..Material::default() };
    let scene = builder.scene(vec![walls], Vec::new(), Falloff::default());
    let mut settings = settings_at((24, 24));
    settings.mesh.indirect = Some(indirect);
    settings.shading.indirect.normalization = normalization;
    let camera = camera(Vec3::new(0.1, 0.2, 0.9), Vec3::new(-0.2, -0.3, -1.0), 90.0);
    picture(&scene, &camera, &settings).0.pixels().to_vec()
}

/// 256 directions integrate a cosine to within about 0.3 %, which the bounces of albedo 0.8 make five times as much: 512 leave
/// room below the per cent.
fn indirect(form: IndirectForm) -> IndirectSettings {
    let mut indirect = IndirectSettings {
        directions: 512,
        bounces: 200,
        tolerance: 1e-4,
        form,
        ..IndirectSettings::default()
    };
    indirect.points.spacing = Spacing::Units(Vec3::splat(0.6));
    indirect
}

fn assert_all_within_one_percent(pixels: &[[f32; 3]], expected: f32, what: &str) {
    for (index, pixel) in pixels.iter().enumerate() {
        for value in pixel {
            assert!(
                (value - expected).abs() <= 0.01 * expected,
                "{what}: pixel {index} is {value}, expected {expected}"
            );
        }
    }
}

/// Radiance is the same in every direction and the geometric series of the bounces is its value.
#[test]
fn a_furnace_settles_at_the_sum_of_all_bounces() {
    for albedo in [0.2, 0.5, 0.8] {
        for form in [IndirectForm::Scalar, IndirectForm::Directional, IndirectForm::Surface] {
            let pixels = furnace(0.7, albedo, indirect(form), Normalization::Mean);
            assert_all_within_one_percent(
                &pixels,
                0.7 / (1.0 - albedo),
                &format!("albedo {albedo}, {form:?}"),
            );
        }
    }
}

/// One bounce is the paper's: what surfaces emit, and that reflected once.
#[test]
fn one_bounce_of_a_furnace_is_the_first_reflection_alone() {
    for form in [IndirectForm::Scalar, IndirectForm::Directional, IndirectForm::Surface] {
        let once = IndirectSettings { bounces: 1, ..indirect(form) };
        let pixels = furnace(0.7, 0.5, once, Normalization::Mean);
        assert_all_within_one_percent(&pixels, 0.7 * 1.5, &format!("{form:?}"));
    }
}

/// Eq. (4) as printed integrates over the sphere, where the mean divides by its area: 4π times as much.
#[test]
fn the_integral_is_four_pi_times_the_mean() {
    let once = IndirectSettings { bounces: 1, ..indirect(IndirectForm::Scalar) };
    let pixels = furnace(0.7, 0.5, once, Normalization::Integral);
    let expected = 0.7 * (1.0 + 0.5 * 4.0 * std::f32::consts::PI);
    assert_all_within_one_percent(&pixels, expected, "integral");
}

/// A second floor close above a room's own hides that, so that the room is one whose floor lies as high, however thin the gap is. If the hidden
/// floor passed for what is seen, all of its darkness would, and a room of albedo 0.8 would lack a quarter of its light.
#[test]
fn what_lies_under_a_second_floor_darkens_no_room() {
    let mean = |floors: &[f32]| {
        let mut builder = Builder::default();
        builder.cuboid(Vec3::new(-1.0, floors[0], -1.0), Vec3::new(1.0, 1.5, 1.2), true, 0);
        for &height in &floors[1..] {
            builder.quad(Vec3::new(-1.0, height, -1.0), Vec3::Z * 2.2, Vec3::X * 2.0, 0);
        }
        let lamp = light(Vec3::new(0.1, 0.4, 0.0), Vec3::ONE);
        let scene = builder.scene(vec![grey(0.8)], vec![lamp], Falloff::InverseSquare);
        let mut settings = settings_at((24, 24));
        settings.shading.integrator = Integrator::Conventional;
        settings.mesh.indirect = Some(indirect(IndirectForm::Surface));
        let camera = camera(Vec3::new(0.1, 0.2, 0.9), Vec3::new(-0.2, -0.3, -1.0), 90.0);
        let image = picture(&scene, &camera, &settings).0;
        image.pixels().as_flattened().iter().sum::<f32>() / (3 * image.pixels().len()) as f32
    };
    let plain = mean(&[-1.0]);
    for gap in [0.004, 0.02, 0.1] {
        let found = mean(&[-1.0 - gap, -1.0]);
        assert!((found / plain - 1.0).abs() < 0.02, "{found} for {plain}, {gap} above");
    }
}
