//! The light at given points in free space, eq. (1): `cargo run --release --example probe`

use std::error::Error;

use glam::Vec3;
use lightmesh::accel::BackendChoice;
use lightmesh::render::Session;
use lightmesh::scene::{Falloff, Light, Scene, TriangleMesh};

fn main() -> Result<(), Box<dyn Error>> {
    // A plate at height 1 hides a lamp at height 3 from what is below the plate.
    let mut scene = Scene::new();
    let corners = vec![[-1.0, 1.0, -1.0], [-1.0, 1.0, 1.0], [1.0, 1.0, 1.0], [1.0, 1.0, -1.0]];
    scene.add(TriangleMesh::new(corners, vec![[0, 1, 2], [0, 2, 3]]));
    scene.lights.push(Light::point(Vec3::new(0.0, 3.0, 0.0), Vec3::splat(9.0)));
    scene.falloff = Falloff::InverseSquare;

    let session = Session::new(scene, BackendChoice::Auto)?;
    let points: Vec<Vec3> = (0..=8).map(|i| Vec3::new(0.5 * i as f32, 0.0, 0.0)).collect();
    println!("x,red,green,blue");
    for (point, light) in points.iter().zip(session.direct_light(&points)) {
        println!("{},{},{},{}", point.x, light.x, light.y, light.z);
    }
    Ok(())
}
