//! A model without a camera is seen where there is something to see: rooms from inside, things from outside.

use glam::Vec3;
use lightmesh::accel::{Backend, BackendChoice};
use lightmesh::framing::choose_view;
use lightmesh::scene::load::{LoadedScene, OpenedScene, Skipped};
use lightmesh::scene::{Animation, Falloff, LightKind, Material, Scene};
use lightmesh::settings::Settings;

use crate::common::{Builder, grey};

/// Chooses camera and lights.
fn viewed(builder: Builder, choice: BackendChoice) -> LoadedScene {
    viewed_with(builder, grey(0.8), choice)
}

fn viewed_with(builder: Builder, material: Material, choice: BackendChoice) -> LoadedScene {
    let scene = builder.scene(vec![material], Vec::new(), Falloff::InverseSquare);
    let backend = Backend::build(choice, &scene).unwrap().backend;
    let loaded = LoadedScene {
        scene,
        cameras: Vec::new(),
        animation: Animation::default(),
        settings: Settings::default(),
        skipped: Skipped::default(),
        warnings: Vec::new(),
    };
    let opened = OpenedScene { loaded, choices: Vec::new(), bare: true };
    let opened = choose_view(&opened, &backend).complete(opened);
    assert_eq!(opened.choices.len(), 2, "camera and lights are announced: {:?}", opened.choices);
    opened.loaded
}

fn is_inside(scene: &Scene, x: Vec3) -> bool {
    scene.bounds().contains(x)
}

/// A room of 8 × 3 × 6 with a pillar, whose fronts face inwards.
fn room() -> Builder {
    let mut builder = Builder::default();
    builder.cuboid(Vec3::ZERO, Vec3::new(8.0, 3.0, 6.0), true, 0);
    builder.cuboid(Vec3::new(3.0, 0.0, 2.0), Vec3::new(3.5, 3.0, 2.5), false, 0);
    builder
}

/// From outside there would only be the backs of its walls, and light from outside would not get in.
#[test]
fn a_closed_room_is_seen_and_lit_from_inside() {
    let loaded = viewed(room(), BackendChoice::Bvh);
    assert!(is_inside(&loaded.scene, loaded.cameras[0].position), "{:?}", loaded.cameras[0]);
    for light in &loaded.scene.lights {
        assert!(light.kind == LightKind::Point && is_inside(&loaded.scene, light.position), "{light:?}");
    }
}

/// A box without its side at z = 0, as the Cornell box: nowhere is there more to see than straight in front of it.
#[test]
fn a_box_with_an_open_side_is_seen_through_it() {
    let mut builder = Builder::default();
    let size = Vec3::splat(5.0);
    let (x, y, z) = (Vec3::X * size, Vec3::Y * size, Vec3::Z * size);
    builder.quad(Vec3::ZERO, z, x, 0);
    builder.quad(y, x, z, 0);
    builder.quad(Vec3::ZERO, y, z, 0);
    builder.quad(x, z, y, 0);
    builder.quad(z, y, x, 0);
    builder.cuboid(Vec3::new(1.0, 0.0, 2.0), Vec3::new(2.0, 2.5, 3.0), false, 0);
    let loaded = viewed(builder, BackendChoice::Bvh);
    let camera = &loaded.cameras[0];
    assert!(camera.position.z < 0.0, "{camera:?}");
    let forward = (camera.look_at - camera.position).normalize();
    assert!(forward.dot(Vec3::Z) > 0.999, "{camera:?}");
    assert!(loaded.scene.lights.iter().all(|light| light.position.cmpgt(Vec3::ZERO).all()));
}

/// Six rooms in two rows, each closed.
fn maze() -> Builder {
    let mut builder = Builder::default();
    for room in 0..6u8 {
        let corner = Vec3::new(f32::from(room) * 5.0, 0.0, f32::from(room % 2) * 7.0);
        builder.cuboid(corner, corner + Vec3::new(4.0, 3.0, 6.0), true, 0);
    }
    builder
}

/// From no position half of a maze is to be seen, and from outside there are only backs. Cut open, all of it is in view,
/// and lit.
#[test]
fn a_maze_is_seen_cut_open() {
    let loaded = viewed(maze(), BackendChoice::Bvh);
    let scene = &loaded.scene;
    assert!(!is_inside(scene, loaded.cameras[0].position), "{:?}", loaded.cameras[0]);
    assert!(scene.materials.iter().all(|material| material.cull));
    for room in 0..6u8 {
        let middle = Vec3::new(f32::from(room) * 5.0 + 2.0, 1.5, f32::from(room % 2) * 7.0 + 3.0);
        let is_near = |x: Vec3| (x - middle).abs().cmple(Vec3::new(2.0, 1.5, 3.0)).all();
        assert!(scene.lights.iter().any(|light| is_near(light.position)), "room {room} stays dark");
    }
}

/// Two-sided walls have no back to look through.
#[test]
fn a_maze_with_two_sided_walls_is_seen_from_inside() {
    let loaded = viewed_with(maze(), Material { two_sided: true, ..grey(0.8) }, BackendChoice::Bvh);
    assert!(is_inside(&loaded.scene, loaded.cameras[0].position), "{:?}", loaded.cameras[0]);
    assert!(loaded.scene.materials.iter().all(|material| !material.cull));
}

/// A court of 12 × 8 with walls all around: from the side the nearer wall would hide it.
#[test]
fn rooms_without_ceilings_are_looked_down_into() {
    let mut builder = Builder::default();
    let (x, y, z) = (Vec3::X * 12.0, Vec3::Y * 3.0, Vec3::Z * 8.0);
    builder.quad(Vec3::ZERO, z, x, 0);
    builder.quad(Vec3::ZERO, y, z, 0);
    builder.quad(x, z, y, 0);
    builder.quad(Vec3::ZERO, x, y, 0);
    builder.quad(z, y, x, 0);
    let loaded = viewed(builder, BackendChoice::Bvh);
    let camera = &loaded.cameras[0];
    let down = (camera.position - camera.look_at).normalize().y;
    assert!(down > 0.6 && !is_inside(&loaded.scene, camera.position), "{camera:?}");
    assert!(loaded.scene.materials.iter().all(|material| !material.cull));
}

/// Inside a solid thing there are only backs; beside it there is no room.
#[test]
fn a_thing_is_seen_from_outside() {
    let mut builder = Builder::default();
    builder.cuboid(Vec3::ZERO, Vec3::new(2.0, 1.0, 1.0), false, 0);
    builder.cuboid(Vec3::new(0.5, 1.0, 0.25), Vec3::new(1.0, 2.0, 0.75), false, 0);
    let loaded = viewed(builder, BackendChoice::Bvh);
    assert!(!is_inside(&loaded.scene, loaded.cameras[0].position));
    assert!(loaded.scene.lights.iter().all(|light| matches!(light.kind, LightKind::Directional { .. })));
}

/// The view is a property of the model: it is chosen again as it was, and by what any backend's rays find.
#[test]
fn the_same_view_is_chosen_every_time() {
    let first = viewed(room(), BackendChoice::Bvh).cameras;
    assert_eq!(viewed(room(), BackendChoice::Bvh).cameras, first);
    let other = &viewed(room(), BackendChoice::BruteForce).cameras[0];
    let apart = other.position.distance(first[0].position) + other.look_at.distance(first[0].look_at);
    assert!(apart < 1e-3, "{other:?} instead of {:?}", first[0]);
}
