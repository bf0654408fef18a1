//! The physical preset gives what a path tracer gives (method §12), held against pictures that Mitsuba rendered.
//!
//! The pictures are not part of this repository: they are looked for in `../shared/references`, or where
//! `LIGHTMESH_REFERENCES` points to.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use glam::Vec3;
use lightmesh::accel::Accel;
use lightmesh::image::metrics::{self, MetricsOptions};
use lightmesh::image::{self, Image};
use lightmesh::scene::CameraRays;
use lightmesh::scene::load::LoadedScene;
use lightmesh::scene::load::scene_file::load_scene_text;
use lightmesh::settings::Settings;
use serde_json::Value;

use crate::common::data::missing;
use crate::common::failed::assert_images;
use crate::common::{backend, picture};

fn references() -> Option<PathBuf> {
    let folder = std::env::var_os("LIGHTMESH_REFERENCES")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/references"), PathBuf::from);
    if folder.is_dir() {
        Some(folder)
    } else {
        missing(&format!("there are no reference pictures in {}", folder.display()));
        None
    }
}

/// A scene file of one of the references, from its description in numbers.
fn scene_text(folder: &Path, name: &str) -> String {
    let text = std::fs::read_to_string(folder.join(format!("{name}.json"))).unwrap();
    let description: Value = serde_json::from_str(&text).unwrap();
    let camera = &description["camera"];
    let mut scene = format!(
        "preset = \"physical\"\n[camera]\nposition = {}\nlook_at = {}\nup = {}\nvertical_fov = {}\n[render]\nspp = 4\n\
         resolution = {}\n[[geometry]]\nfile = {}\n",
        camera["position"],
        camera["look_at"],
        camera["up"],
        camera["vertical_fov_deg"],
        description["resolution"],
        description["geometry"],
    );
    for light in ["point_lights", "lamps"].iter().filter_map(|key| description[key].as_array()).flatten() {
        let (position, intensity) = (&light["position"], &light["intensity_w_per_sr"]);
        let _ = write!(scene, "[[light]]\nposition = {position}\nintensity = {intensity}\n");
        if let Some(radius) = light["radius"].as_f64().filter(|&radius| radius > 0.0) {
            let _ = writeln!(scene, "radius = {radius}");
        }
    }
    scene
}

/// A picture of ours beside the path tracer's.
struct Pair {
    loaded: LoadedScene,
    ours: Image,
    theirs: Image,
}

/// Renders a reference's scene, with the preset's settings but for what `change` does.
fn pair(name: &str, reference: &str, change: impl Fn(&mut Settings)) -> Option<Pair> {
    let folder = references()?;
    let text = scene_text(&folder, name);
    let mut loaded = load_scene_text(&text, &folder.join(format!("{name}.toml"))).unwrap();
    change(&mut loaded.settings);
    let (ours, _) = picture(&loaded.scene, &loaded.cameras[0], &loaded.settings);
    let theirs = image::read(&folder.join(format!("{reference}.exr"))).unwrap();
    Some(Pair { loaded, ours, theirs })
}

/// One bounce instead of as many as it takes.
fn one_bounce(settings: &mut Settings) {
    settings.mesh.indirect.as_mut().unwrap().bounces = 1;
}

impl Pair {
    /// The material index that the middle of each pixel shows; `None` where it shows nothing.
    fn materials(&self) -> Vec<Option<u32>> {
        let Pair { loaded, ours, .. } = self;
        let backend = backend(&loaded.scene);
        let rays = CameraRays::new(&loaded.cameras[0], (ours.width(), ours.height()), 1);
        let pixels = (0..ours.height()).flat_map(|y| (0..ours.width()).map(move |x| (x, y)));
        pixels
            .map(|(x, y)| {
                let hit = backend.intersect(&rays.ray(x, y, 0))?;
                let mesh = loaded.scene.instances[hit.instance as usize].mesh;
                Some(loaded.scene.meshes[mesh as usize].materials.of(hit.triangle))
            })
            .collect()
    }

    /// The 8×8 block means are within 3 %, on average, and the mean of the image is within 1 %: a few times what the references' own noise
    /// is.
    fn assert_alike(&self, what: &str) {
        let metrics = metrics::compare(&self.ours, &self.theirs, MetricsOptions::default()).unwrap();
        let block_error = metrics.block_mean_relative_error.unwrap();
        let mean_error = metrics.mean.unwrap() / metrics.reference_mean.unwrap() - 1.0;
        println!("{what}: blocks {block_error:.4}, mean {mean_error:+.4}");
        let problem =
            format!("{what}: mean relative error of block means {block_error}, mean off by {mean_error}");
        assert_images(block_error <= 0.03 && mean_error.abs() <= 0.01, &self.ours, &self.theirs, problem);
    }
}

#[test]
fn direct_light_of_the_cornell_box_is_the_path_tracers() {
    let no_indirect = |settings: &mut Settings| settings.mesh.indirect = None;
    let Some(pair) = pair("cornell", "cornell-direct", no_indirect) else { return };
    pair.assert_alike("cornell-direct");
}

/// Four balls, a point and an emissive panel, alone and with all bounces.
#[test]
fn lamps_with_a_size_light_a_yard_as_the_path_tracers_do() {
    let no_indirect = |settings: &mut Settings| settings.mesh.indirect = None;
    let Some(pair) = pair("yard", "yard-direct", no_indirect) else { return };
    pair.assert_alike("yard-direct");
    if let Some(pair) = self::pair("yard", "yard-all-bounces", |_| ()) {
        pair.assert_alike("yard-all-bounces");
    }
}

#[test]
fn one_bounce_in_the_cornell_box_is_the_path_tracers() {
    let Some(pair) = pair("cornell", "cornell-one-bounce", one_bounce) else { return };
    pair.assert_alike("cornell-one-bounce");
}

#[test]
fn all_bounces_in_the_cornell_box_are_the_path_tracers() {
    let Some(pair) = pair("cornell", "cornell-all-bounces", |_| ()) else { return };
    pair.assert_alike("cornell-all-bounces");
}

/// All light comes from a shining square. Pixels that see the lamp, and those around
/// them, through which its edge goes, are left out: they show how pixels are filtered, not how light travels.
#[test]
fn a_lamp_lights_the_cornell_box_as_the_path_tracers() {
    let Some(mut pair) = pair("cornell-lamp", "cornell-lamp-all-bounces", |_| ()) else { return };
    let lamp = pair.loaded.scene.materials.iter().position(|m| m.emission != Vec3::ZERO).unwrap() as u32;
    let (width, height) = (pair.ours.width() as usize, pair.ours.height() as usize);
    let materials = pair.materials();
    let shows_lamp = |x: usize, y: usize| materials[y * width + x] == Some(lamp);
    let mut left_out = 0;
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        let around = |at: usize, end: usize| at.saturating_sub(1)..(at + 2).min(end);
        if around(y, height).any(|y| around(x, width).any(|x| shows_lamp(x, y))) {
            pair.ours.pixels_mut()[y * width + x] = pair.theirs.pixels()[y * width + x];
            left_out += 1;
        }
    }
    println!("cornell-lamp: {left_out} of {} pixels left out", width * height);
    assert!(left_out < width * height / 20, "{left_out} pixels see the lamp");
    pair.assert_alike("cornell-lamp-all-bounces");
}

/// Shares of red, green and blue in the light of the given pixels.
fn tint(image: &Image, pixels: &[usize]) -> Vec3 {
    let sum: Vec3 = pixels.iter().map(|&pixel| Vec3::from_array(image.pixels()[pixel])).sum();
    sum / sum.element_sum()
}

/// Many bounces match the path tracer, and one bounce matches its one bounce. With many, painted faces that look away from
/// the camera tint the white faces around them: in hue and strength as in the path tracer's picture, which one bounce is
/// far from.
#[test]
fn the_boards_match_the_path_tracers_and_many_bounces_tint_them() {
    let Some(one) = pair("wood", "wood-one-bounce", one_bounce) else { return };
    one.assert_alike("wood-one-bounce");
    let Some(many) = pair("wood", "wood-all-bounces", |_| ()) else { return };
    many.assert_alike("wood-all-bounces");

    let materials = many.materials();
    let white = |pixel: &usize| {
        materials[*pixel].is_some_and(|material| {
            let k_d = many.loaded.scene.materials[material as usize].diffuse;
            k_d.max_element() == k_d.min_element()
        })
    };
    // The strongest tints: the tenth of the white pixels that the path tracer has furthest from grey.
    let strength = |pixel: usize| tint(&many.theirs, &[pixel]).distance(Vec3::splat(1.0 / 3.0));
    let mut pixels: Vec<usize> = (0..materials.len()).filter(white).collect();
    pixels.sort_by(|&a, &b| strength(b).total_cmp(&strength(a)));
    pixels.truncate(pixels.len() / 10);
    // No light has no hue.
    let black = |image: &Image| pixels.iter().filter(|&&pixel| image.pixels()[pixel] == [0.0; 3]).count();
    assert_eq!((black(&many.ours), black(&one.ours)), (0, 0), "no surface there is without light");
    let mut errors = [0.0f32; 2];
    for pixel in &pixels {
        let theirs = tint(&many.theirs, &[*pixel]);
        errors[0] += tint(&many.ours, &[*pixel]).distance(theirs) / pixels.len() as f32;
        errors[1] += tint(&one.ours, &[*pixel]).distance(theirs) / pixels.len() as f32;
    }
    println!("tint of {} white pixels: off by {errors:?}", pixels.len());
    let [off, off_with_one] = errors;
    let problem = format!("tints are off by {off} with many bounces, {off_with_one} with one");
    assert_images(off < 0.3 * off_with_one, &many.ours, &many.theirs, problem);
}
