//! A second camera, another radius and a switched light: what mesh points know is not traced again.
//! `cargo run --release --example second_view`

use std::error::Error;

use glam::Vec3;
use lightmesh::accel::BackendChoice;
use lightmesh::render::Session;
use lightmesh::scene::load::load_scene_file;
use lightmesh::settings::{Estimator, Leaks, Radius};

fn main() -> Result<(), Box<dyn Error>> {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/interior/scene.toml");
    let loaded = load_scene_file(file.as_ref())?;
    let mut camera = loaded.cameras.first().cloned().ok_or("the scene has no camera")?;
    let mut settings = loaded.settings;
    settings.view.resolution = (320, 200);
    settings.mesh.indirect = None;
    settings.shading.kernel.leaks = Leaks::Allow;
    settings.shading.kernel.radius = Radius::Spacings(2.0);

    let mut session = Session::new(loaded.scene, BackendChoice::Auto)?;
    let render = |what: &str, session: &mut Session, camera: &_, settings: &_| {
        let (_, stats) = session.render(camera, settings)?;
        let points = stats.mesh_points.direct;
        println!(
            "{what}: {} of {} points are new, {} rays",
            points.evaluated, points.needed, stats.rays.shadow
        );
        Ok::<(), Box<dyn Error>>(())
    };
    render("first view", &mut session, &camera, &settings)?;
    camera.position += Vec3::new(0.2, 0.1, 0.0);
    render("a step aside", &mut session, &camera, &settings)?;
    settings.shading.kernel.radius = Radius::Spacings(1.5);
    settings.shading.estimator = Estimator::Directional;
    render("smaller radius, other estimator", &mut session, &camera, &settings)?;
    session.set_intensity(0, Vec3::ZERO)?;
    render("a light switched off", &mut session, &camera, &settings)?;
    Ok(())
}
