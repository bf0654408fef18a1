//! The physical preset gives what a path tracer gives (spec §12), held against pictures that Mitsuba rendered.
//!
//! The pictures are not part of this repository: they are looked for in `../shared/references`, or where
//! `LIGHTMESH_REFERENCES` points to.

mod common;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use common::picture;
use lightmesh::image::metrics::{self, MetricsOptions};
use lightmesh::image::{self, Image};
use lightmesh::scene::load::scene_file::load_scene_text;
use serde_json::Value;

fn references() -> Option<PathBuf> {
    let folder = std::env::var_os("LIGHTMESH_REFERENCES")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/references"), PathBuf::from);
    if folder.is_dir() {
        Some(folder)
    } else {
        println!("skipped: there are no reference pictures in {}", folder.display());
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

/// Bounces of indirect light in a reference picture.
#[derive(Clone, Copy, PartialEq)]
enum Bounces {
    None,
    One,
    All,
}

/// Renders a scene with the settings and holds it against its reference: the 8×8 block means are within 5 %, on
/// average, and the mean of the image is within 2 %.
fn assert_matches(name: &str, reference: &str, bounces: Bounces, light_mesh: &str) {
    let Some(folder) = references() else { return };
    let text = scene_text(&folder, name, light_mesh);
    let mut loaded = load_scene_text(&text, &folder.join(format!("{name}.toml"))).unwrap();
    let indirect = &mut loaded.settings.light_mesh.indirect;
    match bounces {
        Bounces::None => *indirect = None,
        Bounces::One => indirect.as_mut().unwrap().bounces = 1,
        Bounces::All => {}
    }
    let (film, _) = picture(&loaded.scene, &loaded.cameras[0], &loaded.settings);
    let (width, height) = film.resolution;
    let ours = Image::from_pixels(width, height, film.pixels).unwrap();
    let theirs = image::read(&folder.join(format!("{reference}.exr"))).unwrap();
    let metrics = metrics::compare(&ours, &theirs, MetricsOptions::default()).unwrap();
    let block_error = metrics.block_mean_relative_error.unwrap();
    let mean_error = metrics.mean.unwrap() / metrics.reference_mean.unwrap() - 1.0;
    println!("{reference}: blocks {block_error:.4}, mean {mean_error:+.4}");
    assert!(block_error <= 0.05, "{reference}: mean relative error of block means {block_error}");
    assert!(mean_error.abs() <= 0.02, "{reference}: mean of the image off by {mean_error}");
}

const CORNELL: &str = "";
const WOOD: &str = "";

#[test]
fn direct_light_of_the_cornell_box_is_the_path_tracers() {
    assert_matches("cornell", "cornell-direct", Bounces::None, CORNELL);
}

#[test]
fn one_bounce_in_the_cornell_box_is_the_path_tracers() {
    assert_matches("cornell", "cornell-one-bounce", Bounces::One, CORNELL);
}

#[test]
fn all_bounces_in_the_cornell_box_are_the_path_tracers() {
    assert_matches("cornell", "cornell-all-bounces", Bounces::All, CORNELL);
}

#[test]
fn a_lamp_lights_the_cornell_box_through_the_indirect_mesh_alone() {
    assert_matches("cornell-lamp", "cornell-lamp-all-bounces", Bounces::All, CORNELL);
}

#[test]
fn one_bounce_among_painted_panels_is_the_path_tracers() {
    assert_matches("wood", "wood-one-bounce", Bounces::One, WOOD);
}

#[test]
fn all_bounces_among_painted_panels_are_the_path_tracers() {
    assert_matches("wood", "wood-all-bounces", Bounces::All, WOOD);
}
