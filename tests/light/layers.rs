//! Layers: they add up to the picture, for every integrator, and show what they say.

use glam::Vec3;
use lightmesh::image::Image;
use lightmesh::render::{Layer, LayerChoice, LayerCollector, LayerImage, RenderStats, StopToken};
use lightmesh::scene::{Camera, Falloff, Light, Material, Scene};
use lightmesh::settings::{
    Estimator, IndirectForm, IndirectSettings, Integrator, Leaks, Named as _, PointLayout, Radius, Resolve,
    Settings, Spacing,
};

use crate::common::{Builder, camera, forest, grey, light, session, settings_at};

/// Grey floor, wall, mirror, box and glowing panel, under lights of three groups.
fn scene() -> Scene {
    let mut builder = Builder::default();
    builder.quad(Vec3::new(-2.0, 0.0, 2.0), Vec3::X * 4.0, Vec3::Z * -4.0, 0);
    builder.quad(Vec3::new(-2.0, 0.0, -2.0), Vec3::X * 2.0, Vec3::Y * 3.0, 1);
    builder.quad(Vec3::new(0.0, 0.0, -2.0), Vec3::X * 2.0, Vec3::Y * 3.0, 2);
    builder.cuboid(Vec3::new(-0.6, 0.0, -0.5), Vec3::new(0.1, 0.9, 0.2), false, 1);
    builder.quad(Vec3::new(0.6, 0.1, 0.0), Vec3::X * 0.5, Vec3::Y * 0.5, 3);
    let red = Material { diffuse: Vec3::new(0.7, 0.2, 0.1), ..Material::default() };
    let mirror = Material { specular: Vec3::new(0.8, 0.7, 0.6), ..grey(0.1) };
    let glowing = Material { emission: Vec3::new(0.5, 1.0, 2.0), ..grey(0.2) };
    let lights = vec![
        light(Vec3::new(1.5, 2.0, 1.5), Vec3::new(3.0, 2.0, 1.0)),
        Light::ball(Vec3::new(-1.5, 2.5, 1.0), 0.1, Vec3::new(1.0, 2.0, 4.0)),
        light(Vec3::new(0.3, 1.6, -0.3), Vec3::new(0.4, 1.0, 0.3)),
        light(Vec3::new(-1.0, 1.0, 1.8), Vec3::new(0.5, 0.1, 0.7)),
    ];
    let mut scene = builder.scene(vec![grey(0.6), red, mirror, glowing], lights, Falloff::InverseSquare);
    scene.background = Vec3::new(0.1, 0.2, 0.3);
    scene.light_groups.assign(0..1, "key").unwrap();
    scene.light_groups.assign(1..3, "rim").unwrap();
    scene
}

fn view() -> Camera {
    camera(Vec3::new(0.3, 1.3, 4.2), Vec3::new(0.0, 0.9, 0.0), 50.0)
}

/// Settings of every way to direct light, with light from surfaces.
fn ways() -> Vec<(&'static str, Settings)> {
    let base = |integrator| {
        let mut settings = settings_at((70, 45));
        settings.shading.integrator = integrator;
        settings.shading.lambertian = true;
        settings.shading.reference_samples = 4;
        settings.derive_indirect().form = IndirectForm::Surface;
        settings
    };
    let mesh = |change: fn(&mut Settings)| {
        let mut settings = base(Integrator::LightMesh);
        change(&mut settings);
        settings
    };
    vec![
        ("conventional", base(Integrator::Conventional)),
        ("reference", base(Integrator::Reference)),
        ("averaged", mesh(|settings| settings.shading.resolve = Resolve::Average)),
        (
            "between pixels",
            mesh(|settings| {
                settings.shading.resolve = Resolve::Average;
                settings.shading.pixel_tolerance = 0.01;
            }),
        ),
        ("traced", mesh(|settings| settings.shading.resolve = Resolve::Trace)),
        ("directional", mesh(|settings| settings.shading.estimator = Estimator::Directional)),
        ("allowed leaks", mesh(|settings| settings.shading.kernel.leaks = Leaks::Allow)),
        ("ratio", mesh(|settings| settings.shading.estimator = Estimator::Ratio)),
        (
            "free space",
            mesh(|settings| {
                let free = IndirectSettings { form: IndirectForm::Scalar, ..Default::default() };
                settings.mesh.indirect = Some(free);
                settings.shading.lambertian = false;
            }),
        ),
    ]
}

fn all() -> LayerChoice {
    LayerChoice { layers: Layer::NAMES.iter().map(|(_, layer, _)| *layer).collect(), light_groups: true }
}

fn rendered(scene: &Scene, settings: &Settings, choice: LayerChoice) -> (Image, LayerImage, RenderStats) {
    rendered_from(&view(), scene, settings, choice)
}

fn rendered_from(
    camera: &Camera,
    scene: &Scene,
    settings: &Settings,
    choice: LayerChoice,
) -> (Image, LayerImage, RenderStats) {
    let collector = LayerCollector::new(choice);
    let mut session = session(scene);
    let stop = StopToken::default();
    let (image, stats) =
        session.render_layers(camera, settings, &(), &stop, Some(&collector)).expect("a picture");
    let layers = collector.take(&image).expect("the layers of this picture");
    (image, layers, stats)
}

/// A layer's three channels, pixel by pixel.
fn layer(layers: &LayerImage, name: &str, channels: &str) -> Vec<[f32; 3]> {
    let found: Vec<&Vec<f32>> =
        channels.chars().map(|channel| values(layers, &format!("{name}.{channel}"))).collect();
    (0..found[0].len()).map(|pixel| [0, 1, 2].map(|channel| found[channel][pixel])).collect()
}

fn values<'a>(layers: &'a LayerImage, name: &str) -> &'a Vec<f32> {
    let found = layers.channels.iter().find(|channel| channel.name == name);
    &found.unwrap_or_else(|| panic!("no channel {name}")).values
}

/// Half a unit in the last place of the picture is all that may lie between it and the exact sum of layers.
fn assert_sum(image: &Image, parts: &[Vec<[f32; 3]>], what: &str) {
    for (pixel, shown) in image.pixels().iter().enumerate() {
        for (channel, &shown) in shown.iter().enumerate() {
            let sum: f64 = parts.iter().map(|part| f64::from(part[pixel][channel])).sum();
            let last_place = f64::from(shown.next_up() - shown);
            // The sum itself, in double precision, may be off by its own last places.
            let allowed = 0.5 * last_place + 1e-14 * sum;
            let error = (sum - f64::from(shown)).abs();
            assert!(error <= allowed, "{what}, pixel {pixel}: {sum} for {shown}");
        }
    }
}

/// Whoever grades layers apart and adds them again must end with the picture that was rendered; with groups of lights in the place of direct
/// light too. And layers must be no other picture: what is traced and interpolated is the same, so that it differs from one without layers by
/// the order of a few sums, of which each rounds by 2⁻²⁴ of what it adds up to.
#[test]
fn layers_add_up_to_the_picture() {
    let scene = scene();
    for (name, settings) in ways() {
        for samples in [1, 16] {
            let mut settings = settings.clone();
            settings.view.samples_per_pixel = samples;
            let what = format!("{name}, {samples} samples");
            let (image, layers, stats) = rendered(&scene, &settings, all());
            let colours = |name: &str| layer(&layers, name, "RGB");
            let rest = ["indirect", "emission", "reflection"].map(colours).to_vec();
            let direct = colours("direct");
            assert_sum(&image, &[std::slice::from_ref(&direct), &rest[..]].concat(), &what);
            let groups = ["light_default", "light_key", "light_rim"].map(colours);
            assert_sum(&image, &[&groups[..], &rest[..]].concat(), &format!("groups of {what}"));
            // None of them is empty, or the sums would say nothing about it.
            for part in [&[direct][..], &rest[..], &groups[..]].concat() {
                assert!(part.as_flattened().iter().any(|&value| value > 0.01), "{what}");
                assert!(part.as_flattened().iter().all(|&value| value >= 0.0), "{what}");
            }
            let (plain, plain_stats) = session(&scene).render(&view(), &settings).expect("a picture");
            assert_eq!(stats.rays, plain_stats.rays, "{what}");
            for (with, without) in image.pixels().as_flattened().iter().zip(plain.pixels().as_flattened()) {
                assert!((with - without).abs() <= 4e-6 * without, "{what}: {with} for {without}");
            }
        }
    }
}

/// A group's layer is what its lights give when the others are off; the glowing panel, which is on, is in no group's but the default one's.
#[test]
fn a_group_is_the_scene_under_its_lights_alone() {
    let scene = scene();
    let mut settings = settings_at((70, 45));
    settings.shading.lambertian = true;
    settings.mesh.indirect = None;
    let choice = || LayerChoice { layers: vec![Layer::Direct], light_groups: true };
    for (integrator, tolerance) in [(Integrator::Conventional, 2e-6), (Integrator::LightMesh, 2e-6)] {
        settings.shading.integrator = integrator;
        settings.shading.resolve = Resolve::Average;
        // Which points count must not follow from lights that aren't there.
        settings.shading.kernel.leaks = Leaks::Allow;
        let (_, layers, _) = rendered(&scene, &settings, choice());
        for (group, members) in [("default", 3..4), ("key", 0..1), ("rim", 1..3)] {
            let mut alone = scene.clone();
            for (number, light) in alone.lights.iter_mut().enumerate() {
                light.intensity *= if members.contains(&number) { 1.0 } else { 0.0 };
            }
            let (_, expected, _) = rendered(&alone, &settings, choice());
            let found = layer(&layers, &format!("light_{group}"), "RGB");
            let all = layer(&layers, "direct", "RGB");
            let expected = layer(&expected, &format!("light_{group}"), "RGB");
            for (pixel, (found, expected)) in found.iter().zip(&expected).enumerate() {
                for channel in 0..3 {
                    let allowed = tolerance * all[pixel][channel];
                    let error = (found[channel] - expected[channel]).abs();
                    assert!(error <= allowed, "{integrator} {group} {pixel}: {found:?} for {expected:?}");
                }
            }
        }
    }
}

/// Traced shadow edges know of each light what `conventional` does, to within their tolerance of a hundredth of the light; also where several
/// samples of a pixel smooth them.
#[test]
fn groups_of_traced_shadows_are_those_of_conventional_ones() {
    let scene = scene();
    for samples in [1, 16] {
        let mut settings = settings_at((70, 45));
        settings.view.samples_per_pixel = samples;
        settings.shading.resolve = Resolve::Trace;
        let mut by = |integrator| {
            settings.shading.integrator = integrator;
            rendered(&scene, &settings, LayerChoice { layers: Vec::new(), light_groups: true }).1
        };
        let (traced, conventional) = (by(Integrator::LightMesh), by(Integrator::Conventional));
        for group in ["default", "key", "rim"] {
            let values = |layers| layer(layers, &format!("light_{group}"), "RGB");
            let (traced, conventional) = (values(&traced), values(&conventional));
            let pairs = || traced.as_flattened().iter().zip(conventional.as_flattened());
            let wrong: f32 = pairs().map(|(a, b)| (a - b).abs()).sum();
            let all: f32 = pairs().map(|(_, b)| b).sum();
            assert!(all > 1.0 && wrong < 0.01 * all, "{group}, {samples} samples: {wrong} of {all}");
        }
    }
}

/// Layers are as independent of threads and blocks as the picture is.
#[test]
fn threads_and_blocks_leave_no_trace() {
    let scene = scene();
    let mut settings = settings_at((70, 45));
    settings.view.samples_per_pixel = 4;
    let (image, layers, _) = rendered(&scene, &settings, all());
    settings.view.block_samples = Some(4096);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let (again, same, _) = pool.install(|| rendered(&scene, &settings, all()));
    // Infinite depths are equal too.
    assert_eq!((again, same), (image, layers));
}

/// A floor one unit below the eye, which looks straight down: depth, position, normal and albedo are known everywhere; beyond the floor's edge
/// there is nothing.
#[test]
fn surfaces_are_described_as_they_are() {
    let mut builder = Builder::default();
    // From x = 0 to the right.
    builder.quad(Vec3::new(0.0, -1.0, 9.0), Vec3::X * 9.0, Vec3::Z * -18.0, 0);
    let material =
        Material { diffuse: Vec3::new(0.5, 0.25, 0.125), specular: Vec3::splat(0.25), ..grey(0.0) };
    let mut scene = builder.scene(vec![material], vec![light(Vec3::Y, Vec3::ONE)], Falloff::None);
    scene.background = Vec3::new(1.0, 2.0, 3.0);
    let camera = Camera { up: Vec3::Z, ..camera(Vec3::ZERO, Vec3::NEG_Y, 90.0) };
    for samples in [1, 16] {
        let mut settings = settings_at((16, 16));
        settings.view.samples_per_pixel = samples;
        let collector = LayerCollector::new(all());
        let stop = StopToken::default();
        let (image, _) =
            session(&scene).render_layers(&camera, &settings, &(), &stop, Some(&collector)).unwrap();
        let layers = collector.take(&image).unwrap();
        let (normal, albedo, position) =
            (layer(&layers, "N", "XYZ"), layer(&layers, "Albedo", "RGB"), layer(&layers, "P", "XYZ"));
        let coverage = values(&layers, "CryptoObject00.G");
        let mut counts = [0, 0];
        for pixel in 0..256 {
            // Columns 0 to 7 and 8 to 15 lie on different sides of the edge.
            let is_hit = coverage[pixel] == 1.0;
            counts[usize::from(is_hit)] += 1;
            let depth = values(&layers, "Z")[pixel];
            if is_hit {
                assert!((depth - 1.0).abs() < 1e-5, "{depth}");
                let [x, y, z] = position[pixel];
                // A pixel's edge is 1/8 on the plane at distance 1.
                let row = (pixel / 16) as f32;
                let middle = 1.0 - (row + 0.5) / 8.0;
                assert!(
                    (y + 1.0).abs() < 1e-5 && x > 0.0 && (z - middle).abs() <= 1.0 / 16.0,
                    "{z} {middle}"
                );
                assert!((Vec3::from(normal[pixel]) - Vec3::Y).length() < 1e-6);
                assert!((Vec3::from(albedo[pixel]) - Vec3::new(0.75, 0.5, 0.375)).length() < 1e-6);
            } else {
                assert_eq!((depth, coverage[pixel]), (f32::INFINITY, 0.0));
                assert_eq!((normal[pixel], albedo[pixel]), ([0.0; 3], [0.0; 3]));
                assert_eq!(layer(&layers, "emission", "RGB")[pixel], [1.0, 2.0, 3.0]);
            }
        }
        assert_eq!(counts, [128, 128]);
    }
}

/// Points are counted where a light mesh has them, and nowhere else.
#[test]
fn mesh_points_are_counted() {
    let scene = scene();
    let choice = LayerChoice { layers: vec![Layer::MeshPoints], light_groups: false };
    for (integrator, has_points) in [(Integrator::LightMesh, true), (Integrator::Conventional, false)] {
        let mut settings = settings_at((32, 32));
        settings.shading.integrator = integrator;
        let (_, layers, _) = rendered(&scene, &settings, choice.clone());
        let counts = values(&layers, "mesh_points");
        assert_eq!(counts.iter().any(|&count| count >= 4.0), has_points);
        assert!(counts.iter().all(|&count| count.fract() == 0.0 && count < 1e4));
    }
}

/// A picture of the forest and the layer of its error.
fn with_error(settings: &Settings) -> (Image, Vec<f32>) {
    let scene = forest(3_000, 20);
    let choice = LayerChoice { layers: vec![Layer::Error], light_groups: false };
    let (image, layers, _) = rendered_from(&scene.cameras[0], &scene.scene, settings, choice);
    (image, values(&layers, "error").clone())
}

/// Averaged shadows of the forest.
fn averaged(layout: PointLayout, spacing: f32, estimator: Estimator) -> Settings {
    let mut settings = settings_at((64, 48));
    settings.shading.resolve = Resolve::Average;
    settings.shading.estimator = estimator;
    settings.shading.kernel.leaks = Leaks::Allow;
    settings.shading.kernel.radius = Radius::Units(1.2);
    settings.shading.reference_samples = 256;
    settings.mesh.direct.layout = layout;
    settings.mesh.direct.spacing = Spacing::Units(Vec3::splat(spacing));
    settings
}

/// Two halves of the mesh points around a surface point are wrong about as independently of each other as both together and the mean over D_y are, which
/// the reference finds without a mesh: the layer's mean square is the true one to within a factor of three, for meshes of which the true one differs by
/// more than that.
#[test]
fn the_error_layer_is_about_as_large_as_the_error() {
    let mut truths = Vec::new();
    for (layout, spacing, estimator) in [
        (PointLayout::Regular, 1.2, Estimator::PerLight),
        (PointLayout::Regular, 0.8, Estimator::PerLight),
        (PointLayout::Regular, 0.4, Estimator::PerLight),
        (PointLayout::Regular, 0.8, Estimator::Directional),
        (PointLayout::BodyCentred, 0.8, Estimator::PerLight),
        (PointLayout::Jittered { seed: 1 }, 0.8, Estimator::PerLight),
        (PointLayout::BlueNoise { seed: 1 }, 0.8, Estimator::Ratio),
    ] {
        let what = format!("{layout:?}, {spacing}, {estimator}");
        let mut settings = averaged(layout, spacing, estimator);
        let (image, error) = with_error(&settings);
        settings.shading.integrator = Integrator::Reference;
        let (reference, no_error) = with_error(&settings);
        assert!(no_error.iter().all(|error| *error == 0.0), "{what}: the reference has no mesh");
        let mean_square = |errors: &mut dyn Iterator<Item = f32>| {
            errors.map(|error| f64::from(error).powi(2)).sum::<f64>() / error.len() as f64
        };
        let pixels = || image.pixels().iter().zip(reference.pixels());
        let mut differences =
            pixels().map(|(a, b)| (Vec3::from(*a) - Vec3::from(*b)).abs().element_sum() / 3.0);
        let (said, truth) = (mean_square(&mut error.iter().copied()), mean_square(&mut differences));
        assert!(said < 3.0 * truth && truth < 3.0 * said, "{what}: {said} for {truth}");
        truths.push(truth);
    }
    let most = truths.iter().copied().fold(0.0, f64::max);
    let least = truths.iter().copied().fold(f64::INFINITY, f64::min);
    assert!(most > 9.0 * least, "the test shows nothing: {truths:?}");
}

/// Who traces every shadow ray is not wrong. Traced shadow edges trust a weak light's share as long as all of them together, each by the most that it
/// can be wrong, stay below a twentieth of the tolerance of the light that is estimated (method §4): so does the layer, and it is 0 where nothing is tolerated.
#[test]
fn the_error_layer_of_traced_shadows_is_what_weak_lights_may_cost() {
    let mut settings = averaged(PointLayout::Regular, 0.8, Estimator::PerLight);
    settings.shading.integrator = Integrator::Conventional;
    assert!(with_error(&settings).1.iter().all(|error| *error == 0.0));

    settings.shading.integrator = Integrator::LightMesh;
    settings.shading.resolve = Resolve::Trace;
    for tolerance in [0.0, 0.5] {
        settings.shading.tolerance = tolerance;
        let (image, error) = with_error(&settings);
        let light: f32 = image.pixels().as_flattened().iter().sum::<f32>() / 3.0;
        let error: f32 = error.iter().sum();
        // What is estimated of the light where mesh points disagree is right on average to some per cent.
        assert!(error <= 1.1 * 0.05 * tolerance * light, "{tolerance}: {error} of {light}");
        assert_eq!(error > 0.0, tolerance > 0.0);
    }
}
