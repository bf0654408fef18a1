//! The penumbra of `sphere` is the one that analysis gives (method §13).

use glam::{Quat, Vec3};
use lightmesh::scene::Falloff;
use lightmesh::settings::{Estimator, KernelSettings, Leaks, Neighbourhood, Radius, Settings, Spacing};

use crate::common::{Builder, direct_illumination, grey, light, surface_point};

/// R; all other lengths follow.
const RADIUS: f32 = 1.0;
/// Height of the light above the receiver.
const HEIGHT: f32 = 10.0;

/// Visibility at the distances t·R from the hard edge, for an occluder at the share `a` of the way to the light.
fn profile(a: f32, ts: &[f32]) -> Vec<f32> {
    // An odd turn, so that the shadow's plane is no plane of the grid.
    let turn = Quat::from_axis_angle(Vec3::new(0.36, 0.48, 0.8), 0.83);
    let at = |x: f32, y: f32, z: f32| turn * Vec3::new(x, y, z);
    let mut builder = Builder::default();
    // The half-plane x < 0 under the light, which stands right above its edge.
    builder.quad(at(-40.0, a * HEIGHT, -20.0), turn * (Vec3::Z * 40.0), turn * (Vec3::X * 40.0), 0);
    builder.stretch_bounds(Vec3::splat(-3.0), Vec3::splat(3.0));
    let scene = builder.scene(vec![grey(1.0)], vec![light(at(0.0, HEIGHT, 0.0), Vec3::ONE)], Falloff::None);
    let mut settings = Settings::default();
    settings.mesh.direct.spacing = Spacing::Units(Vec3::splat(RADIUS / 16.0));
    settings.shading.estimator = Estimator::PerLight;
    settings.shading.kernel = KernelSettings {
        radius: Radius::Units(RADIUS),
        neighbourhood: Neighbourhood::Sphere,
        hemisphere: false,
        leaks: Leaks::Allow,
    };
    // No geometry at the receiver: it would cut the ball in half.
    let surfaces: Vec<_> =
        ts.iter().map(|&t| surface_point(at(t * RADIUS, 0.0, 0.0), turn * Vec3::Y)).collect();
    let illumination = direct_illumination(&scene, &settings, &surfaces);
    ts.iter()
        .zip(illumination)
        .map(|(&t, light)| {
            let cosine = HEIGHT / HEIGHT.hypot(t * RADIUS);
            light.x / cosine
        })
        .collect()
}

/// V(t) is the share of a ball on the lit side of a plane at distance t·R from its centre, (2 + 3t − t³)/4, wherever
/// the occluder is: light meshes know no contact hardening.
#[test]
fn the_penumbra_of_a_sphere_is_a_cubic_that_does_not_depend_on_the_occluder() {
    let ts: Vec<f32> = (-12..=12).map(|i| i as f32 / 10.0).collect();
    for a in [0.2, 0.5, 0.8] {
        for (&t, found) in ts.iter().zip(profile(a, &ts)) {
            let inside = t.clamp(-1.0, 1.0);
            let expected = (2.0 + 3.0 * inside - inside.powi(3)) / 4.0;
            assert!((found - expected).abs() <= 0.02, "a {a}, t {t}: {found}, expected {expected}");
        }
    }
}
