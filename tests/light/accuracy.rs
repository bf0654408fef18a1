//! How wrong a picture is, by what the renderer says of itself (method §10): against pictures that are made without a light mesh, it tells the truth.

use std::time::Duration;

use glam::Vec3;
use lightmesh::image::Image;
use lightmesh::image::metrics::{MetricsOptions, compare};
use lightmesh::render::{
    Ending, Measure, Reason, RenderError, RenderStats, Session, StopToken, Tile, TileSink,
};
use lightmesh::scene::Camera;
use lightmesh::scene::load::LoadedScene;
use lightmesh::settings::{
    Estimator, IndirectSettings, Integrator, Leaks, Limits, Neighbourhood, Radius, Resolve, Settings,
    Spacing, Step, Steps,
};
use std::sync::Mutex;

use crate::common::{bits, forest, picture, session, settings_at};

fn scene() -> LoadedScene {
    forest(3_000, 20)
}

/// Averaged shadows; the spacing is left open.
fn settings(max_error: f32) -> Settings {
    let mut settings = settings_at((64, 48));
    settings.shading.integrator = Integrator::LightMesh;
    settings.shading.kernel.leaks = Leaks::Allow;
    settings.limits.max_error = Some(max_error);
    settings
}

fn rendered(scene: &LoadedScene, settings: &Settings) -> (Image, RenderStats) {
    picture(&scene.scene, &scene.cameras[0], settings)
}

/// What is wrong with a picture, by the integrator that needs no light mesh.
fn true_error(scene: &LoadedScene, image: &Image, settings: &Settings) -> f32 {
    let mut settings = settings.clone();
    settings.shading.integrator = Integrator::Reference;
    settings.shading.reference_samples = 256;
    settings.limits = Limits::default();
    let (reference, _) = rendered(scene, &settings);
    let metrics = compare(image, &reference, MetricsOptions::default()).expect("one size");
    metrics.relative_rmse.expect("the forest is lit") as f32
}

/// A mesh of another place, as dense, says how far a mesh is from the mean over D_y: at three spacings between R and R/3 the true error lies within
/// twice the interval that is given, which is one of 95 % and rests on a few dozen pixels.
#[test]
fn the_error_that_is_said_is_the_true_one() {
    let scene = scene();
    for spacing in [1.2, 0.8, 0.4] {
        let mut settings = settings(1e-6);
        settings.mesh.direct.spacing = Spacing::Units(Vec3::splat(spacing));
        settings.shading.kernel.radius = Radius::Units(1.2);
        let (image, stats) = rendered(&scene, &settings);
        let accuracy = stats.accuracy.expect("measured");
        let found = accuracy.found.expect("per-light is measured");
        let truth = true_error(&scene, &image, &settings);
        assert!(
            (found.error - truth).abs() <= 2.0 * found.confidence,
            "spacing {spacing}: {truth} is the truth, found {found:?}"
        );
        assert!(found.confidence < 0.8 * found.error, "spacing {spacing}: {found:?} says nothing");
        assert_eq!((accuracy.ending, found.measure), (Ending::Settings, Measure::Rmse));
    }
}

/// Whoever asks for an error has light interpolated between the pixels of one plane, by both estimators that are measured: that adds less than a sixteenth of the
/// error to the picture, whose other errors are the mesh's, and nothing to one without a limit.
#[test]
fn between_pixels_less_is_wrong_than_was_asked_for() {
    let scene = scene();
    for estimator in [Estimator::PerLight, Estimator::Directional] {
        let mut settings = settings(0.1);
        settings.view.resolution = (160, 120);
        settings.shading.estimator = estimator;
        settings.mesh.direct.spacing = Spacing::Units(Vec3::splat(1.6));
        settings.shading.kernel.radius = Radius::Units(2.4);
        let (image, _) = rendered(&scene, &settings);
        settings.limits.max_error = None;
        let (exact, _) = rendered(&scene, &settings);
        let metrics = compare(&image, &exact, MetricsOptions::default()).expect("one size");
        let added = metrics.relative_rmse.expect("the forest is lit");
        assert!(added > 0.0 && added < 0.1 / 16.0, "{estimator}: {added}");
        settings.limits.max_error = Some(0.0);
        assert_eq!(bits(&rendered(&scene, &settings).0), bits(&exact));
    }
}

/// Views that settle together have images of their own, whichever of them are rendered and in which order; who settles no longer is alone again.
#[test]
fn views_that_settle_together_do_not_depend_on_each_other() {
    let scene = scene();
    let settings = settings(0.05);
    let far = scene.cameras[0].clone();
    let near = Camera { position: far.position.lerp(far.look_at, 0.6), ..far.clone() };
    let image = |session: &mut Session, camera: &Camera| {
        let (image, stats) = session.render(camera, &settings).expect("an image");
        let accuracy = stats.accuracy.expect("measured");
        assert!(matches!(accuracy.ending, Ending::Error | Ending::Settled), "{accuracy:?}");
        bits(&image)
    };
    let settled = || {
        let mut session = session(&scene.scene);
        let never = StopToken::default();
        for camera in [&far, &near] {
            session.settle(camera, &settings, &never).expect("something to choose");
        }
        session
    };
    let mut both = settled();
    let together = [&far, &near].map(|camera| image(&mut both, camera));
    assert!(image(&mut settled(), &near) == together[1] && image(&mut settled(), &far) == together[0]);
    let alone = [&far, &near].map(|camera| image(&mut session(&scene.scene), camera));
    assert!(alone != together, "one of the views needs another mesh than both together");
    both.unsettle();
    assert!([&far, &near].map(|camera| image(&mut both, camera)) == alone);
}

/// Whoever asks for less error gets it, for more rays, with the same R: all pictures are of the same softness, that of a render without a limit.
#[test]
fn the_error_that_is_asked_for_is_kept() {
    let scene = scene();
    let mut before = 0;
    for asked in [0.1, 0.05, 0.02] {
        let settings = settings(asked);
        let (image, stats) = rendered(&scene, &settings);
        let accuracy = stats.accuracy.expect("measured");
        let found = accuracy.found.expect("per-light is measured");
        assert_eq!(accuracy.ending, Ending::Error);
        assert!(found.error <= asked, "{found:?}");
        let truth = true_error(&scene, &image, &settings);
        assert!(truth <= 1.2 * asked, "asked for {asked}, truth is {truth}");
        assert!(stats.rays.shadow > before, "{asked}: {} rays", stats.rays.shadow);
        before = stats.rays.shadow;
    }
}

/// Where lights are many and the estimator is left open, the one whose cost doesn't depend on them takes over, if it is good enough by the measure of the
/// other; who names an estimator gets it.
#[test]
fn an_open_estimator_is_chosen_by_its_error() {
    let scene = forest(3_000, 48);
    let mut settings = settings(0.2);
    let (per_light, _) = rendered(&scene, &settings);
    settings.limits.estimator_open = true;
    let (image, stats) = rendered(&scene, &settings);
    assert!(bits(&image) != bits(&per_light), "another estimator is another picture");
    assert_eq!(stats.accuracy.map(|accuracy| accuracy.ending), Some(Ending::Error));
    let truth = true_error(&scene, &image, &settings);
    assert!(truth <= 1.2 * 0.2, "{truth}");
}

/// What is tried is part of the mesh: a second render knows it all, and is the same to the bit. So is one that knew nothing, on other blocks.
#[test]
fn a_chosen_mesh_is_kept_and_depends_on_nothing_else() {
    let scene = scene();
    let settings = settings(0.05);
    let mut session = session(&scene.scene);
    let (first, _) = session.render(&scene.cameras[0], &settings).expect("an image");
    let (second, stats) = session.render(&scene.cameras[0], &settings).expect("an image");
    assert_eq!((stats.rays.shadow, stats.mesh_points.direct.evaluated), (0, 0));
    let mut blocks = settings;
    blocks.view.block_samples = Some(1);
    let (other, _) = rendered(&scene, &blocks);
    assert!(bits(&first) == bits(&second) && bits(&first) == bits(&other));
}

/// Which triangles are among the lights depends on the settings: what a session knows of other lights is nothing that a mesh could be chosen by.
#[test]
fn a_mesh_is_chosen_by_the_lights_that_it_is_for() {
    let mut scene = scene();
    scene.scene.add_rectangle(Vec3::Y * 7.0, Vec3::X * 2.0, Vec3::Z, Vec3::splat(3.0));
    let mut session = session(&scene.scene);
    let mut settings = settings(0.1);
    session.render(&scene.cameras[0], &settings).expect("an image");
    settings.shading.lambertian = true;
    let (image, _) = session.render(&scene.cameras[0], &settings).expect("an image");
    assert!(bits(&image) == bits(&rendered(&scene, &settings).0));
}

/// Traced shadows that take everything on trust are wrong; that is found, and they are made again until they are as good as asked for.
#[test]
fn traced_shadows_that_are_wrong_are_made_again() {
    let scene = scene();
    let mut settings = settings(0.0);
    settings.shading.integrator = Integrator::LightMesh;
    settings.shading.resolve = Resolve::Trace;
    settings.shading.tolerance = 100.0;
    settings.mesh.direct.spacing = Spacing::Units(Vec3::splat(1.5));
    let (careless, _) = rendered(&scene, &settings);
    let mut exact = settings.clone();
    exact.shading.integrator = Integrator::Conventional;
    let (exact, _) = rendered(&scene, &exact);
    let wrong = |image: &Image| {
        let pairs = || image.pixels().iter().flatten().zip(exact.pixels().iter().flatten());
        pairs().map(|(a, b)| (a - b).abs()).sum::<f32>() / pairs().map(|(_, b)| b).sum::<f32>()
    };
    settings.limits.max_error = Some(0.02);
    assert!(wrong(&careless) > 0.04, "the test shows nothing: {}", wrong(&careless));

    settings.shading.integrator = Integrator::Auto;
    let (image, stats) = rendered(&scene, &settings);
    let accuracy = stats.accuracy.expect("measured");
    assert!(matches!(accuracy.ending, Ending::Error | Ending::Exact), "{accuracy:?}");
    assert!(wrong(&image) <= 1.2 * 0.02, "{}: {accuracy:?}", wrong(&image));
}

/// Conventional shadows have no error to be measured.
#[test]
fn what_is_traced_in_full_is_exact() {
    let mut settings = settings(0.05);
    settings.shading.integrator = Integrator::Conventional;
    let accuracy = rendered(&scene(), &settings).1.accuracy.expect("asked for");
    assert_eq!((accuracy.ending, accuracy.found), (Ending::Exact, None));
}

/// Counts whole pictures and their tiles' pixels.
#[derive(Default)]
struct Watch(Mutex<(Vec<Vec<u32>>, usize)>);

impl TileSink for Watch {
    fn tile(&self, _: &Tile, pixels: &[[f32; 3]]) {
        self.0.lock().unwrap().1 += pixels.len();
    }

    fn picture(&self, image: &Image) {
        self.0.lock().unwrap().0.push(bits(image));
    }
}

/// Steps are whole pictures, the last one is that of a render in one step.
#[test]
fn steps_end_with_the_picture_of_one_step() {
    let scene = scene();
    let mut settings = settings(0.05);
    let (alone, _) = rendered(&scene, &settings);
    settings.limits.steps = Steps::Count(3);
    let watch = Watch::default();
    let mut session = session(&scene.scene);
    let (image, stats) =
        session.render_to(&scene.cameras[0], &settings, &watch, &StopToken::default()).expect("an image");
    let (pictures, pixels) = watch.0.into_inner().unwrap();
    assert_eq!((pictures.len(), pixels), (3, 3 * 64 * 48));
    assert!(pictures[2] == bits(&image) && bits(&image) == bits(&alone));
    assert!(pictures[0] != pictures[1] && pictures[1] != pictures[2]);
    assert_eq!(stats.rays.camera, 3 * 64 * 48);
}

/// A listed step is the picture that a render by its lengths would make, without shadow edges and without light from surfaces; what it leaves out is as in the
/// settings, and the last picture is theirs.
#[test]
fn listed_steps_are_the_pictures_that_they_describe() {
    let scene = scene();
    let mut settings = settings_at((64, 48));
    settings.shading.integrator = Integrator::LightMesh;
    settings.shading.resolve = Resolve::Trace;
    settings.shading.kernel.radius = Radius::Spacings(2.0);
    settings.mesh.indirect = Some(IndirectSettings { directions: 8, ..IndirectSettings::default() });
    let (alone, _) = rendered(&scene, &settings);
    let step = |spacing: f32, radius, neighbourhood| Step {
        spacing: Some(Vec3::splat(spacing)),
        radius,
        neighbourhood,
    };
    let list = vec![
        step(2.0, None, Some(Neighbourhood::Nearest)),
        step(1.0, None, None),
        step(1.0, Some(1.25), None),
    ];
    let expected = list.iter().map(|step| {
        let mut settings = settings.clone();
        settings.mesh.indirect = None;
        settings.shading.resolve = Resolve::Average;
        settings.shading.kernel.leaks = Leaks::Allow;
        settings.mesh.direct.spacing = Spacing::Units(step.spacing.unwrap());
        settings.shading.kernel.radius = step.radius.map_or(Radius::Spacings(2.0), Radius::Units);
        settings.shading.kernel.neighbourhood = step.neighbourhood.unwrap_or(Neighbourhood::SmoothSphere);
        bits(&rendered(&scene, &settings).0)
    });
    let expected: Vec<Vec<u32>> = expected.chain([bits(&alone)]).collect();
    settings.limits.steps = Steps::List(list.clone());
    let watch = Watch::default();
    let (image, _) = session(&scene.scene)
        .render_to(&scene.cameras[0], &settings, &watch, &StopToken::default())
        .expect("an image");
    let (pictures, _) = watch.0.into_inner().unwrap();
    assert!(pictures == expected && bits(&image) == bits(&alone));
}

/// Who has no time gets the first picture, whole, and is told so.
#[test]
fn time_ends_a_render_with_a_whole_picture() {
    let scene = scene();
    let mut settings = settings(0.02);
    settings.limits.time = Some(Duration::from_nanos(1));
    let (image, stats) = rendered(&scene, &settings);
    let accuracy = stats.accuracy.expect("asked for");
    assert_eq!((accuracy.ending, accuracy.found), (Ending::Time, None));
    settings.limits = Limits::default();
    settings.shading.kernel.neighbourhood = Neighbourhood::Nearest;
    let (fine, _) = rendered(&scene, &settings);
    let ratio = |image: &Image| image.pixels().iter().flatten().sum::<f32>();
    assert!((ratio(&image) / ratio(&fine) - 1.0).abs() < 0.2, "a rough picture of the same scene");
}

/// What a limit on memory leaves room for is taken: light meshes stay within it, the picture is as good as that allows and says so, and neither threads nor
/// blocks show. A limit that is not reached changes nothing.
#[test]
fn memory_ends_a_render_with_the_finest_mesh_that_fits() {
    let scene = scene();
    let mut settings = settings(0.01);
    let (free, stats) = rendered(&scene, &settings);
    let wanted = stats.light_mesh_bytes;
    let mut errors = Vec::new();
    let mut endings = Vec::new();
    for share in [0.4, 0.6, 0.8, 2.0] {
        settings.limits.memory = Some((share * wanted as f64) as u64);
        let (image, stats) = rendered(&scene, &settings);
        assert!(Some(stats.light_mesh_bytes) <= settings.limits.memory, "{share}: {stats:?}");
        let accuracy = stats.accuracy.expect("measured");
        errors.push(true_error(&scene, &image, &settings));
        endings.push(accuracy.ending);
        let mut blocks = settings.clone();
        blocks.view.block_samples = Some(1);
        let threads = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
        let (other, counted) = threads.install(|| rendered(&scene, &blocks));
        assert!(
            bits(&image) == bits(&other) && counted.light_mesh_bytes == stats.light_mesh_bytes,
            "{share}"
        );
        if share > 1.0 {
            assert!(bits(&image) == bits(&free));
        }
    }
    assert_eq!((endings[0], endings[3]), (Ending::Memory, Ending::Error));
    assert!(errors[0] > 0.01 && errors[3] < errors[0], "{errors:?}");
}

/// Whoever names a mesh gets that one or an error before any of it is evaluated, which says what it would take; or the pictures on the way to it, as far as
/// memory went.
#[test]
fn a_named_mesh_that_does_not_fit_is_refused() {
    let scene = scene();
    let mut settings = settings(0.05);
    settings.mesh.direct.spacing = Spacing::Units(Vec3::splat(0.2));
    let (_, stats) = rendered(&scene, &Settings { limits: Limits::default(), ..settings.clone() });
    let taken = stats.light_mesh_bytes;
    settings.limits.memory = Some(taken / 2);
    let mut session = session(&scene.scene);
    match session.render(&scene.cameras[0], &settings) {
        // Points at one place are counted twice where they become known together.
        Err(RenderError::Memory { needed, limit }) => {
            assert!(
                limit == taken / 2 && needed >= taken && needed < taken + taken / 4,
                "{needed} for {taken}"
            );
        }
        other => panic!("{:?}", other.map(|(_, stats)| stats)),
    }
    assert!(session.known_points().positions.is_empty());

    settings.limits.steps = Steps::List(vec![Step { spacing: Some(Vec3::splat(0.8)), ..Step::default() }]);
    let (image, stats) = session.render(&scene.cameras[0], &settings).expect("a rough image");
    assert_eq!(
        stats.accuracy.map(|accuracy| (accuracy.ending, accuracy.found)),
        Some((Ending::Memory, None))
    );
    settings.limits = Limits::default();
    settings.mesh.direct.spacing = Spacing::Units(Vec3::splat(0.8));
    assert!(bits(&image) == bits(&rendered(&scene, &settings).0));
}

/// Sharp shadows need no mesh: where memory has none for it, the conventional tracer makes the picture, which is the same but for its error.
#[test]
fn sharp_shadows_are_traced_where_memory_is_short() {
    let scene = scene();
    let mut settings = settings(0.05);
    settings.shading.integrator = Integrator::Auto;
    settings.shading.resolve = Resolve::Trace;
    settings.limits.memory = Some(1 << 10);
    let (image, stats) = rendered(&scene, &settings);
    assert_eq!(
        stats.choice.map(|choice| (choice.integrator, choice.reason)),
        Some((Integrator::Conventional, Reason::Memory))
    );
    settings.shading.integrator = Integrator::Conventional;
    assert!(bits(&image) == bits(&rendered(&scene, &settings).0));
}
