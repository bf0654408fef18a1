//! A picture depends on nothing but scene and settings: not on threads, blocks or timing, to the last bit.

use glam::Vec3;
use lightmesh::scene::LightKind;
use lightmesh::scene::load::LoadedScene;
use lightmesh::settings::{
    Estimator, IndirectForm, IndirectSettings, Integrator, Leaks, PointLayout, Resolve, Settings, Spacing,
};

use crate::common::failed::assert_same_bits;
use crate::common::{bits, forest, picture, settings_at};

fn scene() -> LoadedScene {
    let mut loaded = forest(3_000, 20);
    // Mirrors, so that there are paths of several points.
    loaded.scene.materials.iter_mut().for_each(|material| material.specular = Vec3::splat(0.3));
    // Lamps with a size, of both kinds.
    for light in loaded.scene.lights.iter_mut().step_by(3) {
        light.kind = LightKind::Ball { radius: 0.2 };
    }
    loaded.scene.add_rectangle(Vec3::Y * 7.0, Vec3::X * 2.0, Vec3::Z, Vec3::splat(3.0));
    loaded
}

/// The settings that take different ways through the renderer.
fn variants() -> Vec<(&'static str, Settings)> {
    // No multiple of the tile size, several blocks, several samples.
    let mut base = settings_at((75, 67));
    base.view.samples_per_pixel = 2;
    let variant = |name, change: &dyn Fn(&mut Settings)| {
        let mut settings = base.clone();
        settings.mesh.direct.spacing = Spacing::Units(Vec3::splat(0.5));
        change(&mut settings);
        (name, settings)
    };
    let indirect = || {
        let mut indirect = IndirectSettings { directions: 16, ..IndirectSettings::default() };
        indirect.points.spacing = Spacing::Units(Vec3::splat(2.0));
        Some(indirect)
    };
    vec![
        variant("conventional", &|s| s.shading.integrator = Integrator::Conventional),
        variant("per-light", &|_| {}),
        variant("directional", &|s| s.shading.estimator = Estimator::Directional),
        variant("invalidated points", &|s| s.shading.kernel.leaks = Leaks::Invalidate),
        variant("blue noise", &|s| s.mesh.direct.layout = PointLayout::BlueNoise { seed: 3 }),
        variant("levels", &|s| s.mesh.direct.levels = 2),
        variant("hybrid", &|s| s.shading.resolve = Resolve::Trace),
        variant("hybrid, emitters", &|s| (s.shading.resolve, s.shading.lambertian) = (Resolve::Trace, true)),
        variant("one bounce", &|s| s.mesh.indirect = indirect()),
        variant("three bounces", &|s| {
            s.mesh.indirect = indirect().map(|indirect| IndirectSettings { bounces: 3, ..indirect });
        }),
        variant("points on surfaces", &|s| {
            let form = IndirectForm::Surface;
            s.mesh.indirect = indirect().map(|indirect| IndirectSettings { bounces: 3, form, ..indirect });
        }),
    ]
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let loaded = scene();
    for (name, settings) in variants() {
        let pictures = [1, 2, 7].map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| picture(&loaded.scene, &loaded.cameras[0], &settings).0)
        });
        let [one, two, seven] = &pictures;
        assert_same_bits(two, one, format_args!("{name}, two threads"));
        assert_same_bits(seven, one, format_args!("{name}, seven threads"));
        assert!(bits(one).iter().any(|&bits| bits != 0), "{name}: all black");
    }
}

#[test]
fn the_block_size_changes_no_bit() {
    let loaded = scene();
    for (name, settings) in variants() {
        let (whole, _) = picture(&loaded.scene, &loaded.cameras[0], &settings);
        // One tile at a time, and a few tiles at a time.
        for pixels in [1, 5_000] {
            let mut settings = settings.clone();
            settings.view.block_samples = Some(pixels * 2);
            let (blocks, _) = picture(&loaded.scene, &loaded.cameras[0], &settings);
            assert_same_bits(&blocks, &whole, format_args!("{name}, blocks of {pixels} pixels"));
        }
    }
}
