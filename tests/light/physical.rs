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
fn scene_text(folder: &Path, name: &str, light_mesh: &str) -> String {
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
    for light in description["point_lights"].as_array().unwrap() {
        let (position, intensity) = (&light["position"], &light["intensity_w_per_sr"]);
        let _ = write!(scene, "[[light]]\nposition = {position}\nintensity = {intensity}\n");
    }
    scene + light_mesh
}

/// A picture of ours beside the path tracer's.
struct Pair {
    loaded: LoadedScene,
    ours: Image,
    theirs: Image,
}

/// Renders a reference's scene, with the preset's settings but for what `light_mesh` says and `change` does.
fn pair(name: &str, reference: &str, light_mesh: &str, change: impl Fn(&mut Settings)) -> Option<Pair> {
    let folder = references()?;
    let text = scene_text(&folder, name, light_mesh);
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

    /// The 8×8 block means are within 5 %, on average, and the mean of the image is within 2 %.
    fn assert_alike(&self, what: &str) {
        let metrics = metrics::compare(&self.ours, &self.theirs, MetricsOptions::default()).unwrap();
        let block_error = metrics.block_mean_relative_error.unwrap();
        let mean_error = metrics.mean.unwrap() / metrics.reference_mean.unwrap() - 1.0;
        println!("{what}: blocks {block_error:.4}, mean {mean_error:+.4}");
        let problem =
            format!("{what}: mean relative error of block means {block_error}, mean off by {mean_error}");
        assert_images(block_error <= 0.05 && mean_error.abs() <= 0.02, &self.ours, &self.theirs, problem);
    }
}

#[test]
fn direct_light_of_the_cornell_box_is_the_path_tracers() {
    let no_indirect = |settings: &mut Settings| settings.mesh.indirect = None;
    let Some(pair) = pair("cornell", "cornell-direct", "", no_indirect) else { return };
    pair.assert_alike("cornell-direct");
}

#[test]
fn one_bounce_in_the_cornell_box_is_the_path_tracers() {
    let Some(pair) = pair("cornell", "cornell-one-bounce", "", one_bounce) else { return };
    pair.assert_alike("cornell-one-bounce");
}

#[test]
fn all_bounces_in_the_cornell_box_are_the_path_tracers() {
    let Some(pair) = pair("cornell", "cornell-all-bounces", "", |_| ()) else { return };
    pair.assert_alike("cornell-all-bounces");
}

/// All light comes from a shining square, and so through the indirect mesh. Pixels that see the lamp, and those around
/// them, through which its edge goes, are left out: they show how pixels are filtered, not how light travels.
#[test]
fn a_lamp_lights_the_cornell_box_as_the_path_tracers() {
    let Some(mut pair) = pair("cornell-lamp", "cornell-lamp-all-bounces", "", |_| ()) else { return };
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

/// The boards stand on a plank with a gap of 0.2 under it, which needs mesh points of its own: with an automatic spacing it
/// holds a single layer of them, which can't tell how fast the light falls off into the gap. Light comes from narrow lit
/// strips, which few of 256 directions hit.
const BOARDS: &str = "[light_mesh.indirect]\ndirections = 1024\nbounces = 10\n[[light_mesh.indirect.region]]\nmin = [-3.3, -0.05, -1.1]\nmax = [3.3, 0.22, 0.2]\n\
                      spacing = 0.06\n";

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
    let Some(one) = pair("wood", "wood-one-bounce", BOARDS, one_bounce) else { return };
    one.assert_alike("wood-one-bounce");
    let Some(many) = pair("wood", "wood-all-bounces", BOARDS, |_| ()) else { return };
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
    // At the foot of a board the extrapolated field may fall to 0, here and there: no light has no hue.
    let strongest = pixels.len();
    let has_light = |image: &Image, pixel: usize| image.pixels()[pixel] != [0.0; 3];
    pixels.retain(|&pixel| has_light(&many.ours, pixel) && has_light(&one.ours, pixel));
    assert!((strongest - pixels.len()) * 100 <= strongest, "{} pixels are black", strongest - pixels.len());
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
