//! Hybrid shadows are those of the conventional tracer for a fraction of its rays (spec §4).

mod common;

use common::{conventional, forest, mean, picture};
use glam::Vec3;
use lightmesh::render::Film;
use lightmesh::scene::generate::interior::Interior;
use lightmesh::scene::load::{LoadedScene, load_scene_file};
use lightmesh::settings::{Radius, Resolve, Settings, Spacing};

/// Share of the pixels in which a channel differs by more than 2 % of the reference's mean.
fn differing(film: &Film, reference: &Film) -> f64 {
    let limit = 0.02 * mean(reference) as f32;
    let differs = |(a, b): &(&[f32; 3], &[f32; 3])| a.iter().zip(*b).any(|(a, b)| (a - b).abs() > limit);
    let count = film.pixels.iter().zip(&reference.pixels).filter(differs).count();
    count as f64 / film.pixels.len() as f64
}

fn interior() -> LoadedScene {
    let folder = tempfile::tempdir().unwrap();
    Interior { bays: 6, lamps: 40 }.write(folder.path()).unwrap();
    load_scene_file(&folder.path().join("interior.toml")).unwrap()
}

/// Share of differing pixels, and rays over the conventional tracer's.
fn hybrid(loaded: &LoadedScene, resolution: (u32, u32), spacing: f32, radius: f32) -> (f64, f64) {
    let mut settings = Settings { resolution, ..Settings::default() };
    settings.light_mesh.resolve = Resolve::Trace;
    settings.light_mesh.points.spacing = Spacing::Units(Vec3::splat(spacing));
    settings.light_mesh.points.radius = Radius::Spacings(radius);
    let (reference, conventional) = conventional(&loaded.scene, &loaded.cameras[0], &settings);
    let (film, hybrid) = picture(&loaded.scene, &loaded.cameras[0], &settings);
    (differing(&film, &reference), hybrid.rays.shadow as f64 / conventional.rays.shadow as f64)
}

#[test]
fn hybrid_shadows_of_the_forest_are_the_conventional_ones_for_three_quarters_of_the_rays() {
    let (differing, rays) = hybrid(&forest(23_542, 100), (1200, 1200), 0.15, 1.5);
    assert!(differing <= 0.01, "{differing} of the pixels differ");
    assert!(rays <= 0.75, "{rays} of the rays");
}

#[test]
fn hybrid_shadows_of_an_interior_with_many_lights_take_a_fifth_of_the_rays() {
    let (differing, rays) = hybrid(&interior(), (1200, 800), 0.25, 1.5);
    assert!(differing <= 0.01, "{differing} of the pixels differ");
    assert!(rays <= 0.2, "{rays} of the rays");
}
