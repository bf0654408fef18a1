//! Hybrid shadows are the conventional tracer's for a fraction of its rays (method §4).

use glam::Vec3;
use lightmesh::image::Image;
use lightmesh::scene::generate::interior::Interior;
use lightmesh::scene::load::{LoadedScene, load_scene_file};
use lightmesh::scene::{Falloff, Light};
use lightmesh::settings::{Integrator, Leaks, Neighbourhood, Radius, Resolve, Spacing};

use crate::common::failed::assert_images;
use crate::common::{Builder, camera, conventional, forest, grey, light, picture, settings_at};

fn interior() -> LoadedScene {
    let folder = tempfile::tempdir().unwrap();
    Interior { bays: 6, lamps: 40 }.write(folder.path()).unwrap();
    load_scene_file(&folder.path().join("interior.toml")).unwrap()
}

/// With a tolerance of 0.5 %, at which no point of an open patch speaks for another, at most 1 % of the pixels differ from the
/// conventional ones at 1200×1200 by more than 2 % of the image's mean, and at most the given share of the conventional shadow
/// rays is traced, those of the mesh points included.
fn assert_saves_rays(loaded: &LoadedScene, spacing: f32, radius_in_spacings: f32, share: f64) {
    let mut settings = loaded.settings.clone();
    settings.view.resolution = (1200, 1200);
    // With several samples all rays would be fewer, and edges their mean.
    settings.view.samples_per_pixel = 1;
    settings.mesh.indirect = None;
    settings.shading.integrator = Integrator::LightMesh;
    settings.shading.resolve = Resolve::Trace;
    settings.shading.tolerance = 5e-3;
    settings.mesh.direct.spacing = Spacing::Units(Vec3::splat(spacing));
    settings.shading.kernel.radius = Radius::Spacings(radius_in_spacings);
    let (reference, conventional) = conventional(&loaded.scene, &loaded.cameras[0], &settings);
    let (traced, hybrid) = picture(&loaded.scene, &loaded.cameras[0], &settings);
    let mean = reference.pixels().as_flattened().iter().sum::<f32>() / (3 * reference.pixels().len()) as f32;
    let differ = |(a, b): (&[f32; 3], &[f32; 3])| (0..3).any(|c| (a[c] - b[c]).abs() > 0.02 * mean);
    let differing = traced.pixels().iter().zip(reference.pixels()).filter(|&pair| differ(pair)).count();
    let rays = hybrid.rays.shadow as f64 / conventional.rays.shadow as f64;
    println!("{differing} pixels differ, {rays:.3} of the shadow rays");
    let few = differing * 100 <= reference.pixels().len();
    assert_images(few, &traced, &reference, format_args!("{differing} pixels differ"));
    assert!(rays <= share, "{rays} of the conventional shadow rays");
}

/// Leaves of all sizes shade each other: few pairs of places and lights are wholly lit or wholly dark.
#[test]
fn in_the_forest_a_quarter_of_the_shadow_rays_is_saved() {
    assert_saves_rays(&forest(23_542, 100), 0.2, 1.5, 0.75);
}

/// Walls, pillars and beams hide whole groups of lights from whole areas.
#[test]
fn in_the_interior_four_fifths_of_the_shadow_rays_are_saved() {
    assert_saves_rays(&interior(), 0.1, 1.2, 0.2);
}

/// Which floor pixels an assumption of the mesh would get wrong.
#[derive(Clone, Copy)]
enum Rare {
    Dark,
    Lit,
}

/// A floor of 4×4 under a lamp and occluders: of the floor's pixels that are `rare`, all but a twentieth are what the conventional
/// tracer makes of them, and no more than so many others are wrong, for half its shadow rays.
fn assert_found(lamp: Vec3, spacing: f32, rare: Rare, occluders: impl Fn(&mut Builder)) {
    let floor = |occluders: &dyn Fn(&mut Builder)| {
        let mut builder = Builder::default();
        builder.quad(Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0, 0);
        occluders(&mut builder);
        builder.scene(vec![grey(0.8)], vec![light(lamp, Vec3::ONE)], Falloff::default())
    };
    let scene = floor(&occluders);
    let camera = camera(Vec3::new(0.0, 3.0, 3.0), Vec3::ZERO, 45.0);
    let mut settings = settings_at((320, 320));
    settings.mesh.direct.spacing = Spacing::Units(Vec3::splat(spacing));
    settings.shading.kernel.neighbourhood = Neighbourhood::Sphere;
    settings.shading.kernel.leaks = Leaks::Allow;
    settings.shading.resolve = Resolve::Trace;
    let (open, _) = conventional(&floor(&|_| ()), &camera, &settings);
    let (reference, conventional) = conventional(&scene, &camera, &settings);
    let (traced, hybrid) = picture(&scene, &camera, &settings);
    let lit = |image: &Image, pixel: usize| image.pixels()[pixel][0] > 0.0;
    let of_floor = || (0..open.pixels().len()).filter(|&pixel| lit(&open, pixel));
    let is_rare = |pixel| lit(&reference, pixel) == matches!(rare, Rare::Lit);
    let wrong = of_floor().filter(|&pixel| lit(&traced, pixel) != lit(&reference, pixel)).count();
    let sought = of_floor().filter(|&pixel| is_rare(pixel)).count();
    assert!(sought > 500, "{sought} pixels to find");
    let problem = format_args!("{wrong} pixels are wrong where {sought} are to be found");
    assert_images(wrong * 20 < sought, &traced, &reference, problem);
    assert!(hybrid.rays.shadow * 2 < conventional.rays.shadow, "{} rays", hybrid.rays.shadow);
}

/// The mesh assumes light: an occluder much thinner than the spacing, which no mesh point is behind, still casts its shadow. A
/// few rays look for what the mesh points missed, and what they find spreads along the shadow.
#[test]
fn occluders_thinner_than_the_spacing_keep_their_shadows() {
    // A wire above the floor, 0.06 wide where mesh points are 0.5 apart; its shadow lies before it.
    assert_found(Vec3::new(0.3, 3.0, -2.0), 0.5, Rare::Dark, |builder| {
        builder.quad(Vec3::new(-2.0, 0.15, -0.03), Vec3::Z * 0.06, Vec3::X * 4.0, 0);
    });
}

/// The mesh assumes darkness: a slit in a roof, much narrower than the spacing, that no mesh point sees the lamp through.
#[test]
fn slits_narrower_than_the_spacing_let_light_through() {
    assert_found(Vec3::new(0.3, 3.0, -2.0), 0.5, Rare::Lit, |builder| {
        for z in [-3.0, 0.03] {
            builder.quad(Vec3::new(-3.0, 0.1, z), Vec3::Z * 2.97, Vec3::X * 6.0, 0);
        }
    });
}

/// The corners of a patch agree, and something between them does not: wires whose shadows are narrower than a patch of 4×4
/// pixels, so close together that mesh points disagree about the lamp.
#[test]
fn shadows_between_the_corners_of_a_patch_are_found() {
    assert_found(Vec3::new(0.3, 3.0, -2.0), 0.1, Rare::Dark, |builder| {
        for wire in 0..8 {
            let z = 0.3 * wire as f32 - 1.5;
            builder.quad(Vec3::new(-2.0, 0.3, z), Vec3::Z * 0.02, Vec3::X * 4.0, 0);
        }
    });
}

/// A light that was too weak to be traced beside another is looked at again where that one turns out to be hidden. Mesh points
/// all see a strong lamp and disagree, below a grating, about one of a 4000th of its strength. In the shadow of a band that only checks find, the
/// weak lamp is all the light there is, so that its own shadow is to be sharp there: wrong by more than a twentieth of its light
/// are at most a twentieth as many pixels as see it.
#[test]
fn weak_lights_keep_their_shadows_where_strong_ones_are_hidden() {
    let strong = light(Vec3::new(0.3, 2.5, -2.0), Vec3::ONE);
    let weak = light(Vec3::new(0.0, 5.6, 0.0), Vec3::splat(1.0 / 4000.0));
    let scene = |lights: Vec<Light>| {
        let mut builder = Builder::default();
        builder.quad(Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0, 0);
        builder.quad(Vec3::new(-2.0, 0.1, -0.1), Vec3::Z * 0.2, Vec3::X * 4.0, 0);
        for slat in -18..18 {
            builder.quad(Vec3::new(0.11 * slat as f32, 2.8, -3.0), Vec3::Z * 6.0, Vec3::X * 0.055, 0);
        }
        builder.scene(vec![grey(0.8)], lights, Falloff::default())
    };
    let camera = camera(Vec3::new(0.0, 2.6, 2.6), Vec3::ZERO, 45.0);
    let mut settings = settings_at((320, 320));
    settings.mesh.direct.spacing = Spacing::Units(Vec3::splat(0.5));
    settings.shading.kernel.neighbourhood = Neighbourhood::Sphere;
    settings.shading.kernel.leaks = Leaks::Allow;
    settings.shading.resolve = Resolve::Trace;
    let strong_alone = conventional(&scene(vec![strong]), &camera, &settings).0;
    let both = scene(vec![strong, weak]);
    let (reference, _) = conventional(&both, &camera, &settings);
    let (traced, _) = picture(&both, &camera, &settings);
    let red = |image: &Image, pixel: usize| image.pixels()[pixel][0];
    let of_band = |pixel: &usize| red(&strong_alone, *pixel) == 0.0;
    let in_band =
        || (0..320 * 320).filter(of_band).map(|pixel| red(&reference, pixel)).filter(|light| *light > 0.0);
    let lit_in_band = in_band().count();
    assert!(lit_in_band > 500, "the test shows nothing: {lit_in_band} pixels");
    let off = 0.05 * in_band().sum::<f32>() / lit_in_band as f32;
    let is_wrong = |pixel: &usize| (red(&traced, *pixel) - red(&reference, *pixel)).abs() > off;
    let wrong = (0..320 * 320).filter(of_band).filter(is_wrong).count();
    let problem = format_args!("{wrong} pixels are wrong where {lit_in_band} see the weak lamp");
    assert_images(wrong * 20 < lit_in_band, &traced, &reference, problem);
}
