//! Values outlive settings: whatever is changed in a session, only what was never evaluated costs rays (method §9).

use glam::Vec3;
use lightmesh::render::{RenderStats, Session, StopToken, Tile, TileSink};
use lightmesh::scene::Camera;
use lightmesh::scene::load::LoadedScene;
use lightmesh::settings::{
    Estimator, IndirectForm, IndirectSettings, Leaks, Neighbourhood, PointLayout, Radius, Resolve, Settings,
    Spacing,
};
use std::sync::Mutex;

use crate::common::{bits, forest, picture, session, settings_at};

const LIGHTS: u64 = 20;

fn loaded() -> LoadedScene {
    forest(1_500, LIGHTS as u32)
}

fn settings() -> Settings {
    let mut settings = settings_at((64, 48));
    settings.mesh.direct.spacing = Spacing::Units(Vec3::splat(0.8));
    settings.shading.kernel.radius = Radius::Spacings(2.5);
    // Nothing but mesh points asks for occlusion then.
    settings.shading.kernel.leaks = Leaks::Allow;
    settings
}

fn render(session: &mut Session, camera: &Camera, settings: &Settings) -> (Vec<u32>, RenderStats) {
    let (image, stats) = session.render(camera, settings).expect("an image");
    (bits(&image), stats)
}

/// A smaller radius needs a part of the known points; neighbourhood, estimator, hemisphere, and the intensity of a light need
/// the same. Each image is that of a session that knew nothing, to the bit.
#[test]
fn changed_settings_cost_no_rays_for_known_points() {
    let loaded = loaded();
    let camera = &loaded.cameras[0];
    let mut session = session(&loaded.scene);
    let base = settings();
    let (_, first) = render(&mut session, camera, &base);
    assert_eq!(first.rays.shadow, first.mesh_points.direct.evaluated * LIGHTS);

    type Change = fn(&mut Settings);
    let changes: [(&str, Change); 6] = [
        ("radius", |s| s.shading.kernel.radius = Radius::Spacings(1.5)),
        ("neighbourhood", |s| s.shading.kernel.neighbourhood = Neighbourhood::Sphere),
        ("ratio", |s| s.shading.estimator = Estimator::Ratio),
        ("directional", |s| s.shading.estimator = Estimator::Directional),
        ("paper", |s| s.shading.estimator = Estimator::Paper),
        ("per-light again", |_| {}),
    ];
    for (name, change) in changes {
        let mut settings = base.clone();
        change(&mut settings);
        let (image, stats) = render(&mut session, camera, &settings);
        assert_eq!((stats.rays.shadow, stats.mesh_points.direct.evaluated), (0, 0), "{name}");
        assert!(image == bits(&picture(&loaded.scene, camera, &settings).0), "{name}");
    }

    // A wider radius reaches points that were never evaluated, and those alone cost rays.
    let mut wider = base.clone();
    wider.shading.kernel.radius = Radius::Spacings(3.0);
    let (image, stats) = render(&mut session, camera, &wider);
    let points = stats.mesh_points.direct;
    assert!(points.evaluated > 0 && points.evaluated < points.needed / 2, "{points:?}");
    assert_eq!(stats.rays.shadow, points.evaluated * LIGHTS);
    assert!(image == bits(&picture(&loaded.scene, camera, &wider).0));

    // Switching a light costs no ray, for every estimator.
    assert!(session.set_intensity(3, Vec3::ZERO).expect("a light may be dark"));
    assert!(!session.set_intensity(LIGHTS as usize, Vec3::ONE).expect("there is no such light"));
    let mut switched = loaded.scene.clone();
    switched.lights[3].intensity = Vec3::ZERO;
    for estimator in [Estimator::PerLight, Estimator::Directional, Estimator::Ratio] {
        let mut settings = base.clone();
        settings.shading.estimator = estimator;
        let (image, stats) = render(&mut session, camera, &settings);
        assert_eq!(stats.rays.shadow, 0, "{estimator}");
        assert!(image == bits(&picture(&switched, camera, &settings).0), "{estimator}");
    }
}

/// Indirect light by patches follows from the scene alone: estimator and kernel of direct light, and with one bounce its own
/// radius, gather nothing again. In the paper's form hits are lit by the direct mesh, and other ways to read that are other light.
#[test]
fn gathered_light_outlives_what_it_does_not_follow_from() {
    let loaded = loaded();
    let camera = &loaded.cameras[0];
    type Change = fn(&mut Settings);
    let changes: [(&str, Change); 3] = [
        ("estimator", |s| s.shading.estimator = Estimator::Ratio),
        ("radius", |s| s.shading.kernel.radius = Radius::Spacings(2.0)),
        ("its own radius", |s| s.shading.indirect.kernel.radius = Radius::Spacings(1.2)),
    ];
    for form in [IndirectForm::Directional, IndirectForm::Scalar] {
        let mut base = settings();
        let mut indirect = IndirectSettings { form, directions: 32, ..IndirectSettings::default() };
        indirect.points.spacing = Spacing::Units(Vec3::splat(2.5));
        base.mesh.indirect = Some(indirect);
        base.shading.indirect.kernel.leaks = Leaks::Allow;
        let mut session = session(&loaded.scene);
        assert!(render(&mut session, camera, &base).1.rays.indirect > 0);
        for (name, change) in changes {
            let mut settings = base.clone();
            change(&mut settings);
            let (image, stats) = render(&mut session, camera, &settings);
            let kept = form == IndirectForm::Directional || name == "its own radius";
            assert_eq!(stats.rays.indirect == 0, kept, "{form:?}, {name}");
            assert!(image == bits(&picture(&loaded.scene, camera, &settings).0), "{form:?}, {name}");
            // Back to what the next change begins with.
            render(&mut session, camera, &base);
        }
    }
}

/// Leak rules and hybrid shadows trace rays from surface points, or look once around each point whether it lies inside of
/// geometry; no mesh point's visibility is traced again.
#[test]
fn leak_rules_and_hybrid_shadows_keep_what_is_known() {
    let loaded = loaded();
    let camera = &loaded.cameras[0];
    let mut session = session(&loaded.scene);
    let (_, first) = render(&mut session, camera, &settings());
    let known = first.mesh_points.direct.evaluated;
    for (leaks, resolve) in [
        (Leaks::Visibility, Resolve::Average),
        (Leaks::Invalidate, Resolve::Average),
        (Leaks::Invalidate, Resolve::Average),
        (Leaks::Allow, Resolve::Trace),
    ] {
        let mut settings = settings();
        settings.shading.kernel.leaks = leaks;
        settings.shading.resolve = resolve;
        let (image, stats) = render(&mut session, camera, &settings);
        assert_eq!(stats.mesh_points.direct.evaluated, 0, "{leaks}, {resolve}");
        assert!(image == bits(&picture(&loaded.scene, camera, &settings).0), "{leaks}, {resolve}");
        if leaks == Leaks::Invalidate {
            // 14 directions for each point, the first time that it matters, and none the second time.
            assert_eq!(stats.rays.shadow, 0);
            assert!([0, 14 * known].contains(&stats.rays.inside), "{}", stats.rays.inside);
        }
    }
}

/// At half the spacing one point in eight coincides with a coarse one, and takes over what that one knows: in regular and in
/// body-centred sets.
#[test]
fn half_the_spacing_keeps_the_coarse_values() {
    let loaded = loaded();
    let camera = &loaded.cameras[0];
    for layout in [PointLayout::Regular, PointLayout::BodyCentred] {
        let mut session = session(&loaded.scene);
        let mut settings = settings();
        settings.mesh.direct.layout = layout;
        // The same R for both, so that the same part of space is needed.
        settings.shading.kernel.radius = Radius::Units(2.0);
        let (_, coarse) = render(&mut session, camera, &settings);
        settings.mesh.direct.spacing = Spacing::Units(Vec3::splat(0.4));
        let (image, fine) = render(&mut session, camera, &settings);
        let (alone, from_nothing) = picture(&loaded.scene, camera, &settings);
        let (coarse, fine, all) =
            (coarse.mesh_points.direct, fine.mesh_points.direct, from_nothing.mesh_points.direct);
        // Every coarse point lies in the fine set, and in its neighbourhoods, which are the same.
        assert_eq!(all.evaluated - fine.evaluated, coarse.evaluated, "{:?}", settings.mesh.direct.layout);
        assert_eq!(fine.evaluated * LIGHTS + coarse.evaluated * LIGHTS, from_nothing.rays.shadow);
        assert!(image == bits(&alone), "{:?}", settings.mesh.direct.layout);
    }
}

/// A sink receives every tile once, with the pixels that the image has there.
#[test]
fn a_sink_receives_every_tile_once() {
    struct Tiles(Mutex<Vec<(Tile, Vec<[f32; 3]>)>>);
    impl TileSink for Tiles {
        fn tile(&self, tile: &Tile, pixels: &[[f32; 3]]) {
            self.0.lock().unwrap().push((*tile, pixels.to_vec()));
        }
    }
    let loaded = loaded();
    let mut settings = settings();
    settings.view.resolution = (70, 45);
    settings.view.samples_per_pixel = 3;
    settings.view.block_samples = Some(5_000);
    let tiles = Tiles(Mutex::default());
    let mut session = session(&loaded.scene);
    let (image, _) = session.render_to(&loaded.cameras[0], &settings, &tiles, &StopToken::default()).unwrap();
    let mut seen = vec![0; 70 * 45];
    for (tile, pixels) in tiles.0.into_inner().unwrap() {
        for (index, pixel) in (0..).zip(&pixels) {
            let (x, y) = (tile.x + index % tile.width, tile.y + index / tile.width);
            assert_eq!(image.get(x, y), Some(*pixel));
            seen[(y * 70 + x) as usize] += 1;
        }
    }
    assert!(seen.iter().all(|&count| count == 1));
}

/// A stopped render ends with an error, after the tiles that were under way; what its mesh points learned stays known.
#[test]
fn a_token_stops_a_render_between_tiles() {
    struct StopAtFirst(StopToken, Mutex<u32>);
    impl TileSink for StopAtFirst {
        fn tile(&self, _: &Tile, _: &[[f32; 3]]) {
            self.0.stop();
            *self.1.lock().unwrap() += 1;
        }
    }
    let loaded = loaded();
    let mut settings = settings();
    settings.view.resolution = (320, 320);
    let stop = StopToken::default();
    let sink = StopAtFirst(stop.clone(), Mutex::default());
    let mut session = session(&loaded.scene);
    let rendered = session.render_to(&loaded.cameras[0], &settings, &sink, &stop);
    assert_eq!(rendered.unwrap_err().to_string(), "the render was stopped");
    // Each thread may finish the tile that it is at.
    let tiles = sink.1.into_inner().unwrap();
    assert!(tiles >= 1 && tiles as usize <= rayon::current_num_threads(), "{tiles}");
    let (_, stats) = render(&mut session, &loaded.cameras[0], &settings);
    assert_eq!(stats.rays.shadow, 0);
}

/// What can't be rendered is an error, not a panic.
#[test]
fn impossible_views_are_refused() {
    let loaded = loaded();
    let mut session = session(&loaded.scene);
    let mut none = settings();
    none.view.samples_per_pixel = 0;
    let refused = |result: Result<_, lightmesh::render::RenderError>| {
        result.map(|(_, _): (_, RenderStats)| ()).unwrap_err().to_string()
    };
    assert!(refused(session.render(&loaded.cameras[0], &none)).contains("samples_per_pixel"));
    let blind = Camera { look_at: loaded.cameras[0].position, ..loaded.cameras[0].clone() };
    assert!(refused(session.render(&blind, &settings())).contains("look_at"));
    let mut fine = settings();
    fine.mesh.direct.spacing = Spacing::Units(Vec3::splat(1e-9));
    assert!(refused(session.render(&loaded.cameras[0], &fine)).contains("too fine"));
    let mut fine = settings();
    let mut indirect = IndirectSettings { form: IndirectForm::Surface, ..IndirectSettings::default() };
    indirect.points.spacing = Spacing::Units(Vec3::splat(1e-4));
    fine.mesh.indirect = Some(indirect);
    assert!(refused(session.render(&loaded.cameras[0], &fine)).contains("too fine"));
    assert!(session.set_intensity(0, Vec3::splat(-1.0)).is_err());
    assert!(session.render(&loaded.cameras[0], &settings()).is_ok(), "the session still works");
}
