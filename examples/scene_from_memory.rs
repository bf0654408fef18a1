//! A scene made in memory, rendered to a file: `cargo run --release --example scene_from_memory`

use std::error::Error;
use std::path::Path;

use glam::Vec3;
use lightmesh::accel::BackendChoice;
use lightmesh::image::{ImageOptions, OutputTarget};
use lightmesh::render::Session;
use lightmesh::scene::{Camera, Light, Material, Scene, TriangleMesh};
use lightmesh::settings::Settings;

/// A square of side 2 `half` around `center`; `right` × `up` points to its front.
fn square(center: Vec3, right: Vec3, up: Vec3, half: f32) -> TriangleMesh {
    let corners = [-right - up, right - up, right + up, up - right];
    let positions = corners.map(|corner| (center + corner * half).to_array());
    TriangleMesh::new(positions.to_vec(), vec![[0, 1, 2], [0, 2, 3]])
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut scene = Scene::new();
    let red = scene.add_material(Material::diffuse(Vec3::new(0.7, 0.1, 0.1)));
    scene.add(square(Vec3::ZERO, Vec3::X, Vec3::NEG_Z, 5.0));
    scene.add(square(Vec3::new(0.0, 1.5, 0.0), Vec3::X, Vec3::NEG_Z, 0.8).with_material(red));
    for i in 0..12 {
        let turn = i as f32 * std::f32::consts::TAU / 12.0;
        let position = Vec3::new(3.0 * turn.cos(), 4.0, 3.0 * turn.sin());
        scene.lights.push(Light::point(position, Vec3::splat(0.6)));
    }
    let camera = Camera::look_at(Vec3::new(3.0, 4.0, 6.0), Vec3::new(0.0, 0.5, 0.0));

    let mut session = Session::new(scene, BackendChoice::Auto)?;
    let (image, stats) = session.render(&camera, &Settings::default())?;
    let file = std::env::temp_dir().join("lightmesh-example.png");
    OutputTarget::new(Path::new(&file))?.write(&image, &ImageOptions::default())?;
    println!("{}: {} mesh points evaluated", file.display(), stats.mesh_points.direct.evaluated);
    Ok(())
}
