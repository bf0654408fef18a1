//! The estimators compute the formulas that they are named after: eqs. (1), (2), (3) and method §4, on numbers worked
//! out by hand.

use std::sync::Arc;

use glam::Vec3;
use lightmesh::scene::{Falloff, Scene};
use lightmesh::settings::{
    Estimator, KernelSettings, Leaks, Neighbourhood, PointLayout, Radius, Settings, Spacing,
};

use crate::common::failed::assert_images;
use crate::common::{
    Builder, conventional, direct_illumination, forest, grey, light, mean, picture, relative_rmse,
    settings_at, surface_point,
};

const ALL: [Estimator; 4] = [Estimator::Paper, Estimator::Ratio, Estimator::PerLight, Estimator::Directional];

/// Two lights above the origin. A plate hides light B, at (3, 4, 0), from the mesh point (1, 0, 0), and from that alone.
fn two_lights() -> Scene {
    let mut builder = Builder::default();
    builder.quad(Vec3::new(1.9, 2.0, -0.1), Vec3::Z * 0.2, Vec3::X * 0.2, 0);
    let lights = vec![
        light(Vec3::new(0.0, 4.0, 0.0), Vec3::new(10.0, 20.0, 30.0)),
        light(Vec3::new(3.0, 4.0, 0.0), Vec3::new(6.0, 3.0, 12.0)),
    ];
    builder.scene(vec![grey(1.0)], lights, Falloff::Linear { constant: 1.0 })
}

/// The mesh points of the hand-worked examples: (0, 0, 0) sees both lights, (1, 0, 0) only A.
fn two_points(estimator: Estimator) -> Settings {
    let mut settings = Settings::default();
    settings.mesh.direct.layout = PointLayout::List(Arc::new(vec![Vec3::ZERO, Vec3::X]));
    settings.shading.estimator = estimator;
    settings.shading.kernel = KernelSettings {
        radius: Radius::Units(2.0),
        neighbourhood: Neighbourhood::Sphere,
        hemisphere: false,
        leaks: Leaks::Allow,
    };
    settings
}

fn assert_close(found: Vec3, expected: Vec3) {
    assert!(found.abs_diff_eq(expected, 1e-4 * expected.max_element()), "{found}, expected {expected}");
}

const A: Vec3 = Vec3::new(10.0, 20.0, 30.0);
const B: Vec3 = Vec3::new(6.0, 3.0, 12.0);

/// From (0, 0, 0), A is 4 away and B 5; from (1, 0, 0), A is √17 away and B √20, behind the plate. φ1(t) = 1 + t.
/// DirectLight there is A/5 + B/6 and A/(1 + √17): eq. (1).
fn direct_light() -> [Vec3; 2] {
    [A / 5.0 + B / 6.0, A / (1.0 + 17f32.sqrt())]
}

/// S(y) at y = (0, 0, 0) with the normal +y: A/5 · 1 + B/6 · 4/5.
fn s() -> Vec3 {
    A / 5.0 + B / 6.0 * 0.8
}

fn at_origin(settings: &Settings) -> Vec3 {
    direct_illumination(&two_lights(), settings, &[surface_point(Vec3::ZERO, Vec3::Y)])[0]
}

/// Eq. (3) is the plain mean over D_y, and eq. (2) multiplies it by S(y).
#[test]
fn paper_is_the_mean_of_direct_light_times_the_unshadowed_sum() {
    let [first, second] = direct_light();
    assert_close(at_origin(&two_points(Estimator::Paper)), (first + second) / 2.0 * s());
}

/// With `nearest`, D_y is the one nearest point: its DirectLight stands alone.
#[test]
fn nearest_takes_the_value_of_one_point() {
    for (y, index) in [(Vec3::X * 0.4, 0), (Vec3::X * 0.6, 1)] {
        let mut settings = two_points(Estimator::Paper);
        settings.shading.kernel.neighbourhood = Neighbourhood::Nearest;
        let found = direct_illumination(&two_lights(), &settings, &[surface_point(y, Vec3::Y)])[0];
        let s = [(A, Vec3::new(0.0, 4.0, 0.0)), (B, Vec3::new(3.0, 4.0, 0.0))]
            .map(|(intensity, position)| {
                let d = position - y;
                intensity * (d.normalize().y / (1.0 + d.length()))
            })
            .iter()
            .sum::<Vec3>();
        assert_close(found, direct_light()[index] * s);
    }
}

/// `ratio` divides the mean of DirectLight by the mean that it would be without occluders.
#[test]
fn ratio_is_the_share_of_light_that_arrives() {
    let [first, second] = direct_light();
    let unoccluded = first + second + B / (1.0 + 20f32.sqrt());
    assert_close(at_origin(&two_points(Estimator::Ratio)), (first + second) / unoccluded * s());
}

/// `per-light` weighs each light with the share of D_y that sees it: all for A, half for B.
#[test]
fn per_light_weighs_every_light_with_its_own_visibility() {
    assert_close(at_origin(&two_points(Estimator::PerLight)), A / 5.0 + B / 6.0 * 0.8 * 0.5);
}

/// `directional` is the mean over D_y of Σ V E/φ1 · (1/4 + cos/2 + 5/32·(3cos² − 1)), the second-order cosine.
#[test]
fn directional_is_the_second_order_irradiance_of_the_normal() {
    let lobe = |cosine: f32| 0.25 + 0.5 * cosine + 5.0 / 32.0 * (3.0 * cosine * cosine - 1.0);
    let first = A / 5.0 * lobe(1.0) + B / 6.0 * lobe(0.8);
    let second = A / (1.0 + 17f32.sqrt()) * lobe(4.0 / 17f32.sqrt());
    assert_close(at_origin(&two_points(Estimator::Directional)), (first + second) / 2.0);
}

/// Eq. (2) multiplies two sums that both carry E: doubled lights make it four times as bright, and everything else twice.
#[test]
fn doubling_the_lights_quadruples_paper_and_doubles_the_others() {
    let mut loaded = forest(3_000, 20);
    loaded.scene.background = Vec3::ZERO;
    let mut brighter = loaded.scene.clone();
    brighter.lights.iter_mut().for_each(|light| light.intensity *= 2.0);
    let mut settings = settings_at((64, 64));
    for estimator in ALL {
        settings.shading.estimator = estimator;
        let (before, _) = picture(&loaded.scene, &loaded.cameras[0], &settings);
        let (after, _) = picture(&brighter, &loaded.cameras[0], &settings);
        let factor = if estimator == Estimator::Paper { 4.0 } else { 2.0 };
        // Powers of two pass through every sum and product without rounding.
        for (before, after) in before.pixels().iter().flatten().zip(after.pixels().iter().flatten()) {
            assert!((after - factor * before).abs() <= 1e-5 * after.abs(), "{estimator:?}");
        }
        assert!(mean(&before) > 0.0, "{estimator:?}");
    }
    let (before, _) = conventional(&loaded.scene, &loaded.cameras[0], &settings);
    let (after, _) = conventional(&brighter, &loaded.cameras[0], &settings);
    assert!((mean(&after) / mean(&before) - 2.0).abs() < 1e-5);
}

/// Second-order irradiance over the same mesh points is a good stand-in for the lights one by one.
#[test]
fn directional_is_close_to_per_light_on_the_forest() {
    let loaded = forest(23_542, 100);
    let mut settings = settings_at((200, 200));
    settings.mesh.direct.spacing = Spacing::Units(Vec3::splat(0.2));
    let (per_light, _) = picture(&loaded.scene, &loaded.cameras[0], &settings);
    settings.shading.estimator = Estimator::Directional;
    let (directional, _) = picture(&loaded.scene, &loaded.cameras[0], &settings);
    let difference = relative_rmse(&directional, &per_light);
    let problem = format_args!("RMSE {difference} of the mean");
    assert_images(difference <= 0.03, &directional, &per_light, problem);
}
