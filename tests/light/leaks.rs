//! No light through walls: a dark room beside a bright one stays dark (method §3, §8).

use glam::Vec3;
use lightmesh::scene::{Camera, Falloff, Scene};
use lightmesh::settings::{Estimator, IndirectForm, IndirectSettings, Leaks, Settings, Spacing};

use crate::common::{Builder, camera, grey, light, mean, picture};

/// Spacing of the mesh points; the wall between the rooms is a quarter of it thick.
const SPACING: f32 = 0.4;
const WALL: f32 = SPACING / 4.0;

/// Two closed rooms with a wall between them, a lamp in the left one; a view into each.
fn rooms() -> (Scene, [Camera; 2]) {
    let mut builder = Builder::default();
    builder.cuboid(Vec3::ZERO, Vec3::new(8.0 + WALL, 3.0, 4.0), true, 0);
    builder.cuboid(Vec3::new(4.0, 0.0, 0.0), Vec3::new(4.0 + WALL, 3.0, 4.0), false, 0);
    let lamp = light(Vec3::new(2.0, 2.0, 2.0), Vec3::splat(10.0));
    let scene = builder.scene(vec![grey(0.7)], vec![lamp], Falloff::InverseSquare);
    // Towards the foot of the common wall, where a leak would show first.
    let bright = camera(Vec3::new(2.6, 1.2, 2.0), Vec3::new(3.8, 0.0, 2.0), 50.0);
    let dark = camera(Vec3::new(5.4 + WALL, 1.2, 2.0), Vec3::new(4.2 + WALL, 0.0, 2.0), 50.0);
    (scene, [bright, dark])
}

/// Mean of the dark room over that of the bright one.
fn leaked(settings: &Settings) -> f64 {
    let (scene, [bright, dark]) = rooms();
    let mut settings = settings.clone();
    settings.view.resolution = (64, 48);
    let [bright, dark] = [bright, dark].map(|camera| mean(&picture(&scene, &camera, &settings).0));
    assert!(bright > 0.05, "the bright room is dark: {bright}");
    dark / bright
}

const SPACED: Spacing = Spacing::Units(Vec3::splat(SPACING));

#[test]
fn a_thin_wall_keeps_a_dark_room_dark_with_the_default_settings() {
    for estimator in [Estimator::PerLight, Estimator::Ratio, Estimator::Directional] {
        let mut settings = Settings::default();
        settings.mesh.direct.spacing = SPACED;
        settings.shading.estimator = estimator;
        let share = leaked(&settings);
        assert!(share < 0.01, "{estimator:?}: {share}");
    }
}

#[test]
fn a_thin_wall_keeps_indirect_light_out() {
    for form in [IndirectForm::Scalar, IndirectForm::Directional, IndirectForm::Surface] {
        for bounces in [1, 4] {
            let mut settings = Settings::default();
            settings.mesh.direct.spacing = SPACED;
            let mut indirect =
                IndirectSettings { form, bounces, directions: 64, ..IndirectSettings::default() };
            indirect.points.spacing = SPACED;
            settings.mesh.indirect = Some(indirect);
            let share = leaked(&settings);
            assert!(share < 0.01, "{form:?}, {bounces} bounces: {share}");
        }
    }
}

/// Without the guard light does leak: the tests above look where it would.
#[test]
fn without_the_guard_the_wall_leaks() {
    let mut settings = Settings::default();
    settings.mesh.direct.spacing = SPACED;
    settings.shading.kernel.leaks = Leaks::Allow;
    let share = leaked(&settings);
    assert!(share > 0.01, "{share}");
}
